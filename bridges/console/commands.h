// SPDX-License-Identifier: Apache-2.0
// The console's commands. Each takes a client and what was asked, prints to `out` (results) and
// `err` (what is wrong), and gives the program's exit code.
#pragma once

#include <functional>
#include <iosfwd>
#include <string>
#include <vector>

#include "bridges/console/client.h"
#include "bridges/console/model.h"
#include "stack/nmt/state.h"

namespace linegate::console {

inline constexpr int kDone = 0;
inline constexpr int kFailed = 1;  // the gateway or the device said no, or nobody answered
inline constexpr int kUsage = 2;   // what was asked makes no sense
// Printed, but not all: gateways, lines or nodes are missing, which was reported.
inline constexpr int kIncomplete = 3;
// A value or a command was taken, but is not sent yet: what it waits for was printed.
inline constexpr int kHeldBack = 4;

struct Context {
  Client& client;
  std::ostream& out;
  std::ostream& err;
  bool json = false;
  bool utc = false;  // times are printed in UTC, otherwise in local time; JSON has always UTC
  Duration wait = std::chrono::seconds(5);     // for a gateway to be heard of
  Duration timeout = std::chrono::seconds(5);  // for an answer
};

// "LINE:NODE": the name or the network-ID of a line, or "GATEWAY/LINE", and the name of a node
// or 1..127, "own" or "all".
struct NodeRef {
  std::string line;
  std::uint8_t node = 0;
  bool own = false;
  bool all = false;
  std::string name{};  // of the node, not looked up yet: node is 0
};

int gateways(Context& context);
int lines(Context& context);
int nodes(Context& context, const std::string& line);
// How networks are reached, and what is routed.
int routes(Context& context);
int image(Context& context, const std::string& line, image::Direction direction);

// What is routed between networks, as it happens; those events of it that gateways kept come first.
// count: so many lines printed; 0: until stopped() says so.
int trace(Context& context, std::uint64_t count, const std::function<bool()>& stopped);

// entry: number, name ("drive1.Controlword") or "NODE.INDEX:SUB" (hexadecimal index).
// kHeldBack if its PDO is not sent yet.
int write(Context& context, const std::string& line, const std::string& entry,
          const std::string& value);
// node: LINE:NODE, or LINE:all for one answer of each node that the line is configured with, or
// that is present. type empty: that of the device file, which the gateway has; if it has none,
// bytes, and the number they make. Without a sub-index, as INDEX alone, all variables of an object
// with sub-indices are read where no type is given. via: requested as a device on this line would
// (line::kAsDevice), even if the node's own line is known; empty: the shortest way.
// cached: what a scan read is good enough.
int sdo_read(Context& context, const std::string& node, const std::string& index,
             const std::string& sub, const std::string& type, const std::string& via = "",
             bool cached = false);
// 1010h and 1011h: waits 16 s at least, for a device that stores before it answers.
// type empty: that of the device file; kUsage if there is none, or the value does not fit it.
int sdo_write(Context& context, const std::string& node, const std::string& index,
              const std::string& sub, const std::string& type, const std::string& value,
              const std::string& via = "");
// The same from the image of the inputs if the value is there, valid and in time.
int image_read(Context& context, const std::string& node, const std::string& index,
               const std::string& sub, const std::string& type);
// By PDO if a PDO carries the object, else by SDO; says which. keep: the PDO is not sent before it
// is triggered. kHeldBack if it is not sent for another reason.
int object_write(Context& context, const std::string& node, const std::string& index,
                 const std::string& sub, const std::string& type, const std::string& value,
                 bool keep);
// PDOs that are sent although nothing changed. what: LINE:NODE, number: of the node's RPDO; LINE,
// number: of the line's TPDO, or by_offset: of a byte of the outputs, which all of them carry.
int pdo_trigger(Context& context, const std::string& what, const std::string& number,
                bool by_offset);
int nmt(Context& context, const std::string& command, const std::string& node);
// sender: LINE, or LINE:NODE of a device of a line in the role device. code hexadecimal or decimal;
// bytes: up to 5, hexadecimal.
int emcy(Context& context, const std::string& sender, const std::string& code,
         const std::string& error_register, const std::string& bytes);
// The line's controller goes back to the bus after bus-off.
int bus_restart(Context& context, const std::string& line);
// Changes the faults of a bus without wires, and prints them: each as the options of virtual: are
// written. None: only prints.
int fault(Context& context, const std::string& line, const std::vector<std::string>& faults);
int versions(Context& context, const std::string& line);

}  // namespace linegate::console

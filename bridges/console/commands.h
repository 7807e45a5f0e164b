// SPDX-License-Identifier: Apache-2.0
// The commands of the console. Each takes a client and the request, prints results to `out` and
// errors to `err`, and returns the exit code of the program.
#pragma once

#include <cstdint>
#include <functional>
#include <iosfwd>
#include <string>
#include <vector>

#include "bridges/console/client.h"
#include "bridges/console/model.h"
#include "stack/nmt/state.h"

namespace linegate::console {

inline constexpr int kDone = 0;
inline constexpr int kFailed = 1;  // the gateway or the device refused, or did not answer
inline constexpr int kUsage = 2;   // the arguments are invalid
// The output is incomplete: gateways, lines or nodes are missing; or it mixes values of several
// gateways of one name. Both were reported.
inline constexpr int kIncomplete = 3;
// A value or a command was accepted but not sent yet; the reason was printed.
inline constexpr int kHeldBack = 4;

// How the client takes part in DDS, for messages.
struct DdsSettings {
  std::uint32_t domain = 0;
  std::string security{};  // folder of its identity; empty: without DDS-Security
  std::string profile{};   // file of QoS profiles; empty: the default one
};

struct Context {
  Client& client;
  std::ostream& out;
  std::ostream& err;
  bool json = false;
  bool utc = false;  // print times in UTC instead of local time; JSON always has UTC
  Duration wait = std::chrono::seconds(5);     // for the discovery of a gateway
  Duration timeout = std::chrono::seconds(5);  // for an answer
  // For a name that a gateway does not have: since all of its lines are received
  Duration quiet = std::chrono::seconds(2);
  DdsSettings dds{};
};

// "LINE:NODE": the name or the network-ID of a line, or "GATEWAY/LINE", and the name of a node
// or 1..127, "own" or "all".
struct NodeRef {
  std::string line;
  std::uint8_t node = 0;
  bool own = false;
  bool all = false;
  std::string name{};  // of the node; node is 0 until it is resolved
};

int gateways(Context& context);
int lines(Context& context);
int nodes(Context& context, const std::string& line);
// Prints the routes between networks and the routing counters.
int routes(Context& context);
int image(Context& context, const std::string& line, image::Direction direction);

// Prints routed connections as they occur, after the routing events that gateways kept. count:
// number of lines to print; 0: until stopped() returns true.
int trace(Context& context, std::uint64_t count, const std::function<bool()>& stopped);

// entry: number, name ("drive1.Controlword") or "NODE.INDEX:SUB" (hexadecimal index).
// kHeldBack if its PDO is not sent yet.
// raw: the value in the PDO itself, not scaled and beyond limits.
int write(Context& context, const std::string& line, const std::string& entry,
          const std::string& value, bool raw = false);
// node: LINE:NODE, or LINE:all for one answer from each node that is configured or present. An
// empty type selects that of the device file, which the gateway has; without one, the bytes are
// printed, and the number they form. INDEX without a sub-index and without a type reads all
// variables of the object. via: send the request as a device on this line would
// (line::NetworkRead::as_device), even if the node's own line is known; empty: the shortest route.
// cached: accept values that a scan read.
int sdo_read(Context& context, const std::string& node, const std::string& index,
             const std::string& sub, const std::string& type, const std::string& via = "",
             bool cached = false);
// 1010h and 1011h wait at least 16 s, because a device may store before it answers. An empty type
// selects that of the device file; kUsage if there is none, or the value does not fit.
int sdo_write(Context& context, const std::string& node, const std::string& index,
              const std::string& sub, const std::string& type, const std::string& value,
              const std::string& via = "");
// Like sdo_read, but from the image of the inputs if the value is there, valid and in time.
int image_read(Context& context, const std::string& node, const std::string& index,
               const std::string& sub, const std::string& type);
// Writes by PDO if a PDO carries the object, else by SDO, and prints which. keep: do not send the
// PDO until it is triggered. kHeldBack if it is not sent for another reason.
int object_write(Context& context, const std::string& node, const std::string& index,
                 const std::string& sub, const std::string& type, const std::string& value,
                 bool keep);
// Sends PDOs although nothing changed. what: LINE:NODE, with the number of the node's RPDO; or
// LINE, with the number of the line's TPDO, or by_offset: all PDOs that carry that byte of the
// outputs.
int pdo_trigger(Context& context, const std::string& what, const std::string& number,
                bool by_offset);
int nmt(Context& context, const std::string& command, const std::string& node);
// sender: LINE, or LINE:NODE of a device of a line in the role device. code: hexadecimal or
// decimal; bytes: up to 5, hexadecimal.
int emcy(Context& context, const std::string& sender, const std::string& code,
         const std::string& error_register, const std::string& bytes);
// Restarts the line's controller after bus-off.
int bus_restart(Context& context, const std::string& line);
// Changes the faults of a virtual bus and prints them, in the syntax of the options of virtual:. An
// empty list only prints.
int fault(Context& context, const std::string& line, const std::vector<std::string>& faults);
int versions(Context& context, const std::string& line);

}  // namespace linegate::console

// SPDX-License-Identifier: Apache-2.0
// What plant.yaml says, as plain values: everything the gateway needs to know before it runs.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "bridges/can/interface_uri.h"
#include "stack/base/diagnostic.h"
#include "stack/base/time.h"
#include "stack/line/config.h"
#include "stack/line/following.h"

namespace linegate::config {

enum class LogLevel : std::uint8_t { trace, debug, info, warning, error, off };
std::string_view name(LogLevel level);
std::optional<LogLevel> parse_log_level(std::string_view text);

// What subscribers may do to a line. read: what changes nothing.
enum class Access : std::uint8_t { off, read, all };
std::string_view name(Access access);

enum class Scheme : std::uint8_t {
  socketcan,    // an interface of the kernel
  virtual_bus,  // a bus inside this process, shared by all who name it
  simulated,    // a virtual bus of the line's own, with simulated devices on it
  replay,       // a candump log
  udp,          // frames in datagrams of a multicast group
};

struct Interface {
  std::string uri;  // as written, "socketcan:can0"
  Scheme scheme = Scheme::simulated;
  std::string name;  // "can0"; for simulated: the line's name; for replay: the path
  std::vector<can_bridge::UriOption> options;  // checked
};
// Any interface but simulated:. Relative paths start from folder. If text is none, error says why.
Interface parse_interface(std::string_view text, const std::string& folder, std::string& error);

// A line recorded as candump log.
struct Record {
  std::string file;                      // path; see gateway/record_file.h
  std::uint64_t max_size = 100'000'000;  // bytes a file, >= 1000
  unsigned files = 10;                   // kept, the newest included, >= 1
};

// When a sample of the process image is due.
struct Publish {
  enum class Rule : std::uint8_t {
    on_change,  // an entry changed, and `time` has passed since the last sample
    on_sync,    // with every SYNC
    period,     // every `time`
  };
  Rule rule = Rule::on_change;
  Duration time = std::chrono::milliseconds(10);
};
std::string_view name(Publish::Rule rule);

struct SimulatedDevice {
  std::uint8_t node = 0;
  std::string profile;                  // one of sim::profiles()
  bool unconfigured = false;            // without a node-ID, until LSS gives it one
  std::optional<std::uint32_t> serial;  // 1018h:4
};

// A line that is configured by what is on it.
struct AutoScan {
  bool at_start = true;  // it scans by itself until it finds something
  bool set_up = false;   // line::kScanSetUp
  std::string eds;       // folder of device files that give names and types; empty = none
};

// A thread that runs lines. Lines that name none have one each.
struct ExecutorPlan {
  std::string name;
  int priority = 0;                   // SCHED_FIFO 1..99, 0 = ordinary
  std::optional<unsigned> processor;  // pinned to it
  bool lock_memory = false;
};

struct LinePlan {
  line::LineConfig config;  // complete: Line::make(config) gives the line
  Interface interface;
  Access commands = Access::read;
  Access outputs = Access::read;
  Publish publish;
  Duration pdo_min_period = std::chrono::milliseconds(100);  // of one PdoUpdate instance
  std::string executor;                                      // empty = one of its own
  std::optional<AutoScan> auto_scan;                         // only where no nodes are configured
  std::vector<SimulatedDevice> simulated;                    // on the bus of a simulated: line
  std::string storage;  // folder that keeps what 1010h stores; empty = none
  std::optional<Record> record;
  // All that the line was read from, its executor, its device files and what follows what included:
  // two plans with the same source are the same but for `routes`.
  std::string source;
  // How other networks are reached from it, which changes while it runs (Line::set_routes()); the
  // same for the same routes in another order.
  std::string routes;
};

using line::WhenLost;

// An output that follows an input of the same or another line: one of them belongs to a device of a
// line in the role device (`bind:`), or the values of a PDO are forwarded (`forward:`).
struct Binding : line::Following {
  std::string from;        // line
  std::string to;          // line
  std::string input_name;  // of the entries, for people
  std::string output_name;
  std::optional<od::Address> object;  // B000h.. in both lines, if it is forwarded and has one
};

struct Plant {
  std::string file;
  std::string gateway = "linegate";  // name on the wire, 1..64 characters
  LogLevel log = LogLevel::info;
  std::uint32_t dds_domain = 0;  // 0..232
  // Other participants of the domain that are taken note of; 0: what the profile says, or 100.
  std::uint32_t dds_participants = 0;
  std::string dds_profile;  // path of the XML file; empty = the one installed
  bool dds_guard = true;    // judge what is received before Fast DDS does
  // How long the end waits until subscribers have the last samples; not in plant.yaml.
  Duration dds_last_words = std::chrono::milliseconds(500);
  std::vector<ExecutorPlan> executors;
  std::vector<LinePlan> lines;
  std::vector<Binding> bindings;
};

// Reads the file, the device files it names and everything that follows from them; opens nothing
// else. All findings at once, each with file, line and column.
Loaded<Plant> load(const std::string& path);
// The line of that name alone, as if it were the only one: what joins it with others (routes,
// forwarding, values that follow) is left out, and no file of another line is opened. Without such
// a line it is as load().
Loaded<Plant> load_line(const std::string& path, const std::string& line);

// The same from text. file: for messages, and the place relative paths start from.
Loaded<Plant> read(const std::string& text, const std::string& file);

}  // namespace linegate::config

// SPDX-License-Identifier: Apache-2.0
// The contents of plant.yaml as plain values: everything the gateway needs before it runs.
#pragma once

#include <algorithm>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "bridges/can/interface_uri.h"
#include "bridges/named/device_types.h"
#include "bridges/named/group_types.h"
#include "stack/base/diagnostic.h"
#include "stack/base/time.h"
#include "stack/line/config.h"
#include "stack/line/following.h"
#include "stack/line/output_write.h"
#include "stack/od/data_type.h"
#include "stack/od/scaling.h"

namespace linegate::config {

enum class LogLevel : std::uint8_t { trace, debug, info, warning, error, off };
std::string_view name(LogLevel level);
std::optional<LogLevel> parse_log_level(std::string_view text);

// What subscribers may do to a line. read: requests that change nothing.
enum class Access : std::uint8_t { off, read, all };
std::string_view name(Access access);

enum class Scheme : std::uint8_t {
  socketcan,    // a network interface of the kernel
  virtual_bus,  // a bus inside this process, shared by all lines that name it
  simulated,    // a private virtual bus with simulated devices
  replay,       // a candump log
  udp,          // frames in datagrams of a multicast group
};

struct Interface {
  std::string uri;  // as written, "socketcan:can0"
  Scheme scheme = Scheme::simulated;
  std::string name;  // "can0"; for simulated: the line's name; for replay: the path
  std::vector<can_bridge::UriOption> options;  // checked
};
// Parses any interface except simulated:. Relative paths start from folder. error: empty, or why
// the text is invalid.
Interface parse_interface(std::string_view text, const std::string& folder, std::string& error);

// Recording of a line as a candump log.
struct Record {
  std::string file;                      // path; see gateway/runtime/record_file.h
  std::uint64_t max_size = 100'000'000;  // bytes in one file, >= 1000
  unsigned files = 10;                   // number of files to keep, including the newest, >= 1
};

// The value history of a line: entries of its process image whose changes the journal stores.
struct History {
  struct Entry {
    image::Direction direction = image::Direction::inputs;
    std::uint8_t node = 0;
    std::string name;  // in the layout

    friend bool operator==(const Entry&, const Entry&) = default;
  };
  std::vector<Entry> entries;
  Duration min_interval = std::chrono::seconds(1);  // between two stored values of an entry
};

// Topics of the devices and output groups of a line, with named members (bridges/named).
struct NamedTopics {
  bool published = false;            // those of devices
  bool ros2 = false;                 // those of devices also for ROS 2
  bool type_information = false;     // those of devices are described over DDS
  std::vector<named::Group> groups;  // of `outputs:` with written_by: named
  Duration min_separation{};  // between two samples of a topic; 0 = each image that has a change
  std::vector<named::Alias> aliases;

  // Whether the group of outputs with that number is written by name.
  bool has_group(std::uint16_t number) const {
    return std::ranges::find(groups, number, &named::Group::number) != groups.end();
  }
};

// The journal of events on disk.
struct Journal {
  std::string file;  // path
  std::uint64_t max_size =
      250'000'000;     // bytes of the file, >= 10 MB; the oldest events are removed
  Duration max_age{};  // older events and values are removed; 0 = no limit
  // Bytes of the value history in the file, beyond max_size; >= 1 MB
  std::uint64_t values_size = 50'000'000;

  friend bool operator==(const Journal&, const Journal&) = default;
};

// When to publish a sample of the process image.
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
  bool unconfigured = false;            // without a node-ID until LSS assigns one
  std::optional<std::uint32_t> serial;  // 1018h:4
  bool fd = false;                      // CANopen FD
  bool emcy_fd = false;                 // its EMCYs have 20 bytes
};

// A line that a scan configures.
struct AutoScan {
  bool at_start = true;  // scan at start until nodes are found
  bool set_up = false;   // line::ScanApply::set_up
  std::string eds;       // folder of device files for names and types; empty = none
};

// A thread that runs lines. A line without `executor` has a thread of its own.
struct ExecutorPlan {
  std::string name;
  int priority = 0;                   // SCHED_FIFO 1..99; 0 = SCHED_OTHER
  std::optional<unsigned> processor;  // processor affinity
  bool lock_memory = false;
};

// A line of another gateway.
struct RemoteLine {
  std::string gateway;
  std::string line;

  friend auto operator<=>(const RemoteLine&, const RemoteLine&) = default;
};

// An output that takes the value of an input of a line of another gateway (`forward:`). It has a
// group of its own, with the name of the source.
struct RemoteInput {
  RemoteLine from;
  std::string entry;         // name in the layout of that line, or NODE.INDEX:SUB
  std::uint16_t group = 0;   // OutputGroup::number
  std::uint32_t output = 0;  // of the output layout
  std::string output_name;
  // Those of the output, which the input must have; scaling: unless one of them has none
  od::DataType type = od::DataType::none;
  std::uint16_t bit_length = 0;  // 1..64
  od::Scaling scaling{};
  // Without a valid value for that long, the reactions follow (line::WatchdogReaction)
  Duration timeout = std::chrono::seconds(5);
  std::uint8_t reactions = line::kHoldOutputs;

  // "hall-b/press.inlet.Pressure"
  std::string source() const { return from.gateway + '/' + from.line + '.' + entry; }
};

// The words of plant.yaml for line::WatchdogReaction bits; "hold" if there are none.
std::vector<std::string_view> reaction_words(std::uint8_t reactions);

struct LineAccess {
  Access commands = Access::read;
  Access outputs = Access::read;
};

// EMCYs of these networks that are received from a line of another gateway.
struct RemoteEmcys {
  routing::GatewayLine from;
  std::uint16_t first = 0;  // network-ID
  std::uint16_t last = 0;
  std::uint8_t interface = 0;  // number of the way, see routing::Interface

  friend bool operator==(const RemoteEmcys&, const RemoteEmcys&) = default;
};

struct LinePlan {
  line::LineConfig config;  // complete: Line::make(config) makes the line
  Interface interface;
  Access commands = Access::read;
  Access outputs = Access::read;
  // Replaces `commands` and `outputs` for the holder of a certificate, by "ROLE/NAME", where ROLE
  // is operator or engineer. Empty without DDS-Security.
  std::map<std::string, LineAccess, std::less<>> clients;
  Publish publish;
  // Between two samples of one PdoUpdate instance
  Duration pdo_min_period = std::chrono::milliseconds(100);
  std::string executor;                    // empty = a thread of its own
  std::optional<AutoScan> auto_scan;       // only if no nodes are configured
  std::vector<SimulatedDevice> simulated;  // on the bus of a simulated: line
  std::string storage;                     // folder for parameters stored by 1010h; empty = none
  std::optional<Record> record;
  History history;
  NamedTopics named;
  std::vector<RemoteInput> remote_inputs;  // ascending by output
  // Everything the line was read from, including its executor, device files and bindings: two plans
  // with the same source differ at most in `routes`.
  std::string source;
  // The routes to other networks, which can change at run time (Line::set_routes()); independent of
  // their order.
  std::string routes;
  // EMCYs that the line sends on behalf of their sources; they change as the routes.
  std::vector<RemoteEmcys> remote_emcys;
};

using line::WhenLost;

// An output that follows an input of the same or another line: one of them belongs to a device of a
// line in the role device (`bind:`), or a PDO value is forwarded (`forward:`).
struct Binding : line::Following {
  std::string from;        // line
  std::string to;          // line
  std::string input_name;  // names of the entries, for messages
  std::string output_name;
  std::uint32_t bits = 0;  // of both
  // Object from B000h on in both lines, if the value is forwarded and has one
  std::optional<od::Address> object;
};

inline constexpr std::uint64_t kLeastDdsMemory = 100'000'000;
inline constexpr std::uint64_t kMostDdsMemory = 2'000'000'000;

struct Plant {
  std::string file;
  std::string gateway = "linegate";  // name in all samples, 1..64 characters
  LogLevel log = LogLevel::info;
  std::uint32_t dds_domain = 0;  // 0..232
  // Largest number of other participants in the domain; 0: that of the profile, or 100.
  std::uint32_t dds_participants = 0;
  // Of this host, by name or address; none: those of the profile. Hosts that multicast does not
  // reach, besides those of the profile.
  std::vector<std::string> dds_interfaces;
  std::vector<std::string> dds_peers;
  // [ID@]HOST[:PORT]: discovery servers, instead of multicast and peers.
  std::vector<std::string> dds_servers;
  // Process images by multicast to the clients that ask for it; only without DDS-Security, and with
  // the guard.
  bool dds_multicast = false;
  std::string dds_profile;   // path of the XML file; empty = the one installed
  std::string dds_security;  // folder of the identity; empty = without DDS-Security
  // Folder of the identity of its requests to other gateways; empty = none. With dds_security
  // alone.
  std::string dds_routes_security;
  bool dds_partitions = false;  // each line has a partition; only without DDS-Security
  bool dds_guard = true;        // check received datagrams before Fast DDS processes them
  // true: DDS runs in a process of its own, which the gateway starts and replaces when it fails;
  // the default of plant.yaml.
  bool dds_own_process = false;
  // Memory in octets beyond which that process is replaced, kLeastDdsMemory..kMostDdsMemory.
  std::uint64_t dds_memory = 512'000'000;
  // The program of that process, and for how long it must run to be replaced at once when it ends;
  // not in plant.yaml. Empty: this program.
  std::string dds_program;
  Duration dds_stable = std::chrono::seconds(10);
  // How long the shutdown waits for subscribers to receive the last samples; not in plant.yaml.
  Duration dds_last_words = std::chrono::milliseconds(500);
  std::optional<Journal> journal;
  std::vector<ExecutorPlan> executors;
  std::vector<LinePlan> lines;
  std::vector<Binding> bindings;
};

// Reads the file, the device files it names and everything that follows from them; opens nothing
// else. Reports all findings at once, each with file, line and column.
Loaded<Plant> load(const std::string& path);
// Reads the line of that name as if it were the only one: routes, forwarding and bindings with
// other lines are omitted, and no file of another line is opened. Without such a line: as load().
Loaded<Plant> load_line(const std::string& path, const std::string& line);

// Reads the configuration from a text. file: its name for messages, and the base of relative paths.
Loaded<Plant> read(const std::string& text, const std::string& file);

}  // namespace linegate::config

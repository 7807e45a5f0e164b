// Everything a line needs to know before it runs. Made by the gateway from plant.yaml and device
// files, or by a test; checked by Line::make().
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "stack/base/time.h"
#include "stack/line/state.h"
#include "stack/node/error_scheme.h"
#include "stack/od/description.h"
#include "stack/routing/config.h"
#include "stack/routing/forward.h"
#include "stack/scan/scanned_node.h"

namespace linegate::line {

// An object written to a node when it is configured, little-endian.
struct ObjectValue {
  od::Address address;
  std::vector<std::byte> data;
};

struct NodeConfig {
  std::uint8_t id = 0;
  std::string name;
  od::DeviceDescription device;  // from its EDS or DCF, resolved with id
  bool mandatory = false;        // 1F81h bit 3
  bool check_identity = true;    // compare 1000h and 1018h:1..3 with the device file where not 0
  std::optional<std::uint32_t> serial;  // expected 1018h:4
  Duration heartbeat{};                 // producer time written to 1017h; 0 = leave it alone
  Duration heartbeat_consumer{};        // 0 = 2.5 x heartbeat
  // Node guarding for devices without a heartbeat: 100Ch and 100Dh. Not together with heartbeat.
  Duration guard_time{};  // 0 = off; whole ms
  std::uint8_t life_time_factor = 0;
  Duration pdo_deadline{};  // longest time between two of its TPDOs, whole ms; 0 = any
  // Of its RPDOs, by number: event-driven ones are sent to it no more often than that; multiples of
  // 100 us. Those that are not named: at will.
  std::map<std::uint16_t, Duration> rpdo_inhibit;
  Duration boot_timeout = std::chrono::seconds(10);  // until presence is `missing`
  std::vector<ObjectValue> objects;                  // written after those of the DCF
  // Nothing is written to it: it is what a scan found of it, and shall stay so. A line that has
  // such a node does not reset its nodes at the start.
  bool as_found = false;
};

// A device of the line itself, in the role device: it runs here, below somebody else's master.
struct DeviceConfig {
  std::uint8_t id = 0;
  std::string name;
  od::DeviceDescription device;  // from its EDS or DCF, resolved with id
};

// Output entries that one application writes. Entries are named "node.index:sub", see gateway.
struct OutputGroup {
  std::uint16_t number = 0;
  std::string name;
  std::vector<std::uint32_t> entries;  // of the output layout; groups are disjoint
  bool send_always = false;            // send on every write, not only on change
};

struct OutputDefault {
  std::uint32_t entry = 0;
  std::uint64_t value = 0;
};

// The line's own identity in its dictionary (1000h, 1018h).
struct Identity {
  std::uint32_t device_type = 0x0000'0195;  // CiA 405 programmable device
  std::uint32_t vendor = 0;
  std::uint32_t product = 0;
  std::uint32_t revision = 0;
  std::uint32_t serial = 0;
};

struct LineConfig {
  std::string name;
  std::uint16_t network_id = 1;  // 1..127
  Role role = Role::manager;
  std::uint8_t node_id = 127;  // own
  std::uint32_t bit_rate = 0;  // bit/s, for the bus load; 0 = unknown
  Identity identity;
  // The own node has 1010h, 1011h and 1020h; of devices of the role device those that have 1010h
  // store by it. See Line::set_medium().
  bool stores_parameters = false;
  // Of EMCYs that the own node sends by itself.
  node::ErrorScheme error_scheme = node::ErrorScheme::number;
  Duration heartbeat{};    // own producer time, 0 = off
  Duration sync_period{};  // 0 = no SYNC producer
  Duration time_period{};  // 0 = no TIME producer
  Duration sdo_timeout = std::chrono::milliseconds(500);
  bool reset_nodes = true;        // NMT reset communication to all at the start
  bool start_nodes = true;        // NMT start when booted (1F80h bit 3 = 0)
  bool stop_nodes = true;         // NMT enter pre-operational to all when the line is stopped
  std::vector<NodeConfig> nodes;  // ascending by id
  // What a scan read, ascending by id, where the nodes are made of that: the next scan that is
  // applied may make others of them. Answers reads from the scan's cache, too.
  std::vector<scan::ScannedNode> scanned;
  // Set up by a scan that is applied, at nodes without error control; whole ms, 1..65535.
  Duration found_heartbeat = std::chrono::milliseconds(500);
  // Role device: 1..127 of them, ascending by id; no nodes and no node_id then. If there are none,
  // the line has the one own node of a manager, which obeys another master.
  std::vector<DeviceConfig> devices;
  std::vector<OutputGroup> groups;  // empty = one group 0 with all others
  std::vector<OutputDefault> defaults;
  // Output entries that follow inputs of this or another line: in no group, and written by
  // Line::write_bound() alone. Ascending.
  std::vector<std::uint32_t> bound;
  // Routing between this line and others.
  routing::Config routing;
  // Objects B000h.. that lines share, manager and device with the one own node.
  routing::Forwarding forwarding;
};

}  // namespace linegate::line

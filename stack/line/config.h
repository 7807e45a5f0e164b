// SPDX-License-Identifier: Apache-2.0
// Everything a line needs to know before it runs. Made by the gateway from plant.yaml and device
// files, or by a test; checked by Line::make().
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "stack/base/time.h"
#include "stack/line/state.h"
#include "stack/manager/plan.h"
#include "stack/node/node.h"
#include "stack/od/description.h"
#include "stack/od/objects.h"
#include "stack/routing/config.h"
#include "stack/routing/forward.h"
#include "stack/scan/scanned_node.h"
#include "stack/sdo/client.h"

namespace linegate::line {

// An object written to a node when it is configured, little-endian.
struct ObjectValue {
  od::Address address;
  std::vector<std::byte> data;
};

// What of the identity in its device file a node must have; a 0 there is never compared.
struct IdentityScope {
  bool device_type = true;            // 1000h
  bool vendor = true;                 // 1018h:1
  bool product = true;                // 1018h:2
  bool revision = true;               // 1018h:3
  bool revision_major_alone = false;  // its upper 16 bits; revision is true then
};

struct NodeConfig {
  std::uint8_t id = 0;
  std::string name;
  od::DeviceDescription device;           // from its EDS or DCF, resolved with id
  bool boot = true;                       // 1F81h bit 2; else only its error control is started
  bool mandatory = false;                 // 1F81h bit 3
  bool keep_alive = false;                // 1F81h bit 4: not reset as long as it is Operational
  IdentityScope check{};                  // compared with the device file when it boots
  std::optional<std::uint32_t> serial{};  // expected 1018h:4
  Duration heartbeat{};                   // producer time written to 1017h; 0 = leave it alone
  Duration heartbeat_consumer{};          // 0 = 2.5 x heartbeat
  // Node guarding for devices without a heartbeat: 100Ch and 100Dh. Not together with heartbeat.
  Duration guard_time{};  // 0 = off; whole ms
  std::uint8_t life_time_factor = 0;
  Duration pdo_deadline{};  // longest time between two of its TPDOs, whole ms; 0 = any
  // Of its RPDOs, by number: event-driven ones are sent to it no more often than that; multiples of
  // 100 us. Those that are not named: at will.
  std::map<std::uint16_t, Duration> rpdo_inhibit{};
  // Of its TPDOs, by number: how many receptions wait to be taken at the most, see
  // Line::take_reception(); 0 = none. Those that are not named: LineConfig::pdo_queue.
  std::map<std::uint16_t, std::uint32_t> tpdo_queue{};
  Duration boot_timeout = std::chrono::seconds(10);  // until presence is `missing`
  Duration reset_time = std::chrono::seconds(1);     // from a reset to its boot-up message, at most
  Duration sdo_timeout{};  // of each answer while it boots; 0 = LineConfig::sdo_timeout
  std::uint32_t block_from = sdo::TransferOptions{}.block_from;  // bytes; sdo::kNoBlocks: never
  std::vector<ObjectValue> objects{};                            // written after those of the DCF
  std::uint8_t restore = 0;  // sub-index of 1011h: defaults before the node is configured; 0 = none
  std::uint8_t store = 0;    // sub-index of 1010h, saved when it is configured; 0 = none. With a
                             // date in 1020h, so that it need not be configured the next time
  std::uint32_t software = 0;      // 1F55h: software identification it is to have; 0 = any
  bool update_software = false;    // 1F81h bit 6: program is loaded if it has another
  manager::SharedBytes program{};  // 1F58h; nullptr = none
  // Nothing is written to it: it is what a scan found of it, and shall stay so. A line that has
  // such a node does not reset its nodes at the start.
  bool as_found = false;
};

// A device of the line itself, in the role device: it runs here, below somebody else's master.
struct DeviceConfig {
  std::uint8_t id = 0;
  std::string name;
  od::DeviceDescription device;  // from its EDS or DCF, resolved with id
  // It is an LSS slave that has no node-ID until it is given one, or the one it stored. id is what
  // it is called by here, whatever node-ID it has.
  bool lss = false;
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

// An application object of the own node, 2000h..5EFFh or 6000h..9FFFh: one sub-index. Where no
// sub-index 0 is given it says which is the highest.
struct OwnObject {
  std::uint16_t index = 0;
  od::VariableDescription variable;  // value: the default
  // Its bytes are in the image: of the inputs if others may write it, else of the outputs.
  bool in_image = false;
  std::uint32_t offset = 0;  // there, in bytes: of those that are created at run time
};
// What is wrong with one by itself, as the end of a sentence about it; empty if nothing is.
std::string_view fault_of(const OwnObject& object);

// The line's own identity in its dictionary (1000h, 1018h).
struct Identity {
  std::uint32_t device_type = 0x0000'0195;  // CiA 405 programmable device
  std::uint32_t vendor = 0;
  std::uint32_t product = 0;
  std::uint32_t revision = 0;
  std::uint32_t serial = 0;
};

// The line's LSS master (CiA 305), role manager.
struct LssConfig {
  // Nodes that have no node-ID are given it before the network boots, by their identity: 1018h of
  // the device file, and the serial number.
  bool assign = false;
  Duration timeout = std::chrono::milliseconds(100);  // for each answer
  Duration period = std::chrono::seconds(5);          // of the search for late comers; 0 = none
  bool store = false;                                 // they keep it
  // Bit rate given besides, in bit/s; they have it when they are switched on the next time. One of
  // the table of CiA 305, and stored; 0 = as it is.
  std::uint32_t bit_rate = 0;
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
  LssConfig lss;
  // From the last CommandKind::object_write of a PDO without event timer until it is asked for,
  // unless all its values were written before; 0 = at once.
  Duration pdo_update_time{};
  // Roles manager and observer: how many receptions of each TPDO of a node wait to be taken at the
  // most, see NodeConfig::tpdo_queue; 0 = none: the newest values are enough.
  std::uint32_t pdo_queue = 0;
  // For the answer of a device to `save` and `load`, writes of its 1010h and 1011h, if they are
  // longer than sdo_timeout.
  Duration save_timeout = std::chrono::seconds(15);
  Duration load_timeout = std::chrono::seconds(3);
  // Fatal to the network, which is stopped then, is what the IXXAT manual calls so, and not only
  // another device with the own node-ID and a mandatory node of a wrong identity or configuration.
  bool strict_ixxat = false;
  // A node that was started and shows another state is started again.
  bool keep_operational = false;
  // Index of the first of the CANopenIA records, see diagnosis/canopen_ia.h.
  std::uint16_t canopen_ia_base = od::objects::kCanopenIa;
  bool reset_nodes = true;  // NMT reset communication to all at the start
  bool start_nodes = true;  // NMT start when booted (1F80h bit 3 = 0)
  bool start_all = false;   // with one command, when all are booted (1F80h bit 1)
  bool own_start = true;    // the own node starts by itself (1F80h bit 2 = 0)
  manager::ErrorReaction on_error = manager::ErrorReaction::node;  // 1F80h bits 4 and 6
  Duration boot_time{};           // of mandatory nodes (1F89h), whole ms; 0 = as long as it takes
  Duration nmt_inhibit{};         // between two NMT commands (102Ah), whole 100 us
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
  // Of the one own node; not for an observer.
  std::vector<OwnObject> own_objects;
  // Entries of its scanner list (1FA0h..) and dispatcher list (1FD0h..), see pdo/mpdo.h. It has
  // these objects if there are entries.
  std::vector<std::uint32_t> mpdo_scanner;
  std::vector<std::uint64_t> mpdo_dispatcher;
  // Written to objects of that node as over SDO, in this order, when the line starts and after each
  // reset of the node, after what was stored. What is refused is EventKind::configuration_error.
  std::vector<ObjectValue> own_values;
  // Routing between this line and others.
  routing::Config routing;
  // Objects B000h.. that lines share, manager and device with the one own node.
  routing::Forwarding forwarding;
};

// The queue of a node's TPDO: how many receptions wait in it at the most, 0 if it has none.
std::uint32_t queue_of(const LineConfig& config, std::uint8_t node, std::uint16_t tpdo);
// The longest queue of the configuration, 0 if there is none.
std::uint32_t longest_queue(const LineConfig& config);

}  // namespace linegate::line

// SPDX-License-Identifier: Apache-2.0
// The complete configuration of a line. Created by the gateway from plant.yaml and device files, or
// by a test; checked by Line::make().
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "stack/base/time.h"
#include "stack/line/own_object.h"
#include "stack/line/state.h"
#include "stack/manager/connection.h"
#include "stack/manager/plan.h"
#include "stack/nmt/sleep_protocol.h"
#include "stack/node/node.h"
#include "stack/od/description.h"
#include "stack/od/objects.h"
#include "stack/routing/config.h"
#include "stack/routing/forward.h"
#include "stack/scan/scanned_node.h"
#include "stack/sdo/client.h"
#include "stack/usdo/abort_form.h"

namespace linegate::line {

// An object value that is written to a node when it is configured, little-endian.
struct ObjectValue {
  od::Address address;
  std::vector<std::byte> data;
};

// Which parts of the identity in the device file are compared with the node's; a 0 in the file is
// never compared.
struct IdentityScope {
  bool device_type = true;            // 1000h
  bool vendor = true;                 // 1018h:1
  bool product = true;                // 1018h:2
  bool revision = true;               // 1018h:3
  bool revision_major_alone = false;  // only its upper 16 bits; revision is then true
};

struct NodeConfig {
  std::uint8_t id = 0;
  std::string name;
  od::DeviceDescription device;           // from its EDS or DCF, resolved with id
  bool boot = true;                       // 1F81h bit 2; else only its error control is monitored
  bool mandatory = false;                 // 1F81h bit 3
  bool keep_alive = false;                // 1F81h bit 4: not reset while it is Operational
  IdentityScope check{};                  // compared with the device file when it boots
  std::optional<std::uint32_t> serial{};  // expected 1018h:4
  Duration heartbeat{};           // producer time written to 1017h; 0 = leave 1017h unchanged
  Duration heartbeat_consumer{};  // 0 = 2.5 x heartbeat
  // Node guarding for devices without a heartbeat: 100Ch and 100Dh. Not together with heartbeat.
  Duration guard_time{};  // 0 = off; whole ms
  std::uint8_t life_time_factor = 0;
  Duration pdo_deadline{};  // longest time between two of its TPDOs, whole ms; 0 = no limit
  // By number of its RPDO: the shortest time between two transmissions of an event-driven one, in
  // multiples of 100 us. RPDOs that are not listed have no inhibit time.
  std::map<std::uint16_t, Duration> rpdo_inhibit{};
  // By number of its TPDO: the largest number of receptions that wait to be taken, see
  // Line::pop_reception(); 0 = no queue. TPDOs that are not listed have LineConfig::pdo_queue.
  std::map<std::uint16_t, std::uint32_t> tpdo_queue{};
  // By number of the SRDO that it transmits: the SCT, the longest time from one valid pair to the
  // next; those that are not listed have twice the refresh time in 1301h and following.
  std::map<std::uint8_t, Duration> srdo_cycle{};
  // By number of the SRDO that it transmits: the SRVT, from the normal frame to the inverted one;
  // those that are not listed have that in 1301h and following.
  std::map<std::uint8_t, Duration> srdo_validation{};
  Duration boot_timeout = std::chrono::seconds(10);  // time until presence becomes `missing`
  // Longest time from a reset to the boot-up message
  Duration reset_time = std::chrono::seconds(1);
  Duration sdo_timeout{};  // of each response while it boots; 0 = LineConfig::sdo_timeout
  std::uint32_t block_from = sdo::TransferOptions{}.block_from;  // bytes; sdo::kNoBlocks: never
  std::vector<ObjectValue> objects{};                            // written after those of the DCF
  std::uint8_t restore = 0;  // sub-index of 1011h: restores defaults before configuration; 0 = none
  std::uint8_t store = 0;    // sub-index of 1010h, stored after configuration; 0 = none. With a
                             // date in 1020h, so that the next boot can skip the configuration
  std::uint32_t software = 0;      // 1F55h: expected software identification; 0 = any
  bool update_software = false;    // 1F81h bit 6: load the program if the identification differs
  manager::SharedBytes program{};  // 1F58h; nullptr = none
  // Write nothing to it: a scan found it with its present configuration, which must not change. A
  // line that has such a node does not reset its nodes at the start.
  bool as_found = false;
};

// A device of the line itself, role device: it runs in this process, below another master.
struct DeviceConfig {
  std::uint8_t id = 0;
  std::string name;
  od::DeviceDescription device;  // from its EDS or DCF, resolved with id
  // It is an LSS slave without a node-ID until LSS assigns one, unless it stored one. id identifies
  // the device in this process, whatever node-ID it has on the bus.
  bool lss = false;
};

// Output entries that one application writes. Entries are named "node.index:sub", see
// gateway/config.
struct OutputGroup {
  std::uint16_t number = 0;
  std::string name;
  std::vector<std::uint32_t> entries;  // of the output layout; groups are disjoint
  bool send_always = false;            // send on every write, not only on change
  // The values come from a line of another gateway: only writes with OutputWrite::forwarded are
  // applied, and no other request changes the entries.
  bool forwarded = false;
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

// The line's LSS master (CiA 305), role manager.
struct LssConfig {
  // Assign node-IDs before the network boots to nodes that have none, by their identity: 1018h of
  // the device file, and the serial number.
  bool assign = false;
  Duration timeout = std::chrono::milliseconds(100);  // for each response
  // Of the search for devices that are connected later; 0 = no search
  Duration period = std::chrono::seconds(5);
  bool store = false;  // the devices store the node-ID
  // Bit rate in bit/s that is configured as well; it takes effect at the next power-on. One of the
  // table of CiA 305, and always stored; 0 = unchanged.
  std::uint32_t bit_rate = 0;
};

// The own node of a manager as a flying master (CiA 302-2): it competes with others for the role of
// the NMT master. The times are whole ms, at most 65535, and the values of 1F90h.
struct FlyingMasterConfig {
  std::uint8_t priority = 2;                                    // 1F90h:3; 0..2, 0 is the highest
  Duration master_timeout = std::chrono::milliseconds(100);     // 1F90h:1
  Duration negotiation_delay = std::chrono::milliseconds(500);  // 1F90h:2
  Duration priority_slot = std::chrono::milliseconds(1500);     // 1F90h:4, above 127 device slots
  Duration device_slot = std::chrono::milliseconds(10);         // 1F90h:5
  Duration detect_cycle{};  // 1F90h:6; 0 = 4000 ms + 10 ms x own node-ID
  // Consumer heartbeat time of the active master (1016h); 0 = twice the own producer time.
  Duration master_heartbeat{};
  // What the active master sends each detect cycle: 076h, else 073h.
  bool forces_each_cycle = false;
};

struct LineConfig {
  std::string name;
  std::uint16_t network_id = 1;  // 1..127
  Role role = Role::manager;
  std::uint8_t node_id = 127;  // own
  std::uint32_t bit_rate = 0;  // bit/s, for the bus load; 0 = unknown
  // CANopen FD (CiA 1301), role manager: USDO instead of SDO, PDOs of up to 64 bytes.
  bool canopen_fd = false;
  std::uint32_t data_bit_rate = 0;  // bit/s of the data phase of FD frames; 0 = unknown
  usdo::AbortForm usdo_abort = usdo::AbortForm::one_byte;  // of the line's own aborts
  bool emcy_fd = false;                                    // see node::Options
  Identity identity;
  // The own node has 1010h, 1011h and 1020h. In the role device, those devices store that have
  // 1010h. See Line::set_medium().
  bool stores_parameters = false;
  // For EMCYs that the own node generates itself.
  node::ErrorScheme error_scheme = node::ErrorScheme::number;
  Duration heartbeat{};    // own producer time, 0 = off
  Duration sync_period{};  // 0 = no SYNC producer
  Duration time_period{};  // 0 = no TIME producer
  Duration sdo_timeout = std::chrono::milliseconds(500);
  LssConfig lss;
  // Time from the last CommandKind::object_write to a PDO without event timer until the PDO is
  // requested, unless all its values were written earlier; 0 = immediately.
  Duration pdo_update_time{};
  // The shares of the bit rate that commands and outputs of all clients, and of each client, may
  // use, in thousandths, 1..1000: see RequestBudget.
  std::uint16_t request_share = 300;
  std::uint16_t client_share = 150;
  // Roles manager and observer: the largest number of receptions of each TPDO of a node that wait
  // to be taken, see NodeConfig::tpdo_queue; 0 = no queue: only the newest values are kept.
  std::uint32_t pdo_queue = 0;
  // SDO time-out of `save` and `load`, writes to 1010h and 1011h of a device, if longer than
  // sdo_timeout.
  Duration save_timeout = std::chrono::seconds(15);
  Duration load_timeout = std::chrono::seconds(3);
  // Errors that the IXXAT manual calls fatal stop the network. Otherwise only another device with
  // the own node-ID and a mandatory node with a wrong identity or configuration do.
  bool strict_ixxat = false;
  // Start a node again if it was started and reports another state.
  bool keep_operational = false;
  nmt::SleepProtocol sleep;  // roles manager and observer, and device with the single own node
  // Index of the first of the CANopenIA records, see diagnosis/canopen_ia.h.
  std::uint16_t canopen_ia_base = od::objects::kCanopenIa;
  bool reset_nodes = true;  // send NMT reset communication to all nodes at the start
  bool start_nodes = true;  // send NMT start to a booted node (1F80h bit 3 = 0)
  bool start_all = false;   // one NMT start for all, when all are booted (1F80h bit 1)
  bool own_start = true;    // the own node starts itself (1F80h bit 2 = 0)
  manager::ErrorReaction on_error = manager::ErrorReaction::node;  // 1F80h bits 4 and 6
  // Role manager: 1F80h bit 5 is set. The line is NMT master only while its own node is the active
  // one, and a slave otherwise.
  std::optional<FlyingMasterConfig> flying_master;
  Duration boot_time{};    // of mandatory nodes (1F89h), whole ms; 0 = no limit
  Duration nmt_inhibit{};  // between two NMT commands (102Ah), whole 100 us
  // Send NMT enter pre-operational to all nodes when the line is stopped; an active flying master
  // to those that are not to be kept alive.
  bool stop_nodes = true;
  std::vector<NodeConfig> nodes;  // ascending by id
  // The nodes as a scan read them, ascending by id, if `nodes` was made from a scan: the next scan
  // that is applied may then replace them. They also answer reads from the scan cache.
  std::vector<scan::ScannedNode> scanned;
  // Producer time that an applied scan configures on nodes without error control; whole
  // ms, 1..65535.
  Duration found_heartbeat = std::chrono::milliseconds(500);
  // Role device: 1..127 devices, ascending by id; without nodes and node_id. If there are none, the
  // line has one own node like a manager, which is a slave of another master.
  std::vector<DeviceConfig> devices;
  std::vector<OutputGroup> groups;  // empty = one group 0 with all unbound entries
  std::vector<OutputDefault> defaults;
  // Output entries that follow inputs of this or another line: in no group, and written only by
  // Line::write_bound(). Ascending.
  std::vector<std::uint32_t> bound;
  // Of the single own node; not for an observer.
  std::vector<OwnObject> own_objects;
  // Entries of the own node's scanner list (1FA0h..) and dispatcher list (1FD0h..), see pdo/mpdo.h.
  // The objects exist if there are entries.
  std::vector<std::uint32_t> mpdo_scanner;
  std::vector<std::uint64_t> mpdo_dispatcher;
  // Written to objects of the own node as by SDO, in this order, when the line starts and after
  // each reset of the node, after the stored parameters. A rejected value is reported as
  // EventKind::configuration_error.
  std::vector<ObjectValue> own_values;
  // Routing between this line and others.
  routing::Config routing;
  // CAN-IDs of SDO connections between nodes, role manager: see CommandKind::connection_open.
  manager::ConnectionPool connection_pool{};
  // Objects B000h.. that are forwarded between lines; manager, and device with the single own node.
  routing::Forwarding forwarding;
};

// The longest PDO on the line, in bits.
std::size_t longest_pdo(const LineConfig& config);
// The queue of a node's TPDO: the largest number of receptions in it, 0 = no queue.
std::uint32_t queue_of(const LineConfig& config, std::uint8_t node, std::uint16_t tpdo);
// The longest queue of the configuration, 0 if there is none.
std::uint32_t longest_queue(const LineConfig& config);

}  // namespace linegate::line

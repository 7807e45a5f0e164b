// What the manager is to do with each node, decided when the configuration is loaded.
#pragma once

#include <cstdint>
#include <vector>

#include "stack/base/time.h"
#include "stack/od/description.h"

namespace linegate::manager {

// One SDO download of the configuration step.
struct ObjectWrite {
  od::Address address;
  std::vector<std::byte> data;  // little-endian
};

// CiA 302-2: what 1F81h, 1F84h..1F88h and 1F8Ah of one node begin with, and what no object says.
// Expected values of 0 are not compared.
struct NodePlan {
  std::uint8_t id = 0;
  bool boot = true;  // else only its error control is started
  bool mandatory = false;
  bool keep_alive = false;   // not reset as long as it is Operational
  std::uint8_t restore = 0;  // sub-index of 1011h, 0 = none
  std::uint32_t device_type = 0;
  std::uint32_t vendor = 0;
  std::uint32_t product = 0;
  std::uint32_t revision = 0;
  std::uint32_t serial = 0;
  Duration heartbeat_consumer{};  // 0 = guarding, or no error control
  Duration guard_time{};          // 0 = the node is not guarded
  std::uint8_t life_time_factor = 0;
  Duration boot_timeout = std::chrono::seconds(10);  // without an answer: boot status B
  Duration reset_time = std::chrono::seconds(1);     // from a reset to its boot-up message, at most
  Duration sdo_timeout{};                            // 0 = Options::sdo_timeout
  std::vector<ObjectWrite> writes{};                 // in this order
};

// What happens when a mandatory node is lost (1F80h bits 4 and 6).
enum class ErrorReaction : std::uint8_t {
  node,       // it is reset and booted again, as any other
  reset_all,  // the network is started anew
  stop_all,   // all nodes are stopped, the own one too
};

struct Options {
  bool reset_nodes = true;  // NMT reset communication at the start
  Duration sdo_timeout = std::chrono::milliseconds(500);
  // What 1F80h, 1F89h and 102Ah begin with.
  bool master = true;       // bit 0
  bool start_all = false;   // bit 1: with one command, when the boot is complete
  bool own_start = true;    // bit 2 = 0: the own node becomes Operational by itself
  bool start_nodes = true;  // bit 3 = 0: the manager starts the nodes
  ErrorReaction on_error = ErrorReaction::node;
  Duration boot_time{};    // of mandatory nodes; 0 = as long as it takes
  Duration nmt_inhibit{};  // between two NMT commands, whole 100 us
};

// The downloads that bring a device from what its file describes as default to what it describes as
// configured (DCF ParameterValue), but for objects whose ObjFlags (CiA 306) say that they are not
// to be written, in an order every device accepts: parameters outside the PDO records first; then
// each PDO record as CiA 301 7.5.2.36 wants it: COB-ID invalid, mapping count 0, entries, count,
// other parameters, COB-ID valid.
std::vector<ObjectWrite> configuration_writes(const od::DeviceDescription& device);

}  // namespace linegate::manager

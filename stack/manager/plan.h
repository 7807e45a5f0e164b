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

// CiA 302-2: 1F81h, 1F84h..1F88h of one node. Expected values of 0 are not compared.
struct NodePlan {
  std::uint8_t id = 0;
  bool mandatory = false;
  std::uint32_t device_type = 0;
  std::uint32_t vendor = 0;
  std::uint32_t product = 0;
  std::uint32_t revision = 0;
  std::uint32_t serial = 0;
  Duration heartbeat_consumer{};  // 0 = guarding, or no error control
  Duration guard_time{};          // 0 = the node is not guarded
  std::uint8_t life_time_factor = 0;
  Duration boot_timeout = std::chrono::seconds(10);  // without an answer: boot status B
  std::vector<ObjectWrite> writes;                   // in this order
};

struct Options {
  bool reset_nodes = true;  // NMT reset communication to all at the start
  bool start_nodes = true;  // 1F80h bit 3 = 0: the manager starts the nodes
  Duration sdo_timeout = std::chrono::milliseconds(500);
};

// The downloads that bring a device from what its file describes as default to what it describes as
// configured (DCF ParameterValue), but for objects whose ObjFlags (CiA 306) say that they are not
// to be written, in an order every device accepts: parameters outside the PDO records first; then
// each PDO record as CiA 301 7.5.2.36 wants it: COB-ID invalid, mapping count 0, entries, count,
// other parameters, COB-ID valid.
std::vector<ObjectWrite> configuration_writes(const od::DeviceDescription& device);

}  // namespace linegate::manager

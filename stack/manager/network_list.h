// SPDX-License-Identifier: Apache-2.0
// The objects 1F80h to 1F8Ah of the own dictionary (CiA 302-2): the network list, the expected
// values of each node, and the start-up settings. They are stored only in the dictionary and read
// from there each time, so that a written value applies from the next boot process on.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "stack/base/time.h"
#include "stack/can/cob_id.h"
#include "stack/manager/plan.h"
#include "stack/od/description.h"
#include "stack/od/dictionary.h"
#include "stack/od/objects.h"

namespace linegate::manager {

// Bits of 1F80h.
namespace startup {
inline constexpr std::uint32_t kMaster = 1U << 0U;    // the own node is the NMT master
inline constexpr std::uint32_t kStartAll = 1U << 1U;  // with one command, when the boot is complete
// The own node does not enter Operational by itself
inline constexpr std::uint32_t kApplicationStarts = 1U << 2U;
inline constexpr std::uint32_t kSlavesNotStarted = 1U << 3U;  // the application starts them
inline constexpr std::uint32_t kResetAll = 1U << 4U;      // on an error event of a mandatory node
inline constexpr std::uint32_t kFlyingMaster = 1U << 5U;  // with kMaster, and only with 1F90h
// On such an event; takes precedence over kResetAll
inline constexpr std::uint32_t kStopAll = 1U << 6U;
inline constexpr std::uint32_t kSupported =
    kMaster | kStartAll | kApplicationStarts | kSlavesNotStarted | kResetAll | kStopAll;
}  // namespace startup

// Bits of 1F81h. Bits 8 to 15: life time factor, 16 to 31: guard time in ms.
namespace assignment {
inline constexpr std::uint32_t kListed = 1U << 0U;
inline constexpr std::uint32_t kBoot = 1U << 2U;  // if 0, only its error control is started
inline constexpr std::uint32_t kMandatory = 1U << 3U;
inline constexpr std::uint32_t kKeepAlive = 1U << 4U;
inline constexpr std::uint32_t kVerifySoftware = 1U << 5U;
inline constexpr std::uint32_t kUpdateSoftware = 1U << 6U;
inline constexpr std::uint32_t kRestore = 1U << 7U;
}  // namespace assignment

class NetworkList {
 public:
  // dictionary must outlive this object. Missing objects read as 0.
  explicit NetworkList(const od::Dictionary& dictionary) : dictionary_(dictionary) {}

  std::uint32_t startup() const { return number({od::objects::kNmtStartup, 0}); }
  std::uint32_t assignment(std::uint8_t node) const {
    return number({od::objects::kSlaveAssignment, node});
  }
  bool has(std::uint8_t node, std::uint32_t bits) const {
    return (assignment(node) & bits) == bits;
  }
  bool listed(std::uint8_t node) const { return has(node, assignment::kListed); }
  bool mandatory(std::uint8_t node) const {
    return has(node, assignment::kListed | assignment::kMandatory);
  }
  // 1F84h to 1F88h; 0 = not compared.
  std::uint32_t expected(std::uint16_t index, std::uint8_t node) const {
    return number({index, node});
  }
  Duration guard_time(std::uint8_t node) const {
    return std::chrono::milliseconds(assignment(node) >> 16U);
  }
  std::uint8_t life_time_factor(std::uint8_t node) const {
    return static_cast<std::uint8_t>(assignment(node) >> 8U);
  }
  // Time limit for mandatory nodes, from the start on; 0 = unlimited.
  Duration boot_time() const {
    return std::chrono::milliseconds(number({od::objects::kBootTime, 0}));
  }
  // Sub-index of 1011h that is written before the node is configured; 0 = none.
  std::uint8_t restore(std::uint8_t node) const {
    return static_cast<std::uint8_t>(number({od::objects::kRestoreConfiguration, node}));
  }

 private:
  std::uint32_t number(od::Address address) const {
    return static_cast<std::uint32_t>(dictionary_.number(address).value_or(0));
  }

  const od::Dictionary& dictionary_;
};

// 102Ah and 1F80h to 1F8Ah with the configured values, for a dictionary that is yet to be created.
std::vector<od::ObjectDescription> network_objects(const std::vector<NodePlan>& plans,
                                                   const Options& options);

inline constexpr std::uint8_t kAllNodes = 128;  // sub-index of a request to all nodes

// An object of the manager's dictionary with a value for each node, like most objects of CiA 302.
// Sub-index 0 and 1..last, by node-ID; kAllNodes stands for all nodes. All values are 0.
// Precondition: the catalogue (od/objects.h) has the index.
od::ObjectDescription node_array(std::uint16_t index, od::Access access,
                                 std::uint8_t last = can::kMaxNodeId);

}  // namespace linegate::manager

// SPDX-License-Identifier: Apache-2.0
// The node-IDs that two devices on a bus have at the same time, derived from the devices: the
// oracle for reports of a shared node-ID.
//   shared_node_id is reported only for a node-ID that two devices have, or had while its sign
//   arose
#pragma once

#include <array>
#include <cstdint>
#include <string>

#include "stack/base/event.h"
#include "stack/base/time.h"
#include "stack/can/cob_id.h"

namespace linegate::plant {

class IdentityModel {
 public:
  // A sign may become complete after one of the devices has disappeared. It consists of at most
  // eight heartbeat times (stack/manager/shared_id.h), which are shorter than 300 ms in a plant, or
  // of responses to requests within DoubleAnswers::kRow (stack/sdo/double_answers.h).
  static constexpr Duration kHeartbeats = std::chrono::milliseconds(8 * 300);
  static constexpr Duration kAnswers = std::chrono::milliseconds(10'500);

  // A device begins or ends to use a node-ID; 0 = none.
  void begins(std::uint8_t node_id);
  void ends(std::uint8_t node_id, Instant now);
  // A foreign station sends heartbeats with this node-ID. Reports of this node-ID are not checked.
  void imitated(std::uint8_t node_id) { imitated_[node_id] = true; }
  // A description of the rule that the event violates, or nothing.
  std::string judge(const Event& event, Instant now) const;

 private:
  static constexpr unsigned kTwo = 2;

  std::array<unsigned, can::kMaxNodeId + 1> users_{};
  // The last end of sharing, 0 = it was never shared
  std::array<Instant, can::kMaxNodeId + 1> shared_{};
  std::array<bool, can::kMaxNodeId + 1> imitated_{};
};

}  // namespace linegate::plant

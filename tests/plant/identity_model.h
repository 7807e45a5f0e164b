// SPDX-License-Identifier: Apache-2.0
// Which node-IDs two devices of a bus have at one time, from the devices themselves: what may be
// reported of a node-ID that is shared.
//   shared_node_id is reported of a node-ID that two devices have, or had while its sign arose
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
  // A sign may be complete when one of the devices has gone. It consists of at most eight
  // heartbeat times (stack/manager/shared_id.h), and those of a plant are shorter than 300 ms; or
  // of answers to requests within DoubleAnswers::kRow (stack/sdo/double_answers.h).
  static constexpr Duration kHeartbeats = std::chrono::milliseconds(8 * 300);
  static constexpr Duration kAnswers = std::chrono::milliseconds(10'500);
  static constexpr std::uint32_t kTwoAnswers = 1;  // Event::code

  // A device begins to use a node-ID, or does not use it any more; 0 = none.
  void begins(std::uint8_t node_id);
  void ends(std::uint8_t node_id, Instant now);
  // A stranger sends heartbeats with a node-ID. What is reported of it is not judged.
  void imitated(std::uint8_t node_id) { imitated_[node_id] = true; }
  // A sentence about the rule that the event breaks, or nothing.
  std::string judge(const Event& event, Instant now) const;

 private:
  static constexpr unsigned kTwo = 2;

  std::array<unsigned, can::kMaxNodeId + 1> users_{};
  std::array<Instant, can::kMaxNodeId + 1> shared_{};  // the newest end, 0 = it never was
  std::array<bool, can::kMaxNodeId + 1> imitated_{};
};

}  // namespace linegate::plant

// SPDX-License-Identifier: Apache-2.0
#include "tests/plant/identity_model.h"

namespace linegate::plant {

void IdentityModel::begins(std::uint8_t node_id) {
  ++users_[node_id];
}

void IdentityModel::ends(std::uint8_t node_id, Instant now) {
  if (users_[node_id]-- >= kTwo) {
    shared_[node_id] = now;
  }
}

std::string IdentityModel::judge(const Event& event, Instant now) const {
  const auto* const two = event.get<event::SharedNodeId>();
  if (two == nullptr || imitated_[event.node]) {
    return {};
  }
  const Instant ended = shared_[event.node];
  const bool by_responses = two->evidence == event::SharedIdEvidence::two_responses;
  const bool was_shared =
      ended != Instant{} && now - ended <= (by_responses ? kAnswers : kHeartbeats);
  return users_[event.node] >= kTwo || was_shared
             ? std::string()
             : "node " + std::to_string(event.node) + " is reported as two devices, sign " +
                   std::to_string(static_cast<unsigned>(two->evidence));
}

}  // namespace linegate::plant

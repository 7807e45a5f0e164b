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
  if (event.kind != EventKind::shared_node_id || imitated_[event.node]) {
    return {};
  }
  const Instant ended = shared_[event.node];
  const Duration evidence = event.code == kTwoAnswers ? kAnswers : kHeartbeats;
  const bool was_shared = ended != Instant{} && now - ended <= evidence;
  return users_[event.node] >= kTwo || was_shared
             ? std::string()
             : "node " + std::to_string(event.node) + " is reported as two devices, sign " +
                   std::to_string(event.code);
}

}  // namespace linegate::plant

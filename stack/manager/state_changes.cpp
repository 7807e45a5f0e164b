// SPDX-License-Identifier: Apache-2.0
#include "stack/manager/state_changes.h"

#include "stack/nmt/node_control.h"

namespace linegate::manager {
namespace {

// A second reset may reach a node that boots because of the first.
constexpr Duration kResetsTogether = std::chrono::seconds(2);
// A frame that a controller repeated is not a second boot-up message.
constexpr Duration kRepeatedFrame = std::chrono::milliseconds(5);

bool is_there(const NodeState& node) {
  return node.presence == Presence::present && node.state != nmt::State::unknown;
}

}  // namespace

void StateChanges::commanded(nmt::Command command, std::uint8_t node, Instant now) {
  for (std::uint8_t id = can::kMinNodeId; id <= can::kMaxNodeId; ++id) {
    if (node != 0 && node != id) {
      continue;
    }
    last_[id].command = command;
    if (nmt::is_reset(command)) {
      ++last_[id].resets;
      last_[id].reset_at = now;
    }
  }
}

// A node that was missing, or never heard, was switched on: that is not a spontaneous change.
bool StateChanges::boot_up(NodeState& node, Instant now) {
  Last& last = last_[node.node];
  if (last.boot_up != kNever && now - last.boot_up < kRepeatedFrame) {
    return false;
  }
  last.boot_up = now;
  const bool just_reset = last.resets > 0 && now - last.reset_at <= kResetsTogether;
  const bool asked = last.resets > 0 && (just_reset || !is_there(node));
  last.resets = asked ? last.resets - 1 : 0;
  last.command.reset();
  node.cause = asked            ? StateCause::command
               : is_there(node) ? StateCause::itself
                                : StateCause::unknown;
  node.spontaneous_changes += node.cause == StateCause::itself ? 1U : 0U;
  return node.cause == StateCause::itself;
}

bool StateChanges::shows(NodeState& node, nmt::State state) {
  if (node.state == state) {
    return false;
  }
  Last& last = last_[node.node];
  const bool asked = last.command && nmt::state_after(*last.command) == state;
  const bool left = is_there(node) && node.state == nmt::State::operational &&
                    (!last.command || last.command == nmt::Command::start);
  node.cause = asked            ? StateCause::command
               : is_there(node) ? StateCause::itself
                                : StateCause::unknown;
  if (state == nmt::State::operational && !asked) {
    last.command.reset();
  }
  node.spontaneous_changes += left ? 1U : 0U;
  return left;
}

}  // namespace linegate::manager

// SPDX-License-Identifier: Apache-2.0
// Which changes of the NMT state of nodes an NMT command asked for, and which they made by
// themselves: Operational was left without a command, or the node booted without a reset.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "stack/base/time.h"
#include "stack/can/cob_id.h"
#include "stack/manager/state.h"
#include "stack/nmt/state.h"

namespace linegate::manager {

class StateChanges {
 public:
  // An NMT command was on the bus, or is about to be. node: 1..127, or 0 for all.
  void commanded(nmt::Command command, std::uint8_t node, Instant now);

  // What was heard of the node, before `node` takes its new state. Both set the cause of the change
  // and count it in `node`. True if the node changed by itself, which is a warning.
  bool boot_up(NodeState& node, Instant now);
  bool shows(NodeState& node, nmt::State state);

 private:
  struct Last {
    std::optional<nmt::Command> command{};  // since the node became Operational
    unsigned resets = 0;                    // whose boot-up messages have not come
    Instant reset_at{};
    Instant boot_up = kNever;
  };

  std::array<Last, can::kMaxNodeId + 1> last_{};
};

}  // namespace linegate::manager

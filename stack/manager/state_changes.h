// SPDX-License-Identifier: Apache-2.0
// Distinguishes changes of the NMT state that an NMT command requested from spontaneous ones:
// Operational was left without a command, or the node booted without a reset.
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
  // An NMT command was sent, or is about to be sent. node: 1..127, or 0 for all.
  void commanded(nmt::Command command, std::uint8_t node, Instant now);

  // Call them with each boot-up message and each received state, before `node` takes its new state.
  // Both set the cause of the change in `node` and count spontaneous changes there. True if the
  // change is spontaneous, which is a warning.
  bool boot_up(NodeState& node, Instant now);
  bool shows(NodeState& node, nmt::State state);

 private:
  struct Last {
    std::optional<nmt::Command> command{};  // since the node became Operational
    unsigned resets = 0;                    // resets whose boot-up messages have not been received
    Instant reset_at{};
    Instant boot_up = kNever;
  };

  std::array<Last, can::kMaxNodeId + 1> last_{};
};

}  // namespace linegate::manager

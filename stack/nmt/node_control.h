// SPDX-License-Identifier: Apache-2.0
// The node control service (CiA 301, 7.2.8.3.1): two bytes on CAN-ID 000h.
//   byte 0  command specifier
//   byte 1  node-ID, 0 = all nodes
#pragma once

#include <cstdint>
#include <optional>

#include "stack/can/frame.h"
#include "stack/nmt/state.h"

namespace linegate::nmt {

struct NodeControl {
  Command command = Command::start;
  std::uint8_t node = 0;  // 1..127, 0 = all

  constexpr bool addresses(std::uint8_t own) const { return node == 0 || node == own; }
};

// The state of a node after it has executed the command: after a reset it enters Pre-operational by
// itself.
constexpr State state_after(Command command) {
  switch (command) {
    case Command::start:
      return State::operational;
    case Command::stop:
      return State::stopped;
    case Command::enter_pre_operational:
    case Command::reset_node:
    case Command::reset_communication:
      return State::pre_operational;
  }
  return State::unknown;
}

can::Frame encode(NodeControl control);

// Returns nothing if the length is not 2, CiA 301 does not define the command specifier, or the
// node-ID is above 127.
std::optional<NodeControl> decode_node_control(const can::Frame& frame);

}  // namespace linegate::nmt

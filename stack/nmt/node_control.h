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

can::Frame encode(NodeControl control);

// Nothing if the length is not 2, the command specifier is not one of CiA 301's, or the node-ID is
// above 127.
std::optional<NodeControl> decode_node_control(const can::Frame& frame);

}  // namespace linegate::nmt

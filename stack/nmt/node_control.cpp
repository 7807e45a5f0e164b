// SPDX-License-Identifier: Apache-2.0
#include "stack/nmt/node_control.h"

#include "stack/can/cob_id.h"

namespace linegate::nmt {

can::Frame encode(NodeControl control) {
  return can::make_frame(can::kNmtId, {static_cast<std::uint8_t>(control.command), control.node});
}

std::optional<NodeControl> decode_node_control(const can::Frame& frame) {
  const auto specifier = std::to_integer<std::uint8_t>(frame.data[0]);
  const auto node = std::to_integer<std::uint8_t>(frame.data[1]);
  if (frame.length != 2 || !is_command(specifier) || node > can::kMaxNodeId) {
    return std::nullopt;
  }
  return NodeControl{static_cast<Command>(specifier), node};
}

}  // namespace linegate::nmt

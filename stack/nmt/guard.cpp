// SPDX-License-Identifier: Apache-2.0
#include "stack/base/assert.h"
#include "stack/can/cob_id.h"
#include "stack/nmt/heartbeat_consumer.h"

namespace linegate::nmt {

can::Frame guard_request(std::uint8_t node) {
  LINEGATE_ASSERT(node >= can::kMinNodeId && node <= can::kMaxNodeId, "the node-ID is 1..127");
  can::Frame frame;
  frame.id = can::kErrorControlBase + node;
  frame.flags = can::Frame::kRemote;
  frame.length = 1;
  return frame;
}

bool Guard::accept_toggle(can::Frame& answer) {
  if (answer.data[0] == std::byte{0}) {
    toggle = std::byte{0};
    return true;
  }
  const std::byte seen = answer.data[0] & kToggleBit;
  if (seen != toggle.value_or(seen)) {
    return false;
  }
  toggle = seen ^ kToggleBit;
  answer.data[0] &= ~kToggleBit;
  return true;
}

}  // namespace linegate::nmt

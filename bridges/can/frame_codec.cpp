// SPDX-License-Identifier: Apache-2.0
#include "bridges/can/frame_codec.h"

#include <cstring>

#include "bridges/can/sendable.h"
#include "stack/base/assert.h"

namespace linegate::can_bridge {

using can::Frame;

[[gnu::hot]] std::size_t encode(const Frame& frame, canfd_frame& raw) {
  LINEGATE_ASSERT_HOT(sendable(frame, true), "the format has the identifier and the length");
  raw.can_id = frame.id;
  if (frame.extended()) {
    raw.can_id |= CAN_EFF_FLAG;
  }
  if (frame.remote()) {
    raw.can_id |= CAN_RTR_FLAG;
  }
  raw.len = frame.length;
  raw.flags = 0;
  raw.__res0 = 0;
  raw.__res1 = 0;
  if (!frame.fd()) {
    std::memcpy(raw.data, frame.data.data(), can::kMaxClassicData);
    return CAN_MTU;
  }
  if ((frame.flags & Frame::kBitRateSwitch) != 0) {
    raw.flags |= CANFD_BRS;
  }
  if ((frame.flags & Frame::kErrorStateIndicator) != 0) {
    raw.flags |= CANFD_ESI;
  }
  std::memcpy(raw.data, frame.data.data(), can::kMaxFdData);
  return CANFD_MTU;
}

[[gnu::hot]] bool decode(const canfd_frame& raw, std::size_t bytes, Frame& out) {
  LINEGATE_ASSERT_HOT((raw.can_id & CAN_ERR_FLAG) == 0, "an error frame is no frame of the bus");
  const bool extended = (raw.can_id & CAN_EFF_FLAG) != 0;
  out.id = raw.can_id & (extended ? CAN_EFF_MASK : CAN_SFF_MASK);
  out.flags = extended ? Frame::kExtended : 0;
  out.length = raw.len;
  if (bytes == CAN_MTU && raw.len <= CAN_MAX_DLEN) {
    if ((raw.can_id & CAN_RTR_FLAG) != 0) {
      out.flags |= Frame::kRemote;
    }
    std::memcpy(out.data.data(), raw.data, CAN_MAX_DLEN);
    return true;
  }
  if (bytes != CANFD_MTU || raw.len > CANFD_MAX_DLEN) {
    return false;
  }
  out.flags |= Frame::kFd;
  if ((raw.flags & CANFD_BRS) != 0) {
    out.flags |= Frame::kBitRateSwitch;
  }
  if ((raw.flags & CANFD_ESI) != 0) {
    out.flags |= Frame::kErrorStateIndicator;
  }
  std::memcpy(out.data.data(), raw.data, CANFD_MAX_DLEN);
  return true;
}

}  // namespace linegate::can_bridge

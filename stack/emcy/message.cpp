// SPDX-License-Identifier: Apache-2.0
#include "stack/emcy/message.h"

#include <algorithm>

#include "stack/base/byte_order.h"

namespace linegate::emcy {
namespace {

constexpr std::uint8_t kLength = 8;
constexpr std::size_t kInfoAt = 3;

}  // namespace

can::Frame encode(const Message& message, can::CobId cob_id) {
  can::Frame frame;
  frame.id = cob_id.id();
  if (cob_id.extended()) {
    frame.flags = can::Frame::kExtended;
  }
  frame.length = kLength;
  store_le(frame.data.data(), message.code);
  frame.data[2] = std::byte{message.error_register};
  std::ranges::copy(message.info, frame.data.begin() + kInfoAt);
  return frame;
}

std::optional<Message> decode(const can::Frame& frame) {
  if (frame.length != kLength) {
    return std::nullopt;
  }
  Message out;
  out.code = load_le<std::uint16_t>(frame.data.data());
  out.error_register = std::to_integer<std::uint8_t>(frame.data[2]);
  std::copy_n(frame.data.begin() + kInfoAt, out.info.size(), out.info.begin());
  return out;
}

}  // namespace linegate::emcy

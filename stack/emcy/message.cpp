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

Event to_event(EventKind kind, std::uint8_t node, const Message& message, Instant time) {
  Event event;
  event.time = time;
  event.kind = kind;
  event.node = node;
  event.code = message.code;
  event.value = message.error_register;
  event.length = static_cast<std::uint8_t>(message.info.size());
  std::ranges::copy(message.info, event.data.begin());
  return event;
}

}  // namespace linegate::emcy

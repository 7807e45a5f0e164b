// SPDX-License-Identifier: Apache-2.0
#include "stack/emcy/message.h"

#include <algorithm>

#include "stack/base/byte_order.h"

namespace linegate::emcy {
namespace {

constexpr std::uint8_t kLength = 8;
constexpr std::size_t kInfoAt = 3;

constexpr std::uint8_t kFdLength = 20;
constexpr std::size_t kLogicalDeviceAt = 3;
constexpr std::size_t kProfileAt = 4;
constexpr std::size_t kStatusAt = 6;
constexpr std::size_t kTimeAt = 8;
constexpr std::size_t kFdInfoAt = 14;

}  // namespace

can::Frame encode(const Message& message, can::CobId cob_id) {
  can::Frame frame;
  frame.id = cob_id.id();
  if (cob_id.extended()) {
    frame.flags = can::Frame::kExtended;
  }
  store_le(frame.data.data(), message.code);
  frame.data[2] = std::byte{message.error_register};
  if (!message.fd.any) {
    frame.length = kLength;
    std::ranges::copy(message.info, frame.data.begin() + kInfoAt);
    return frame;
  }
  frame.length = kFdLength;
  frame.flags |= can::Frame::kFd | can::Frame::kBitRateSwitch;
  frame.data[kLogicalDeviceAt] = std::byte{message.fd.logical_device};
  store_le(frame.data.data() + kProfileAt, message.fd.profile);
  frame.data[kStatusAt] = std::byte{message.fd.status};
  std::ranges::copy(message.fd.time_of_day, frame.data.begin() + kTimeAt);
  std::ranges::copy(message.info, frame.data.begin() + kFdInfoAt);
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

std::optional<Message> decode_fd(const can::Frame& frame) {
  if (frame.length != kFdLength || !frame.fd()) {
    return std::nullopt;
  }
  Message out;
  out.code = load_le<std::uint16_t>(frame.data.data());
  out.error_register = std::to_integer<std::uint8_t>(frame.data[2]);
  out.fd.any = true;
  out.fd.logical_device = std::to_integer<std::uint8_t>(frame.data[kLogicalDeviceAt]);
  out.fd.profile = load_le<std::uint16_t>(frame.data.data() + kProfileAt);
  out.fd.status = std::to_integer<std::uint8_t>(frame.data[kStatusAt]);
  std::copy_n(frame.data.begin() + kTimeAt, out.fd.time_of_day.size(), out.fd.time_of_day.begin());
  std::copy_n(frame.data.begin() + kFdInfoAt, out.info.size(), out.info.begin());
  return out;
}

}  // namespace linegate::emcy

// SPDX-License-Identifier: Apache-2.0
#include "stack/lss/message.h"

#include <algorithm>

#include "stack/base/byte_order.h"

namespace linegate::lss {
namespace {

constexpr std::uint8_t kLength = 8;
constexpr std::array<std::uint32_t, 9> kBitRates{1'000'000, 800'000, 500'000, 250'000, 125'000,
                                                 0,         50'000,  20'000,  10'000};

}  // namespace

can::Frame encode(std::uint32_t id, const Message& message) {
  can::Frame frame;
  frame.id = id;
  frame.length = kLength;
  frame.data[0] = static_cast<std::byte>(message.command);
  store_le(&frame.data[1], message.number);
  for (std::size_t i = 0; i < message.rest.size(); ++i) {
    frame.data[5 + i] = std::byte{message.rest[i]};
  }
  return frame;
}

std::optional<Message> decode(const can::Frame& frame) {
  if (frame.length != kLength || frame.flags != 0) {
    return std::nullopt;
  }
  Message message;
  message.command = static_cast<Command>(frame.data[0]);
  message.number = load_le<std::uint32_t>(&frame.data[1]);
  for (std::size_t i = 0; i < message.rest.size(); ++i) {
    message.rest[i] = std::to_integer<std::uint8_t>(frame.data[5 + i]);
  }
  return message;
}

std::optional<std::uint32_t> bit_rate(std::uint8_t index) {
  if (index >= kBitRates.size() || kBitRates[index] == 0) {
    return std::nullopt;
  }
  return kBitRates[index];
}

std::optional<std::uint8_t> bit_timing_index(std::uint32_t bit_rate) {
  const auto* const found = std::ranges::find(kBitRates, bit_rate);
  if (bit_rate == 0 || found == kBitRates.end()) {
    return std::nullopt;
  }
  return static_cast<std::uint8_t>(found - kBitRates.begin());
}

}  // namespace linegate::lss

// SPDX-License-Identifier: Apache-2.0
// Common parts of the SDO tests: a dictionary, frames written as bytes, and time.
#pragma once

#include <algorithm>
#include <cstdint>
#include <initializer_list>
#include <ostream>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "stack/base/event_log.h"
#include "stack/can/transmit_queue.h"
#include "stack/od/dictionary.h"
#include "stack/od/stream.h"

namespace linegate::sdo::test {

using namespace std::chrono_literals;

inline constexpr std::uint32_t kRequestId = 0x605;
inline constexpr std::uint32_t kResponseId = 0x585;

using Bytes = std::vector<std::uint8_t>;
using Frames = std::vector<Bytes>;

inline std::vector<std::byte> bytes(const Bytes& values) {
  std::vector<std::byte> out(values.size());
  std::ranges::transform(values, out.begin(), [](std::uint8_t v) { return std::byte{v}; });
  return out;
}

inline Bytes numbers(std::span<const std::byte> values) {
  Bytes out(values.size());
  std::ranges::transform(values, out.begin(),
                         [](std::byte b) { return std::to_integer<std::uint8_t>(b); });
  return out;
}

// size bytes 1, 2, 3, ...
inline std::vector<std::byte> pattern(std::size_t size) {
  std::vector<std::byte> out(size);
  for (std::size_t i = 0; i < size; ++i) {
    out[i] = static_cast<std::byte>(i + 1 + i / 251);
  }
  return out;
}

inline Instant at(Duration since_start) {
  return Instant{} + since_start;
}

inline can::Frame frame(std::uint32_t id, const Bytes& data, Instant time = {}) {
  can::Frame out = can::make_frame(id, bytes(data));
  out.time = time;
  return out;
}

// The frames in the queue, as bytes; each must have the identifier.
inline std::vector<Bytes> drain(can::TransmitQueue& queue, std::uint32_t id) {
  std::vector<Bytes> out;
  can::Frame next;
  while (queue.pop_rest(next)) {
    EXPECT_EQ(next.id, id);
    EXPECT_EQ(next.flags, 0);
    out.push_back(numbers(next.bytes()));
  }
  return out;
}

inline std::vector<Event> drain(EventLog& log) {
  std::vector<Event> out(64);
  out.resize(log.take(out));
  return out;
}

// An abort as on the wire.
inline Bytes abort_bytes(std::uint16_t index, std::uint8_t sub, std::uint32_t code) {
  Bytes out{0x80, static_cast<std::uint8_t>(index), static_cast<std::uint8_t>(index >> 8U), sub};
  for (unsigned i = 0; i < 4; ++i) {
    out.push_back(static_cast<std::uint8_t>(code >> (8 * i)));
  }
  return out;
}

inline od::VariableDescription variable(std::uint8_t sub, od::DataType type, od::Access access,
                                        const Bytes& value) {
  od::VariableDescription out;
  out.sub = sub;
  out.type = type;
  out.access = access;
  out.value = bytes(value);
  return out;
}

inline od::ObjectDescription object(std::uint16_t index,
                                    std::vector<od::VariableDescription> variables) {
  od::ObjectDescription out;
  out.index = index;
  out.type = variables.size() == 1 ? od::ObjectType::variable : od::ObjectType::record;
  out.variables = std::move(variables);
  return out;
}

// 1000h u32 ro 04030201h; 1001h u8 ro 7Fh; 1008h string ro "Linegate device"; 1017h u16 rw 03E8h;
// 2000h record: 1 u8 rw, 2 u16 rw, 3 u24 rw, 4 u32 rw, 5 u64 rw, 6 u32 wo, 7 i16 rw -5..100,
// 8 empty string, 9 string of 8 rw; 2100h DOMAIN rw
inline od::DeviceDescription device() {
  using od::Access;
  using od::DataType;
  od::DeviceDescription out;
  out.objects.push_back(
      object(0x1000, {variable(0, DataType::unsigned32, Access::ro, {1, 2, 3, 4})}));
  out.objects.push_back(object(0x1001, {variable(0, DataType::unsigned8, Access::ro, {0x7F})}));
  const std::string name = "Linegate device";
  out.objects.push_back(object(0x1008, {variable(0, DataType::visible_string, Access::constant,
                                                 Bytes(name.begin(), name.end()))}));
  out.objects.push_back(
      object(0x1017, {variable(0, DataType::unsigned16, Access::rw, {0xE8, 0x03})}));
  od::VariableDescription limited = variable(7, DataType::integer16, Access::rw, {0, 0});
  limited.low_limit = bytes({0xFB, 0xFF});
  limited.high_limit = bytes({100, 0});
  out.objects.push_back(
      object(0x2000, {variable(0, DataType::unsigned8, Access::ro, {9}),
                      variable(1, DataType::unsigned8, Access::rw, {0x11}),
                      variable(2, DataType::unsigned16, Access::rw, {0x21, 0x22}),
                      variable(3, DataType::unsigned24, Access::rw, {0x31, 0x32, 0x33}),
                      variable(4, DataType::unsigned32, Access::rw, {0x41, 0x42, 0x43, 0x44}),
                      variable(5, DataType::unsigned64, Access::rw, {1, 2, 3, 4, 5, 6, 7, 8}),
                      variable(6, DataType::unsigned32, Access::wo, {0, 0, 0, 0}), limited,
                      variable(8, DataType::visible_string, Access::rw, {}),
                      variable(9, DataType::octet_string, Access::rw, {1, 2, 3, 4, 5, 6, 7, 8})}));
  out.objects.push_back(object(0x2100, {variable(0, DataType::domain, Access::rw, {})}));
  return out;
}

// Bytes of a pattern; records what was acknowledged.
class AcknowledgedSource final : public od::ByteSource {
 public:
  explicit AcknowledgedSource(std::size_t size) : bytes_(pattern(size)) {}

  std::optional<std::uint32_t> size() const override {
    return static_cast<std::uint32_t>(bytes_.size());
  }
  Result<std::size_t> read(std::span<std::byte> out) override {
    const std::size_t count = std::min(out.size(), bytes_.size() - read_);
    std::copy_n(bytes_.begin() + static_cast<std::ptrdiff_t>(read_), count, out.begin());
    read_ += count;
    return count;
  }
  void acknowledged(std::size_t count) override { counts.push_back(count); }

  std::vector<std::size_t> counts;

 private:
  std::vector<std::byte> bytes_;
  std::size_t read_ = 0;
};

}  // namespace linegate::sdo::test

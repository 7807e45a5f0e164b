// SPDX-License-Identifier: Apache-2.0
// USDO frames as bytes; client 1 and the server of node 5.
#pragma once

#include <cstdint>
#include <vector>

#include "stack/usdo/protocol.h"

#include "tests/stack/sdo/support.h"

namespace linegate::usdo::test {

using namespace std::chrono_literals;
using sdo::test::at;
using sdo::test::bytes;
using sdo::test::Bytes;
using sdo::test::numbers;
using sdo::test::pattern;

inline constexpr std::uint8_t kClient = 1;
inline constexpr std::uint8_t kServer = 5;
inline constexpr std::uint32_t kRequestId = 0x601;
inline constexpr std::uint32_t kResponseId = 0x585;

// An FD frame with the bit rate switched, padded.
inline can::Frame fd_frame(std::uint32_t id, const Bytes& data, Instant time = {}) {
  can::Frame out;
  out.id = id;
  out.flags = can::Frame::kFd | can::Frame::kBitRateSwitch;
  out.length = can::fd_length(data.size());
  std::ranges::copy(bytes(data), out.data.begin());
  out.time = time;
  return out;
}

// The frames in the queue; each must be an FD frame with the identifier.
inline std::vector<Bytes> drain_fd(can::TransmitQueue& queue, std::uint32_t id) {
  std::vector<Bytes> out;
  can::Frame next;
  while (queue.pop_rest(next)) {
    EXPECT_EQ(next.id, id);
    EXPECT_EQ(next.flags, can::Frame::kFd | can::Frame::kBitRateSwitch);
    EXPECT_EQ(next.length, can::fd_length(next.length));
    out.push_back(numbers(next.bytes()));
  }
  return out;
}

// head, then data, then zeros up to the next length of CAN FD.
inline Bytes padded(Bytes head, const Bytes& data = {}) {
  head.insert(head.end(), data.begin(), data.end());
  head.resize(can::fd_length(head.size()), 0);
  return head;
}

inline Bytes numbers_from(std::size_t first, std::size_t count) {
  const std::vector<std::byte> all = pattern(first + count);
  return numbers(std::span(all).subspan(first));
}

}  // namespace linegate::usdo::test

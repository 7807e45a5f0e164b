// SPDX-License-Identifier: Apache-2.0
// A CAN frame, classical or FD, in the representation of the stack.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <initializer_list>
#include <span>

#include "stack/base/time.h"

namespace linegate::can {

inline constexpr std::size_t kMaxClassicData = 8;
inline constexpr std::size_t kMaxFdData = 64;

struct Frame {
  enum Flag : std::uint8_t {
    kExtended = 0x01,       // id has 29 bits, otherwise 11
    kRemote = 0x02,         // remote transmission request, classical frames only
    kFd = 0x04,             // CAN FD frame
    kBitRateSwitch = 0x08,  // FD: data phase at the data bit rate
    kErrorStateIndicator = 0x10,
  };

  std::uint32_t id = 0;     // 0..7FFh, or 0..1FFFFFFFh with kExtended
  std::uint8_t length = 0;  // bytes of data: 0..8, FD: 0..8, 12, 16, 20, 24, 32, 48, 64
  std::uint8_t flags = 0;   // Flag values or-ed
  Instant time{};           // receive time; unused in frames to send
  std::array<std::byte, kMaxFdData> data{};

  bool extended() const { return (flags & kExtended) != 0; }
  bool remote() const { return (flags & kRemote) != 0; }
  bool fd() const { return (flags & kFd) != 0; }
  std::span<const std::byte> bytes() const { return {data.data(), length}; }
  // Whether it is a classical data frame with an 11-bit identifier and `size` bytes.
  bool standard_of(std::uint8_t size) const {
    constexpr unsigned kOther = kExtended | kRemote | kFd;
    return ((unsigned{flags} << 8U | length) & (kOther << 8U | 0xFFU)) == size;
  }
};

// The first fields of a frame, for copying them at once.
struct Header {
  std::uint32_t id = 0;
  std::uint8_t length = 0;
  std::uint8_t flags = 0;
};

// A classical data frame; data beyond 8 bytes are cut off.
Frame make_frame(std::uint32_t id, std::span<const std::byte> data = {});
Frame make_frame(std::uint32_t id, std::initializer_list<std::uint8_t> data);

// Copies identifier, flags, length and data, field by field: one load over fields that were just
// stored separately would stall. Bytes beyond the length of `from`, and the time, are left
// unchanged.
inline Header copy_content(const Frame& from, Frame& to) {
  const Header header{from.id, from.length, from.flags};
  to.id = header.id;
  to.length = header.length;
  to.flags = header.flags;
  std::memcpy(to.data.data(), from.data.data(), kMaxClassicData);
  if (header.length > kMaxClassicData) [[unlikely]] {
    to.data = from.data;
  }
  return header;
}

// Equal identifier, flags, length and data; the time is not compared.
bool same_content(const Frame& a, const Frame& b);

// The smallest length of a CAN FD frame that is >= length. Precondition: length <= 64.
std::uint8_t fd_length(std::size_t length);

// The order of two frames in arbitration (ISO 11898-1): true if a wins.
bool wins_arbitration(const Frame& a, const Frame& b);

}  // namespace linegate::can

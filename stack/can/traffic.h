// SPDX-License-Identifier: Apache-2.0
// Counters of the frames on a line, sufficient to estimate their number of bits.
#pragma once

#include <cstdint>

#include "stack/can/frame.h"

namespace linegate::can {

struct Traffic {
  std::uint64_t frames = 0;
  std::uint64_t extended = 0;  // frames with 29-bit identifiers, included in the total
  std::uint64_t bytes = 0;     // data bytes

  void add(const Frame& frame) {
    if (!frame.extended()) [[likely]] {
      add_standard(frame.length);
    } else {
      add(frame.flags, frame.length);
    }
  }
  // Counts a frame with these flags and this length.
  void add(std::uint8_t flags, std::uint8_t length) {
    ++frames;
    extended += flags & Frame::kExtended;
    bytes += length;
  }
  // Counts a frame with an 11-bit identifier.
  void add_standard(std::uint8_t length) {
    ++frames;
    bytes += length;
  }
  Traffic& operator+=(const Traffic& other) {
    frames += other.frames;
    extended += other.extended;
    bytes += other.bytes;
    return *this;
  }
};

}  // namespace linegate::can

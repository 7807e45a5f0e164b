// SPDX-License-Identifier: Apache-2.0
// What went over a line, summed up: enough to tell how many bits it was.
#pragma once

#include <cstdint>

#include "stack/can/frame.h"

namespace linegate::can {

struct Traffic {
  std::uint64_t frames = 0;
  std::uint64_t extended = 0;  // of these, with 29-bit identifiers
  std::uint64_t bytes = 0;     // of data

  void add(const Frame& frame) {
    if (!frame.extended()) [[likely]] {
      add_standard(frame.length);
    } else {
      add(frame.flags, frame.length);
    }
  }
  // A frame of which these are known.
  void add(std::uint8_t flags, std::uint8_t length) {
    ++frames;
    extended += flags & Frame::kExtended;
    bytes += length;
  }
  // A frame with an 11-bit identifier.
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

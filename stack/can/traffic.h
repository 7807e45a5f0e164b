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
    ++frames;
    extended += frame.flags & Frame::kExtended;
    bytes += frame.length;
  }
  Traffic& operator+=(const Traffic& other) {
    frames += other.frames;
    extended += other.extended;
    bytes += other.bytes;
    return *this;
  }
};

}  // namespace linegate::can

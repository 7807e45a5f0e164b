// How much of the bit rate a line uses, from the lengths of the frames seen and sent.
#pragma once

#include <cstdint>
#include <span>

#include "stack/base/time.h"
#include "stack/can/frame.h"

namespace linegate::line {

// Estimated, not counted bit by bit: a frame's stuff bits are taken as a tenth of the bits that can
// be stuffed, which is close to the mean of random data. CAN FD frames count as if sent at the
// nominal bit rate throughout, so the load of an FD line is an upper bound.
class BusLoad {
 public:
  // bit_rate in bit/s; 0 = unknown, the load is 0 then.
  explicit BusLoad(std::uint32_t bit_rate) : bit_rate_(bit_rate) {}

  void add(const can::Frame& frame) {
    const std::uint64_t header = frame.extended() ? kExtendedBits : kStandardBits;
    const std::uint64_t data = std::uint64_t{frame.length} * 8U;
    bits_ += header + data + (header + data) / 10U;
  }
  void add(std::span<const can::Frame> frames) {
    for (const can::Frame& frame : frames) {
      add(frame);
    }
  }

  // Closes the window of one second when it is over.
  void advance(Instant now);

  // Thousandths of the bit rate in the last full window.
  std::uint16_t permille() const { return permille_; }

 private:
  // Start to end of frame and intermission (ISO 11898-1), without data and stuff bits.
  static constexpr std::uint64_t kStandardBits = 47;
  static constexpr std::uint64_t kExtendedBits = 67;

  std::uint32_t bit_rate_;
  std::uint64_t bits_ = 0;
  Instant window_start_{};
  std::uint16_t permille_ = 0;
};

}  // namespace linegate::line

// How much of the bit rate a line uses, from the lengths of the frames seen and sent.
#pragma once

#include <cstdint>

#include "stack/base/time.h"
#include "stack/can/traffic.h"

namespace linegate::line {

// Estimated, not counted bit by bit: a frame's stuff bits are taken as a tenth of the bits that can
// be stuffed, which is close to the mean of random data. CAN FD frames count as if sent at the
// nominal bit rate throughout, so the load of an FD line is an upper bound.
class BusLoad {
 public:
  // bit_rate in bit/s; 0 = unknown, the load is 0 then.
  explicit BusLoad(std::uint32_t bit_rate) : bit_rate_(bit_rate) {}

  // Closes the window of one second when it is over. seen: everything that went over the line so
  // far, in both directions.
  void advance(const can::Traffic& seen, Instant now);

  // Thousandths of the bit rate in the last full window.
  std::uint16_t permille() const { return permille_; }

 private:
  // Start to end of frame and intermission (ISO 11898-1), without data and stuff bits.
  static constexpr std::uint64_t kStandardBits = 47;
  static constexpr std::uint64_t kExtendedBits = 67;

  static std::uint64_t bits(const can::Traffic& traffic);

  std::uint32_t bit_rate_;
  std::uint64_t bits_before_ = 0;  // up to the begin of this window, without stuff bits
  Instant window_start_{};
  std::uint16_t permille_ = 0;
};

}  // namespace linegate::line

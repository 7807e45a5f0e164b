// SPDX-License-Identifier: Apache-2.0
// Estimates the bus load of a line from the lengths of the received and sent frames.
#pragma once

#include <cstdint>
#include <span>

#include "stack/base/time.h"
#include "stack/can/frame.h"
#include "stack/can/traffic.h"

namespace linegate::line {

// An estimate, which does not count every bit: the stuff bits of a frame are taken as a tenth of
// the bits that can be stuffed, which is close to the mean of random data. CAN FD frames count as
// if sent at the nominal bit rate throughout, so the load of an FD line is an upper bound, unless
// the bit rate of the data phase is known.
class BusLoad {
 public:
  // bit_rate in bit/s; 0 = unknown: the load is then 0.
  explicit BusLoad(std::uint32_t bit_rate) : bit_rate_(bit_rate) {}

  // In bit/s, from now on. data_bit_rate: of the data phase of FD frames with bit rate switch; 0 =
  // unknown.
  void set_bit_rates(std::uint32_t bit_rate, std::uint32_t data_bit_rate);

  // The line has FD frames, whether or not the bit rate of their data phase is known.
  void expect_fd() {
    expects_fd_ = true;
    wants_fast_ = true;
  }
  // Whether count_fast() must be called with the frames, in addition to counting them as traffic.
  bool wants_fast() const { return wants_fast_; }
  // Counts the bits of the data phase of frames with bit rate switch, and the bits that are
  // therefore not sent at the nominal bit rate. Returns the number of FD frames.
  std::uint64_t count_fast(std::span<const can::Frame> frames);

  // Whether the window of one second has ended.
  bool is_due(Instant now) const { return now - window_start_ >= kWindow; }
  // Closes the window if it has ended. seen: all traffic of the line so far, in both directions.
  void advance(const can::Traffic& seen, Instant now);

  // Load in thousandths of the bit rate in the last complete window.
  std::uint16_t permille() const { return permille_; }

 private:
  static constexpr Duration kWindow = std::chrono::seconds(1);

  static std::uint64_t bits(const can::Traffic& traffic);

  std::uint32_t bit_rate_;
  std::uint32_t data_bit_rate_ = 0;
  bool expects_fd_ = false;
  bool wants_fast_ = false;
  std::uint64_t not_nominal_ = 0;  // bits in this window that are not sent at the nominal bit rate
  std::uint64_t fast_bits_ = 0;    // bits at the bit rate of the data phase, without stuff bits
  std::uint64_t bits_before_ = 0;  // up to the start of this window, without stuff bits
  Instant window_start_{};
  std::uint16_t permille_ = 0;
};

}  // namespace linegate::line

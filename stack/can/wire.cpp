// SPDX-License-Identifier: Apache-2.0
#include "stack/can/wire.h"

#include <algorithm>

#include "stack/base/assert.h"

namespace linegate::can {
namespace {

constexpr unsigned kCrc15Bits = 15;
constexpr std::uint32_t kCrc15Polynomial = 0x4599;
constexpr unsigned kStuffRun = 5;
// CRC delimiter, acknowledge slot and delimiter, end of frame.
constexpr unsigned kTrailerBits = 1 + 1 + 1 + 7;

// The bits of a frame in the order of transmission, without storing them: count, CRC and stuff
// bits.
class Shifter {
 public:
  void bit(bool value) {
    ++bits_;
    const bool feedback = value != ((crc_ & 0x4000U) != 0);
    crc_ = (crc_ << 1U) & 0x7FFFU;
    if (feedback) {
      crc_ ^= kCrc15Polynomial;
    }
    stuff(value);
  }

  // The lowest `count` bits of value, most significant first.
  void field(std::uint32_t value, unsigned count) {
    while (count-- > 0) {
      bit(((value >> count) & 1U) != 0);
    }
  }

  void bytes(std::span<const std::byte> data) {
    for (const std::byte b : data) {
      field(std::to_integer<std::uint32_t>(b), 8);
    }
  }

  unsigned bits() const { return bits_ + stuffed_; }
  std::uint16_t crc() const { return static_cast<std::uint16_t>(crc_); }
  // The last five bits were equal, so that a stuff bit was counted after them.
  bool just_stuffed() const { return just_stuffed_; }

 private:
  void stuff(bool value) {
    run_ = run_ != 0 && value == last_ ? run_ + 1 : 1;
    last_ = value;
    just_stuffed_ = run_ == kStuffRun;
    if (just_stuffed_) {
      ++stuffed_;
      last_ = !value;
      run_ = 1;
    }
  }

  unsigned bits_ = 0;
  unsigned stuffed_ = 0;
  unsigned run_ = 0;
  bool last_ = false;
  bool just_stuffed_ = false;
  std::uint32_t crc_ = 0;
};

// From start of frame to the bit before the format bits (r0, or FDF), for both formats. `remote`:
// the RTR bit of a classical frame; FD frames have a dominant RRS there.
void shift_identifier(Shifter& out, const Frame& frame, bool remote) {
  out.bit(false);
  if (!frame.extended()) {
    out.field(frame.id, 11);
    out.bit(remote);
    out.bit(false);
    return;
  }
  out.field(frame.id >> 18U, 11);
  out.field(0x3, 2);  // SRR, IDE
  out.field(frame.id & 0x3FFFFU, 18);
  out.bit(remote);
}

void shift_classical(Shifter& out, const Frame& frame) {
  shift_identifier(out, frame, frame.remote());
  out.field(0, frame.extended() ? 2 : 1);
  out.field(frame.length, 4);
  if (!frame.remote()) {
    out.bytes(frame.bytes());
  }
}

WireBits classical_bits(const Frame& frame) {
  Shifter out;
  shift_classical(out, frame);
  out.field(out.crc(), kCrc15Bits);
  return {out.bits() + kTrailerBits, 0};
}

std::uint32_t data_length_code(std::uint8_t length) {
  constexpr std::array<std::uint8_t, 7> kSteps{12, 16, 20, 24, 32, 48, 64};
  std::uint32_t code = std::min<std::uint32_t>(length, 8);
  for (const std::uint8_t step : kSteps) {
    code += length >= step ? 1U : 0U;
  }
  return code;
}

WireBits fd_bits(const Frame& frame) {
  Shifter out;
  const bool switched = (frame.flags & Frame::kBitRateSwitch) != 0;
  shift_identifier(out, frame, false);
  out.bit(true);   // FDF
  out.bit(false);  // res
  out.bit(switched);
  const unsigned before_data_phase = out.bits();
  out.bit((frame.flags & Frame::kErrorStateIndicator) != 0);
  out.field(data_length_code(frame.length), 4);
  out.bytes(frame.bytes());
  // From here on stuff bits have fixed places; the first one replaces a counted stuff bit there.
  const unsigned counted = out.bits() - before_data_phase - (out.just_stuffed() ? 1 : 0);
  const unsigned crc_field = frame.length <= 16 ? 4 + 17 : 4 + 21;
  const unsigned fixed_stuff = 1 + crc_field / 4;
  const unsigned data_phase = counted + crc_field + fixed_stuff;
  const unsigned nominal = before_data_phase + kTrailerBits;
  return switched ? WireBits{nominal, data_phase} : WireBits{nominal + data_phase, 0};
}

}  // namespace

WireBits wire_bits(const Frame& frame) {
  LINEGATE_ASSERT_HOT(
      frame.fd() ? frame.length == fd_length(frame.length) : frame.length <= kMaxClassicData,
      "the length is one of the frame's format");
  return frame.fd() ? fd_bits(frame) : classical_bits(frame);
}

Duration bit_time(unsigned bits, std::uint32_t bit_rate) {
  LINEGATE_ASSERT(bit_rate > 0, "the bit rate is positive");
  constexpr std::uint64_t kNanoseconds = 1'000'000'000;
  return Duration(
      static_cast<Duration::rep>((std::uint64_t{bits} * kNanoseconds + bit_rate / 2) / bit_rate));
}

Duration wire_time(const Frame& frame, std::uint32_t bit_rate, std::uint32_t data_bit_rate) {
  const WireBits bits = wire_bits(frame);
  const Duration nominal = bit_time(bits.nominal, bit_rate);
  return bits.data == 0 ? nominal : nominal + bit_time(bits.data, data_bit_rate);
}

std::uint16_t crc15(const Frame& frame) {
  Shifter out;
  shift_classical(out, frame);
  return out.crc();
}

}  // namespace linegate::can

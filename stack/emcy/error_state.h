// SPDX-License-Identifier: Apache-2.0
// Which errors of a device are present: the error state machine of CiA 301 (7.2.7.1), error free or
// not, and the error register 1001h as the sum of what is present.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace linegate::emcy {

// The bits of the error register that an emergency error code stands for by its class: generic
// always; current 2xxxh, voltage 3xxxh, temperature 4xxxh, communication 81xxh and 82xxh, device
// profile FFxxh. 0 for error reset (00xxh).
std::uint8_t register_of(std::uint16_t code);

class ErrorState {
 public:
  // One more error with these bits of the error register. Gives the error register that was
  // `present`, with its bits.
  std::uint8_t begin_bits(std::uint8_t bits, std::uint8_t present);
  // One less with them. Precondition: it has begun.
  std::uint8_t end_bits(std::uint8_t bits, std::uint8_t present);
  // One more error of that class. Gives the error register that was `present`, with its bits.
  std::uint8_t begin(std::uint16_t code, std::uint8_t present);
  // One less. Bits that no other error needs are taken away, unless somebody else had set them
  // before. Precondition: that many of the class have begun.
  std::uint8_t end(std::uint16_t code, std::uint8_t present);

  bool error_free() const { return errors_ == 0; }
  std::size_t errors() const { return errors_; }
  void clear() { *this = ErrorState{}; }

 private:
  std::size_t errors_ = 0;
  std::array<std::size_t, 8> needed_{};  // by bit
  std::uint8_t ours_ = 0;                // bits that were not set before
};

}  // namespace linegate::emcy

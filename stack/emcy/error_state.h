// SPDX-License-Identifier: Apache-2.0
// The present errors of a device: the error state machine of CiA 301 (7.2.7.1) with the states
// error free and error occurred, and the error register 1001h as the union of the present errors.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace linegate::emcy {

// The bits of the error register for the class of an emergency error code: generic always; current
// 2xxxh, voltage 3xxxh, temperature 4xxxh, communication 81xxh and 82xxh, device profile FFxxh. 0
// for error reset (00xxh).
std::uint8_t register_of(std::uint16_t code);

class ErrorState {
 public:
  // Adds an error with these bits of the error register. Returns the error register `present` with
  // these bits set.
  std::uint8_t begin_bits(std::uint8_t bits, std::uint8_t present);
  // Removes an error with these bits. Precondition: it was added.
  std::uint8_t end_bits(std::uint8_t bits, std::uint8_t present);
  // Adds an error with this code. Returns the error register `present` with the bits of the code
  // set.
  std::uint8_t begin(std::uint16_t code, std::uint8_t present);
  // Removes an error with this code. Clears bits that no other error needs, unless another
  // component had set them before. Precondition: as many errors of the class were added.
  std::uint8_t end(std::uint16_t code, std::uint8_t present);

  bool error_free() const { return errors_ == 0; }
  std::size_t errors() const { return errors_; }
  void clear() { *this = ErrorState{}; }

 private:
  std::size_t errors_ = 0;
  std::array<std::size_t, 8> needed_{};  // number of errors, by bit
  std::uint8_t ours_ = 0;                // bits that were 0 before the first error set them
};

}  // namespace linegate::emcy

// SPDX-License-Identifier: Apache-2.0
// How the bits of a PDO are copied to and from the mapped values, determined when the PDO is
// configured.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "stack/base/byte_order.h"

namespace linegate::pdo {

// Bits that are copied between one 64-bit word of the frame and one 64-bit word of the image. Both
// words begin at a byte boundary; rotating the frame word right by `rotate` aligns its bits with
// the image word.
struct Run {
  std::uint64_t mask = 0;    // selects bits of the image word
  std::uint32_t offset = 0;  // first byte of the image word in the area
  std::uint8_t frame_byte = 0;
  std::uint8_t rotate = 0;
  std::uint16_t reserved = 0;

  std::uint64_t to_image(const std::byte* frame) const {
    return std::rotr(load_le<std::uint64_t>(frame + frame_byte), rotate);
  }
  std::uint64_t to_frame(std::uint64_t image_word) const {
    return std::rotl(image_word & mask, rotate);
  }
};
static_assert(sizeof(Run) == 16);

// A value outside of the image, in whole bytes; a BOOLEAN is one byte, 0 or 1.
struct ObjectRun {
  std::byte* data = nullptr;
  std::uint16_t frame_bit = 0;
  std::uint16_t bits = 0;
  bool is_word = false;  // 8 bytes may be loaded, and those beyond the value are 0

  void to_object(const std::byte* frame) const;
  // Its bits from bit 0 on; one bit for a BOOLEAN.
  std::uint64_t word() const { return is_word ? load_le<std::uint64_t>(data) : other_word(); }
  // Precondition: its bits in the frame are 0.
  void to_frame(std::byte* frame) const;

 private:
  std::uint64_t other_word() const;
};

struct CopyPlan {
  std::vector<Run> runs;
  std::vector<ObjectRun> objects;
  std::uint16_t bits = 0;  // length of the PDO, fillers included

  // Whether a bit that is set in the frame is copied to one of these image bits.
  bool reaches(const std::byte* frame, std::uint32_t image_bit, std::uint32_t count) const;
  std::size_t bytes() const { return (bits + 7U) / 8U; }

  // Append to the PDO; skip() leaves bits unused.
  void add_image(std::uint32_t image_bit, std::uint32_t count);
  void add_object(std::byte* data, std::uint32_t count, bool is_word = false);
  void skip(std::uint32_t count) { bits = static_cast<std::uint16_t>(bits + count); }
};

}  // namespace linegate::pdo

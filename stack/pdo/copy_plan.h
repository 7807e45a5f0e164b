// SPDX-License-Identifier: Apache-2.0
// How the bits of a PDO and of the values it maps are copied, decided when the PDO is configured.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "stack/base/byte_order.h"

namespace linegate::pdo {

// Bits of one 64-bit word of the frame that go to (come from) one 64-bit word of the image. Both
// words begin at a byte; rotating the frame's right by `rotate` brings its bits in place.
struct Run {
  std::uint64_t mask = 0;    // bits of the image word
  std::uint32_t offset = 0;  // byte of the area at which the image word begins
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

// A value that lives outside of the image, in whole bytes; BOOLEAN is one byte, 0 or 1.
struct ObjectRun {
  std::byte* data = nullptr;
  std::uint16_t frame_bit = 0;
  std::uint16_t bits = 0;
  bool is_word = false;  // 8 bytes may be loaded, and what is beyond the value is 0

  void to_object(const std::byte* frame) const;
  // Its bits, the lowest first; BOOLEAN one bit.
  std::uint64_t word() const { return is_word ? load_le<std::uint64_t>(data) : other_word(); }
  // Its bits of the frame are 0 before.
  void to_frame(std::byte* frame) const;

 private:
  std::uint64_t other_word() const;
};

struct CopyPlan {
  std::vector<Run> runs;
  std::vector<ObjectRun> objects;
  std::uint16_t bits = 0;  // of the PDO, fillers included

  // A bit that is set in the frame belongs to those of the image.
  bool reaches(const std::byte* frame, std::uint32_t image_bit, std::uint32_t count) const;
  std::size_t bytes() const { return (bits + 7U) / 8U; }

  // Both go on at the end of the PDO; skip() leaves bits out.
  void add_image(std::uint32_t image_bit, std::uint32_t count);
  void add_object(std::byte* data, std::uint32_t count, bool is_word = false);
  void skip(std::uint32_t count) { bits = static_cast<std::uint16_t>(bits + count); }
};

}  // namespace linegate::pdo

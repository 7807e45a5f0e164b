// SPDX-License-Identifier: Apache-2.0
#include "stack/pdo/copy_plan.h"

#include <algorithm>

namespace linegate::pdo {
namespace {

constexpr std::uint32_t kWord = 64;
constexpr std::uint32_t kLastFrameWord = 56;  // first byte of the last word of a frame

constexpr std::uint64_t low_bits(std::uint32_t bits) {
  return bits >= kWord ? ~std::uint64_t{0} : (std::uint64_t{1} << bits) - 1;
}

std::uint8_t rotation(std::uint32_t frame_shift, std::uint32_t image_shift) {
  return static_cast<std::uint8_t>((frame_shift + kWord - image_shift) % kWord);
}

// Whether the run can include these bits: they are in the same two words, at the same distance.
bool joins(const Run& run, std::uint32_t frame_bit, std::uint32_t image_bit, std::uint32_t count) {
  const std::uint32_t frame_begin = run.frame_byte * 8U;
  const std::uint32_t image_begin = run.offset * 8U;
  return frame_bit >= frame_begin && image_bit >= image_begin &&
         frame_bit + count <= frame_begin + kWord && image_bit + count <= image_begin + kWord &&
         rotation(frame_bit - frame_begin, image_bit - image_begin) == run.rotate;
}

// A frame of up to 8 bytes is one word; in longer frames a word begins at the byte of its first
// bit.
std::uint32_t frame_word_for(std::uint32_t frame_bit, std::uint32_t count) {
  return frame_bit + count <= kWord ? 0 : std::min(frame_bit / 8, kLastFrameWord);
}

}  // namespace

void CopyPlan::add_image(std::uint32_t image_bit, std::uint32_t count) {
  while (count != 0) {
    const std::uint32_t frame_bit = bits;
    const std::uint32_t image_byte = image_bit / 8;
    const std::uint32_t fits = std::min(kWord - frame_bit % 8, kWord - image_bit % 8);
    const std::uint32_t part = std::min(count, fits);
    if (runs.empty() || !joins(runs.back(), frame_bit, image_bit, part)) {
      const std::uint32_t frame_byte = frame_word_for(frame_bit, part);
      runs.push_back({0, image_byte, static_cast<std::uint8_t>(frame_byte),
                      rotation(frame_bit - 8 * frame_byte, image_bit % 8), 0});
    }
    runs.back().mask |= low_bits(part) << (image_bit - 8 * runs.back().offset);
    skip(part);
    image_bit += part;
    count -= part;
  }
}

bool CopyPlan::reaches(const std::byte* frame, std::uint32_t image_bit, std::uint32_t count) const {
  return std::ranges::any_of(runs, [&](const Run& run) {
    const std::uint32_t begin = std::max(8 * run.offset, image_bit);
    const std::uint32_t end = std::min(8 * run.offset + kWord, image_bit + count);
    const std::uint64_t wanted =
        begin < end ? low_bits(end - begin) << (begin - 8 * run.offset) : 0;
    return (run.to_image(frame) & run.mask & wanted) != 0;
  });
}

void CopyPlan::add_object(std::byte* data, std::uint32_t count, bool is_word) {
  objects.push_back({data, bits, static_cast<std::uint16_t>(count), is_word});
  skip(count);
}

void ObjectRun::to_object(const std::byte* frame) const {
  const unsigned shift = frame_bit % 8U;
  const std::byte* from = frame + frame_bit / 8U;
  if (bits < 8) {
    *data = (*from >> shift) & std::byte{1};
    return;
  }
  for (unsigned i = 0; i < bits / 8U; ++i) {
    data[i] = shift == 0 ? from[i] : from[i] >> shift | from[i + 1] << (8 - shift);
  }
}

void ObjectRun::to_frame(std::byte* frame) const {
  const unsigned shift = frame_bit % 8U;
  std::byte* const to = frame + frame_bit / 8U;
  if (bits < 8) {
    *to |= (*data & std::byte{1}) << shift;
    return;
  }
  for (unsigned i = 0; i < bits / 8U; ++i) {
    to[i] |= data[i] << shift;
    if (shift != 0) {
      to[i + 1] |= data[i] >> (8 - shift);
    }
  }
}

std::uint64_t ObjectRun::other_word() const {
  return bits < 8 ? std::to_integer<std::uint64_t>(*data & std::byte{1})
                  : load_le(std::span<const std::byte>(data, bits / 8U));
}

}  // namespace linegate::pdo

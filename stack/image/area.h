// SPDX-License-Identifier: Apache-2.0
// One direction of a process image: the bytes, and marks of the changes since the last snapshot.
// PDO copy plans write to it, so everything here is inline and flat.
//
// There are three kinds of marks, none of which requires the look-up of an entry when a frame is
// received:
//   dirty        one bit per bit of the image: it changed since the last snapshot. Snapshots
//                combine them into one `changed` bit per entry.
//   generations  per block of 64 bytes: the generation of the area in which it last changed. A copy
//                of the area with generation g lacks the blocks with a later generation.
//   pdos         per local PDO: number of receptions (transmissions) and time of the last one.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "stack/base/assert.h"
#include "stack/base/byte_order.h"
#include "stack/base/time.h"

namespace linegate::image {

inline constexpr std::size_t kBlockBytes = 64;
// Bytes after an area that a 64-bit access at its last byte may touch.
inline constexpr std::size_t kSlackBytes = 8;

// The state of one local PDO. attention is not 0 if the next frame needs more than copying; the
// reasons are bits: kNotValid here, the others belong to pdo::Engine.
struct PdoState {
  Instant last{};           // receive (send) time of the last frame that is in the image
  std::uint32_t count = 0;  // frames since the last snapshot
  std::uint32_t attention = 0;

  static constexpr std::uint32_t kNotValid = 0x01;  // its entries are not valid
};
static_assert(sizeof(PdoState) == 16);

class Area {
 public:
  explicit Area(std::size_t byte_size = 0, std::size_t pdos = 0);
  Area(Area&&) noexcept = default;
  Area& operator=(Area&&) noexcept = default;

  std::byte* data() { return hot_.bytes; }  // NOLINT(*-const): a constant area gives no way in
  const std::byte* data() const { return hot_.bytes; }
  std::size_t size() const { return bytes_.size() - kSlackBytes; }

  // Replaces the bits of `mask` in the 64-bit little-endian word at byte `offset` with those of
  // `word` and marks the changes. Returns true if a bit changed. Precondition: all bits of the mask
  // are in the area.
  bool merge(std::uint32_t offset, std::uint64_t word, std::uint64_t mask) {
    LINEGATE_ASSERT_HOT(has(offset, mask), "the bits lie in the area");
    const Hot hot = hot_;  // loaded before bytes are stored, which might alias it
    if (merge(hot, offset, word, mask) == 0) {
      return false;
    }
    hot_.changed_in = hot.generation;
    return true;
  }

  // Marks these bits of the word at byte `offset` as changed.
  void mark(std::uint32_t offset, std::uint64_t difference) {
    LINEGATE_ASSERT_HOT(has(offset, difference), "the bits lie in the area");
    const Hot hot = hot_;
    mark(hot, offset, difference);
    hot_.changed_in = hot.generation;
  }

  // A frame of PDO `slot` (local PDO number - 1) was copied into the image, or was sent.
  void touch(std::size_t slot, Instant time, std::uint32_t frames = 1) {
    LINEGATE_ASSERT_HOT(slot < pdos(), "the area has the PDO");
    const Hot hot = hot_;
    touch(hot, slot, time, frames);
    hot_.touched_in = hot.generation;
  }

  // merge() and touch() of the PDO in one.
  void receive(std::uint32_t offset, std::uint64_t word, std::uint64_t mask, std::size_t slot,
               Instant time, std::uint32_t frames = 1) {
    LINEGATE_ASSERT_HOT(has(offset, mask) && slot < pdos(), "the bits and the PDO are in the area");
    const Hot hot = hot_;
    if (merge(hot, offset, word, mask) != 0) {
      hot_.changed_in = hot.generation;
    }
    touch(hot, slot, time, frames);
    hot_.touched_in = hot.generation;
  }

  // A series of merges and touches without any other use of the area in between: state that no
  // frame changes stays in registers. changed() and touched() are updated at its end.
  class Series;

  PdoState& pdo(std::size_t slot) {  // NOLINT(*-const)
    LINEGATE_ASSERT_HOT(slot < pdos(), "the area has the PDO");
    return hot_.pdos[slot];
  }
  const PdoState& pdo(std::size_t slot) const {
    LINEGATE_ASSERT_HOT(slot < pdos(), "the area has the PDO");
    return hot_.pdos[slot];
  }
  std::size_t pdos() const { return pdos_.size(); }
  // Makes room for at least `count` PDOs; new ones are not valid. Allocates.
  void grow_pdos(std::size_t count);

  // Whether a value (or its validity) changed, or a PDO was touched, since the last snapshot.
  bool changed() const { return hot_.changed_in == hot_.generation; }
  bool touched() const { return hot_.touched_in == hot_.generation; }

 private:
  friend class ProcessImage;

  // Whether the bits of a 64-bit word at byte `offset` are in the area.
  bool has(std::uint32_t offset, std::uint64_t mask) const {
    return std::size_t{offset} * 8 + static_cast<std::size_t>(std::bit_width(mask)) <= size() * 8;
  }

  // All that a frame needs in one cache line; the vectors below own the memory it points to.
  struct alignas(64) Hot {
    std::byte* bytes = nullptr;
    std::byte* dirty = nullptr;
    std::uint64_t* generations = nullptr;
    PdoState* pdos = nullptr;
    std::uint64_t* touched = nullptr;
    std::uint64_t generation = 1;  // increases with every snapshot
    std::uint64_t changed_in = 0;
    std::uint64_t touched_in = 0;
  };

  // Returns the bits that changed.
  static std::uint64_t merge(const Hot& hot, std::uint32_t offset, std::uint64_t word,
                             std::uint64_t mask) {
    std::byte* const place = hot.bytes + offset;
    const auto old = load_le<std::uint64_t>(place);
    const std::uint64_t difference = (old ^ word) & mask;
    if (difference != 0) {
      store_le(place, old ^ difference);
      mark(hot, offset, difference);
    }
    return difference;
  }

  static void mark(const Hot& hot, std::uint32_t offset, std::uint64_t difference) {
    std::byte* const dirty = hot.dirty + offset;
    store_le(dirty, load_le<std::uint64_t>(dirty) | difference);
    hot.generations[offset / kBlockBytes] = hot.generation;
    hot.generations[(offset + sizeof difference - 1) / kBlockBytes] = hot.generation;
  }

  static void touch(const Hot& hot, std::size_t slot, Instant time, std::uint32_t frames) {
    hot.pdos[slot].last = time;
    hot.pdos[slot].count += frames;
    hot.touched[slot / 64] |= std::uint64_t{1} << (slot % 64);
  }

  Hot hot_;
  std::vector<std::byte> bytes_;
  std::vector<std::byte> dirty_;
  std::vector<std::uint64_t> generations_;
  std::vector<PdoState> pdos_;
  std::vector<std::uint64_t> touched_;
};

class Area::Series {
 public:
  explicit Series(Area& area) : area_(area), hot_(area.hot_) {}
  ~Series() {
    if (changes_ != 0) {
      area_.hot_.changed_in = hot_.generation;
    }
    if (touches_ != 0) {
      area_.hot_.touched_in = hot_.generation;
    }
  }
  Series(const Series&) = delete;
  Series& operator=(const Series&) = delete;

  void merge(std::uint32_t offset, std::uint64_t word, std::uint64_t mask) {
    LINEGATE_ASSERT_HOT(area_.has(offset, mask), "the bits lie in the area");
    changes_ |= Area::merge(hot_, offset, word, mask);
  }
  void touch(std::size_t slot, Instant time, std::uint32_t frames = 1) {
    LINEGATE_ASSERT_HOT(slot < area_.pdos(), "the area has the PDO");
    Area::touch(hot_, slot, time, frames);
    touches_ += frames;
  }
  const PdoState& pdo(std::size_t slot) const { return hot_.pdos[slot]; }
  // Number of frames so far.
  std::uint64_t touches() const { return touches_; }

 private:
  Area& area_;
  const Hot hot_;
  std::uint64_t changes_ = 0;
  std::uint64_t touches_ = 0;
};

}  // namespace linegate::image

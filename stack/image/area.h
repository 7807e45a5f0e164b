// One direction of a process image: the bytes, and the marks that say what happened to them since
// the last snapshot. This is what a PDO copy plan writes to, so everything here is inline and flat.
//
// Three kinds of marks are kept, none of which needs an entry to be looked up when a frame arrives:
//   dirty        one bit per bit of the image: it changed since the last snapshot. Snapshots fold
//                them into one `changed` bit per entry.
//   generations  per block of 64 bytes: the generation of the area in which it last changed. A copy
//                of the area that is up to date with generation g lacks the blocks with a later
//                one.
//   pdos         per local PDO: receptions (transmissions) and the time of the last.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "stack/base/byte_order.h"
#include "stack/base/time.h"

namespace linegate::image {

inline constexpr std::size_t kBlockBytes = 64;
// Bytes behind an area that a 64-bit access at its last byte may touch.
inline constexpr std::size_t kSlackBytes = 8;

// What is known about one local PDO. attention is not 0 when the next frame needs more than
// copying; the reasons are bits, kNotValid here, the others belong to pdo::Engine.
struct PdoState {
  Instant last{};           // receive (send) time of the last frame that is in the image
  std::uint32_t count = 0;  // frames since the last snapshot
  std::uint32_t attention = 0;

  static constexpr std::uint32_t kNotValid = 0x01;  // its entries are not (or no longer) valid
};
static_assert(sizeof(PdoState) == 16);

class Area {
 public:
  explicit Area(std::size_t byte_size = 0, std::size_t pdos = 0);

  std::byte* data() { return bytes_.data(); }
  const std::byte* data() const { return bytes_.data(); }
  std::size_t size() const { return bytes_.size() - kSlackBytes; }

  // Bits of `mask` in the 64-bit little-endian word at byte `offset` become those of `word`; what
  // changes is marked. True if anything changed. Precondition: no bit of the mask lies beyond the
  // area.
  bool merge(std::uint32_t offset, std::uint64_t word, std::uint64_t mask) {
    std::byte* const place = bytes_.data() + offset;
    const std::uint64_t old = load_le<std::uint64_t>(place);
    const std::uint64_t difference = (old ^ word) & mask;
    if (difference != 0) {
      store_le(place, old ^ difference);
      mark(offset, difference);
    }
    return difference != 0;
  }

  // Marks bits of the word at byte `offset` as changed.
  void mark(std::uint32_t offset, std::uint64_t difference) {
    std::byte* const dirty = dirty_.data() + offset;
    store_le(dirty, load_le<std::uint64_t>(dirty) | difference);
    generations_[offset / kBlockBytes] = generation_;
    generations_[(offset + sizeof difference - 1) / kBlockBytes] = generation_;
    changed_in_ = generation_;
  }

  // A frame of PDO `slot` (local PDO number - 1) is in the image, or was sent.
  void touch(std::size_t slot, Instant time) { touch(slot, time, 1); }
  void touch(std::size_t slot, Instant time, std::uint32_t frames) {
    PdoState& state = pdos_[slot];
    state.last = time;
    state.count += frames;
    touched_[slot / 64] |= std::uint64_t{1} << (slot % 64);
    touched_in_ = generation_;
  }

  PdoState& pdo(std::size_t slot) { return pdos_[slot]; }
  const PdoState& pdo(std::size_t slot) const { return pdos_[slot]; }
  std::size_t pdos() const { return pdos_.size(); }
  // Room for at least so many PDOs; new ones are not valid. Allocates.
  void grow_pdos(std::size_t count);

  // Some value (or its validity) changed, or some PDO was touched, since the last snapshot.
  bool changed() const { return changed_in_ == generation_; }
  bool touched() const { return touched_in_ == generation_; }

 private:
  friend class ProcessImage;

  std::vector<std::byte> bytes_;
  std::vector<std::byte> dirty_;
  std::vector<std::uint64_t> generations_;
  std::vector<PdoState> pdos_;
  std::vector<std::uint64_t> touched_;
  std::uint64_t generation_ = 1;
  std::uint64_t changed_in_ = 0;
  std::uint64_t touched_in_ = 0;
};

}  // namespace linegate::image

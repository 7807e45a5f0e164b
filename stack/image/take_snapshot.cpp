// SPDX-License-Identifier: Apache-2.0
// ProcessImage::snapshot(): converts marks to a consistent copy.
#include <algorithm>
#include <bit>

#include "stack/image/process_image.h"

namespace linegate::image {
namespace {

// Makes an empty snapshot of the layout with all the memory that later ones need.
void prepare(Snapshot& into, const Layout& layout, std::size_t pdos) {
  into = Snapshot{};
  into.direction = layout.direction;
  into.layout_id = layout.id;
  into.bytes.resize(layout.byte_size);
  into.changed.resize((layout.entries.size() + 63) / 64);
  into.valid.resize((layout.entries.size() + 63) / 64);
  into.known.resize((layout.entries.size() + 63) / 64);
  into.marks.reserve(pdos);
}

bool fits(const Snapshot& into, const Layout& layout) {
  return into.layout_id == layout.id && into.direction == layout.direction &&
         into.bytes.size() == layout.byte_size &&
         into.changed.size() == (layout.entries.size() + 63) / 64 &&
         into.valid.size() == into.changed.size() && into.known.size() == into.changed.size();
}

}  // namespace

void ProcessImage::snapshot(Direction direction, Snapshot& into, Instant now, bool merge,
                            std::uint32_t sync_count) {
  Side& s = side(direction);
  if (!fits(into, s.layout)) {
    prepare(into, s.layout, s.pdos.size());
  } else if (merge) {
    restore_marks(s, into);
  } else {
    std::ranges::fill(into.changed, 0);
  }
  copy_blocks(s, into);
  fold_changes(s, into);
  std::ranges::copy(s.valid, into.valid.begin());
  std::ranges::copy(s.known, into.known.begin());
  collect_marks(s, into);
  into.sequence = ++s.sequence;
  into.acquired = now;
  into.sync_count = sync_count;
  into.generation = s.area.hot_.generation++;
}

// A layout may be used again, and snapshots from its earlier use may still exist.
void ProcessImage::succeed(const ProcessImage& before) {
  for (const Direction direction : {Direction::inputs, Direction::outputs}) {
    Area& area = side(direction).area;
    area.hot_.generation = before.side(direction).area.hot_.generation + 1;
    std::ranges::fill(area.generations_, area.hot_.generation);
    area.hot_.changed_in = area.hot_.generation;
    side(direction).sequence = before.side(direction).sequence;
  }
}

// The counts of an unread snapshot are added to the present ones.
void ProcessImage::restore_marks(Side& side, const Snapshot& into) {
  for (const PdoMark& mark : into.marks) {
    const std::size_t slot = mark.local_pdo - 1U;
    side.area.touch(slot, std::max(mark.time, side.area.pdo(slot).last), mark.count);
  }
}

void ProcessImage::copy_blocks(Side& side, Snapshot& into) {
  const std::size_t size = side.area.size();
  for (std::size_t at = 0; at < size; at += kBlockBytes) {
    if (side.area.generations_[at / kBlockBytes] > into.generation) {
      std::memcpy(into.bytes.data() + at, side.area.data() + at, std::min(kBlockBytes, size - at));
    }
  }
}

void ProcessImage::fold_changes(Side& side, Snapshot& into) {
  Area& area = side.area;
  for (std::size_t block = 0; block < area.generations_.size(); ++block) {
    if (area.generations_[block] != area.hot_.generation) {
      continue;
    }
    for (std::uint32_t i = side.block_first[block]; i < side.block_first[block + 1]; ++i) {
      const Piece& piece = side.pieces[i];
      const auto dirty = load_le<std::uint64_t>(area.dirty_.data() + piece.offset) & piece.mask;
      into.changed[piece.entry / 64] |= std::uint64_t{dirty != 0} << (piece.entry % 64);
    }
    const std::size_t at = block * kBlockBytes;
    std::memset(area.dirty_.data() + at, 0, std::min(kBlockBytes, area.dirty_.size() - at));
  }
}

void ProcessImage::collect_marks(Side& side, Snapshot& into) {
  into.marks.clear();
  for (std::size_t word = 0; word < side.area.touched_.size(); ++word) {
    std::uint64_t bits = std::exchange(side.area.touched_[word], 0);
    for (; bits != 0; bits &= bits - 1) {
      const std::size_t slot = word * 64 + static_cast<std::size_t>(std::countr_zero(bits));
      PdoState& state = side.area.pdo(slot);
      const std::uint32_t count = std::exchange(state.count, 0);
      if (slot < side.pdos.size() && side.pdos[slot].entries.count != 0) {
        const Pdo& pdo = side.pdos[slot];
        into.marks.push_back({static_cast<std::uint16_t>(slot + 1), pdo.remote, pdo.node, count,
                              state.last, pdo.entries.first, pdo.entries.count});
      }
    }
  }
}

}  // namespace linegate::image

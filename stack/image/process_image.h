// SPDX-License-Identifier: Apache-2.0
// The process image of one line: all process data, inputs and outputs, with the marks from which
// snapshots are made.
//
// Both areas are little-endian and begin as zeros (IXXAT CANopen Manager API manual 6.1.4).
// Consistency: a PDO is written whole by pdo::Engine, so all its bytes in a snapshot are from the
// same frame. Nothing allocates except where said.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "stack/base/time.h"
#include "stack/image/area.h"
#include "stack/image/layout.h"
#include "stack/image/snapshot.h"
#include "stack/od/dictionary.h"

namespace linegate::image {

// A bit of the image.
struct Place {
  Direction direction = Direction::inputs;
  std::uint32_t bit_offset = 0;
};

class ProcessImage {
 public:
  // An image without entries.
  ProcessImage();
  // Allocates everything. The bytes stay where they are as long as the image lives.
  ProcessImage(Layout inputs, Layout outputs);
  ~ProcessImage();
  ProcessImage(const ProcessImage&) = delete;
  ProcessImage& operator=(const ProcessImage&) = delete;

  const Layout& layout(Direction direction) const { return side(direction).layout; }
  Area& area(Direction direction) { return side(direction).area; }
  const Area& area(Direction direction) const { return side(direction).area; }
  std::span<const std::byte> bytes(Direction direction) const;

  // --- snapshots --------------------------------------------------------------------------------

  // Brings `into` (an earlier snapshot of this direction and image, or an empty one) up to date,
  // copying only blocks that are stale in it, moves the marks since the last snapshot into it and
  // clears them here. With merge, the marks already in `into`, which nobody has read, are kept:
  // changed bits are united, counts are added. Allocates only when `into` is not of this layout.
  void snapshot(Direction direction, Snapshot& into, Instant now, bool merge,
                std::uint32_t sync_count);
  // This image takes the place of `before`: no snapshot of that one, or of one before it, is taken
  // for one of this. To be called before the first snapshot.
  void succeed(const ProcessImage& before);
  // A value or its validity changed, or a PDO was received (sent), since the last snapshot.
  bool changed(Direction direction) const { return area(direction).changed(); }
  bool touched(Direction direction) const { return area(direction).touched(); }

  // --- writing values (outputs, by the application) ---------------------------------------------

  // The entry gets the low bits of `value` (little-endian; 8 * value.size() >= its bit length, at
  // most 8 bytes are used) and becomes known and valid; but see follow_transmission(). True if it
  // changed. Precondition: the entry exists.
  bool write_entry(Direction direction, std::uint32_t entry, std::span<const std::byte> value);
  bool write_entry(Direction direction, std::uint32_t entry, std::uint64_t value);
  // Bytes [offset, offset + value.size()), which must lie in the area; entries that are covered
  // completely become known and valid as by write_entry(). True if anything changed.
  bool write_bytes(Direction direction, std::uint32_t offset, std::span<const std::byte> value);
  // The entry's value, zero-extended; the low 64 bits of longer ones.
  std::uint64_t read_entry(Direction direction, std::uint32_t entry) const;
  // Bits were written directly into the area: all of them count as changed.
  void mark_written(Direction direction, std::uint32_t bit_offset, std::uint32_t bits);

  // --- validity (cold) --------------------------------------------------------------------------

  // From now on an output entry of a local PDO becomes valid by set_pdo_valid() alone, when its PDO
  // was transmitted, and is not valid any more when another value is written.
  void follow_transmission() { side(Direction::outputs).follows_transmission = true; }

  // All entries of a node, of a local PDO, one entry. An input PDO that was made invalid becomes
  // valid again with the next frame, an output PDO when it is transmitted.
  void set_node_valid(std::uint8_t node, bool valid);  // inputs only
  void set_pdo_valid(Direction direction, std::uint16_t local_pdo, bool valid);
  void set_entry_valid(Direction direction, std::uint32_t entry, bool valid);
  bool is_valid(Direction direction, std::uint32_t entry) const;

  // The entry was written since the start (by the application, or with its default), unless it was
  // forgotten since. Of inputs: nothing.
  bool is_known(Direction direction, std::uint32_t entry) const;
  // Every entry of the PDO is known (true if it has none): an output PDO may be sent.
  bool pdo_known(Direction direction, std::uint16_t local_pdo) const;
  // The entry is neither known nor valid any more: its PDO is held back.
  void forget_entry(Direction direction, std::uint32_t entry);

  // --- where things are -------------------------------------------------------------------------

  // The entries of a local PDO: first and number; {0, 0} if it has none.
  struct EntryRange {
    std::uint32_t first = 0;
    std::uint32_t count = 0;
  };
  EntryRange entries_of(Direction direction, std::uint16_t local_pdo) const;
  // The node a local PDO is shared with; 0 if it has no entries.
  std::uint8_t node_of(Direction direction, std::uint16_t local_pdo) const;

  // Where a dictionary variable lies in this image: its storage is in an area (Dictionary::bind,
  // add_window) or is the byte that stands for one bit (see network_variables.h).
  std::optional<Place> locate(const std::byte* data) const;

  // --- for network_variables.h ------------------------------------------------------------------

  // One byte for each of the first `count` bits of an area. Allocates when called first.
  std::span<std::byte> boolean_bytes(Direction direction, std::size_t count);
  // Keeps the hook as long as the image lives.
  void keep(std::unique_ptr<od::Hook> hook) { variables_ = std::move(hook); }
  od::Hook* kept() const { return variables_.get(); }

 private:
  // Part of an entry: a mask on the word at a byte. Entries of more than 64 bits have several.
  struct Piece {
    std::uint64_t mask = 0;
    std::uint32_t offset = 0;
    std::uint32_t entry = 0;
  };
  struct Pdo {
    EntryRange entries;
    std::uint16_t remote = 0;
    std::uint8_t node = 0;
  };
  struct Side {
    Layout layout;
    Area area;
    std::vector<std::uint64_t> valid;
    std::vector<std::uint64_t> known;
    bool follows_transmission = false;       // see follow_transmission()
    std::vector<Pdo> pdos;                   // by local PDO number - 1
    std::vector<std::uint32_t> block_first;  // per block, and one more: where its pieces begin
    std::vector<Piece> pieces;               // of block 0, 1, ...; in two blocks if it lies in both
    std::vector<std::byte> booleans;         // one byte per bit, for BOOLEAN network variables
    std::uint64_t sequence = 0;
  };

  Side& side(Direction direction) { return sides_[static_cast<std::size_t>(direction)]; }
  const Side& side(Direction direction) const {
    return sides_[static_cast<std::size_t>(direction)];
  }
  static Side make_side(Layout layout);
  static bool is_sent(const Side& side, std::uint32_t entry) {
    return side.follows_transmission && side.layout.entries[entry].local_pdo != 0;
  }
  // The entry was written; changed: with another value.
  void note_written(Direction direction, std::uint32_t entry, bool changed);
  static void index_pieces(Side& side);
  static void take_back_marks(Side& side, const Snapshot& into);
  static void copy_blocks(Side& side, Snapshot& into);
  static void fold_changes(Side& side, Snapshot& into);
  static void collect_marks(Side& side, Snapshot& into);

  std::array<Side, 2> sides_;
  std::unique_ptr<od::Hook> variables_;
};

}  // namespace linegate::image

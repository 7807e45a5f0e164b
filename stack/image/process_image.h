// SPDX-License-Identifier: Apache-2.0
// The process image of one line: all process data, inputs and outputs, with the marks for making
// snapshots.
//
// Both areas are little-endian and initially zero (IXXAT CANopen Manager API manual 6.1.4).
// Consistency: pdo::Engine writes a PDO as a whole, so all its bytes in a snapshot are from the
// same frame. Nothing allocates unless stated.
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

// The position of a bit in the image.
struct Place {
  Direction direction = Direction::inputs;
  std::uint32_t bit_offset = 0;
};

// Decides which output entries of no local PDO are valid.
class OutputListener {
 public:
  virtual ~OutputListener() = default;
  // The entry was written, with the same value or another one. Called several times for some
  // writes, the last time when the image has the value.
  virtual void output_written(std::uint32_t entry) = 0;
};

class ProcessImage {
 public:
  // An image without entries.
  ProcessImage();
  // Allocates all memory. The bytes do not move during the lifetime of the image.
  ProcessImage(Layout inputs, Layout outputs);
  ~ProcessImage();
  ProcessImage(const ProcessImage&) = delete;
  ProcessImage& operator=(const ProcessImage&) = delete;

  const Layout& layout(Direction direction) const { return side(direction).layout; }
  Area& area(Direction direction) { return side(direction).area; }
  const Area& area(Direction direction) const { return side(direction).area; }
  std::span<const std::byte> bytes(Direction direction) const;

  // --- snapshots --------------------------------------------------------------------------------

  // Updates `into` (an earlier snapshot of this direction and image, or an empty one), copying only
  // its stale blocks, and moves the marks since the last snapshot into it. With merge, the marks in
  // `into` were not read yet and are kept: changed bits are united, counts are added. Allocates
  // only if `into` does not have this layout.
  void snapshot(Direction direction, Snapshot& into, Instant now, bool merge,
                std::uint32_t sync_count);
  // This image replaces `before`: snapshots of `before`, or of its predecessors, are not mistaken
  // for snapshots of this one. Call it before the first snapshot.
  void succeed(const ProcessImage& before);
  // Whether a value or its validity changed, or a PDO was received (sent), since the last snapshot.
  bool changed(Direction direction) const { return area(direction).changed(); }
  bool touched(Direction direction) const { return area(direction).touched(); }

  // --- writing values (outputs, by the application) ---------------------------------------------

  // Sets the entry to the low bits of `value` (little-endian; 8 * value.size() >= its bit length,
  // at most 8 bytes are used). The entry becomes known and valid; but see follow_transmission().
  // Returns true if it changed. Precondition: the entry exists.
  bool write_entry(Direction direction, std::uint32_t entry, std::span<const std::byte> value);
  bool write_entry(Direction direction, std::uint32_t entry, std::uint64_t value);
  // Writes bytes [offset, offset + value.size()), which must be in the area; entries that are
  // covered completely become known and valid as by write_entry(). Returns true if a bit changed.
  bool write_bytes(Direction direction, std::uint32_t offset, std::span<const std::byte> value);
  // The entry's value, zero-extended; the low 64 bits of longer entries.
  std::uint64_t read_entry(Direction direction, std::uint32_t entry) const;
  // As read_entry() and write_entry() for 8 bytes of a longer entry: those from byte 8 * part on,
  // or as many as there are. Precondition: part < value_parts(entry).
  std::uint64_t read_part(Direction direction, std::uint32_t entry, std::uint8_t part) const;
  bool write_part(Direction direction, std::uint32_t entry, std::uint8_t part, std::uint64_t value);
  // These bits were written directly into the area: marks all of them as changed.
  void mark_written(Direction direction, std::uint32_t bit_offset, std::uint32_t bits);

  // --- validity (cold) --------------------------------------------------------------------------

  // From now on an output entry of a local PDO becomes valid only by set_pdo_valid(), when its PDO
  // was transmitted, and becomes invalid when another value is written.
  void follow_transmission() { side(Direction::outputs).follows_transmission = true; }
  // From now on writes do not make an output entry of no local PDO valid: the listener does, by
  // set_entry_valid(). It must outlive the image, or the last write.
  void set_listener(OutputListener& listener) { side(Direction::outputs).listener = &listener; }

  // Validity of all entries of a node, of a local PDO, or of one entry. An invalid input PDO
  // becomes valid again with its next frame, an invalid output PDO when it is transmitted.
  void set_node_valid(std::uint8_t node, bool valid);  // inputs only
  void set_pdo_valid(Direction direction, std::uint16_t local_pdo, bool valid);
  void set_entry_valid(Direction direction, std::uint32_t entry, bool valid);
  bool is_valid(Direction direction, std::uint32_t entry) const;

  // Whether the entry was written since the start (by the application, or with its default) and not
  // forgotten since. Meaningless for inputs.
  bool is_known(Direction direction, std::uint32_t entry) const;
  // Whether every entry of the PDO is known (true if it has no entries): an output PDO may be sent.
  bool pdo_known(Direction direction, std::uint16_t local_pdo) const;
  // The entry becomes unknown and invalid: its PDO is held back.
  void forget_entry(Direction direction, std::uint32_t entry);

  // --- where things are -------------------------------------------------------------------------

  // The entries of a local PDO: first one and number; {0, 0} if it has none.
  struct EntryRange {
    std::uint32_t first = 0;
    std::uint32_t count = 0;
  };
  EntryRange entries_of(Direction direction, std::uint16_t local_pdo) const;
  // The remote node of a local PDO; 0 if it has no entries.
  std::uint8_t node_of(Direction direction, std::uint16_t local_pdo) const;

  // The position of a dictionary variable in this image, if its storage is in an area
  // (Dictionary::bind, add_window) or is the byte that represents one bit (see
  // network_variables.h).
  std::optional<Place> locate(const std::byte* data) const;

  // --- for network_variables.h ------------------------------------------------------------------

  // One byte for each of the first `count` bits of an area. The first call allocates.
  std::span<std::byte> boolean_bytes(Direction direction, std::size_t count);
  // Keeps the hook for the lifetime of the image.
  void keep(std::unique_ptr<od::Hook> hook) { variables_ = std::move(hook); }
  od::Hook* kept() const { return variables_.get(); }

 private:
  // Part of an entry: a mask on the word at a byte offset. Entries of more than 64 bits have
  // several.
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
    OutputListener* listener = nullptr;      // see set_listener()
    std::vector<Pdo> pdos;                   // by local PDO number - 1
    std::vector<std::uint32_t> block_first;  // by block, and one more: position of its first piece
    std::vector<Piece> pieces;        // of block 0, 1, ...; twice if it extends over two blocks
    std::vector<std::byte> booleans;  // one byte per bit, for BOOLEAN network variables
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
  // Calls function(entry) for the entries with some of these bits. Precondition: bits is not 0.
  template <class Function>
  static void for_each_entry(const Side& side, std::uint32_t bit_offset, std::uint32_t bits,
                             Function function);
  // The entry was written; changed: its value is different.
  void note_written(Direction direction, std::uint32_t entry, bool changed);
  static void index_pieces(Side& side);
  static void restore_marks(Side& side, const Snapshot& into);
  static void copy_blocks(Side& side, Snapshot& into);
  static void fold_changes(Side& side, Snapshot& into);
  static void collect_marks(Side& side, Snapshot& into);

  std::array<Side, 2> sides_;
  std::unique_ptr<od::Hook> variables_;
};

}  // namespace linegate::image

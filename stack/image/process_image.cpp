// SPDX-License-Identifier: Apache-2.0
// Construction of an image, access to its entries, and their validity.
#include "stack/image/process_image.h"

#include <algorithm>
#include <functional>

#include "stack/base/assert.h"

namespace linegate::image {
namespace {

constexpr std::uint64_t low_bits(std::uint32_t bits) {
  return bits >= 64 ? ~std::uint64_t{0} : (std::uint64_t{1} << bits) - 1;
}

constexpr std::size_t words(std::size_t bits) {
  return (bits + 63) / 64;
}

void set_bit(std::vector<std::uint64_t>& bitmap, std::size_t bit, bool value) {
  const std::uint64_t mask = std::uint64_t{1} << (bit % 64);
  bitmap[bit / 64] = value ? bitmap[bit / 64] | mask : bitmap[bit / 64] & ~mask;
}

bool get_bit(const std::vector<std::uint64_t>& bitmap, std::size_t bit) {
  return (bitmap[bit / 64] >> (bit % 64) & 1U) != 0;
}

// Calls part(byte offset, shift, bits, bits done before) for consecutive parts of a range of bits.
// Each part is in one 64-bit word that starts at the byte offset; all parts except the last end at
// a byte boundary.
template <class Part>
void for_each_word(std::uint32_t bit_offset, std::uint32_t bits, Part part) {
  for (std::uint32_t done = 0; done < bits;) {
    const std::uint32_t shift = (bit_offset + done) % 8;
    const std::uint32_t count = std::min(bits - done, shift == 0 ? 64U : 56U);
    part((bit_offset + done) / 8, shift, count, done);
    done += count;
  }
}

// Whether the entry is in the 64-bit word at the byte of its first bit, as nearly all are.
bool is_in_one_word(const Entry& entry) {
  return entry.bit_offset % 8 + entry.bit_length <= 64;
}

}  // namespace

ProcessImage::ProcessImage()
    : ProcessImage(Layout{}, Layout{.direction = Direction::outputs, .id = 0, .entries = {}}) {
}

ProcessImage::ProcessImage(Layout inputs, Layout outputs)
    : sides_{make_side(std::move(inputs)), make_side(std::move(outputs))} {
}

ProcessImage::~ProcessImage() = default;

ProcessImage::Side ProcessImage::make_side(Layout layout) {
  Side side;
  std::vector<Pdo>& pdos = side.pdos;
  for (std::uint32_t i = 0; i < layout.entries.size(); ++i) {
    const Entry& entry = layout.entries[i];
    if (entry.local_pdo == 0) {
      continue;
    }
    pdos.resize(std::max<std::size_t>(pdos.size(), entry.local_pdo));
    Pdo& pdo = pdos[entry.local_pdo - 1U];
    if (pdo.entries.count++ == 0) {
      pdo.entries.first = i;
      pdo.remote = entry.remote_pdo;
      pdo.node = entry.node;
    }
  }
  side.area = Area(layout.byte_size, pdos.size());
  side.valid.resize(words(layout.entries.size()));
  side.known.resize(side.valid.size());
  side.layout = std::move(layout);
  index_pieces(side);
  return side;
}

// Sorts the pieces of all entries by block.
void ProcessImage::index_pieces(Side& side) {
  std::vector<std::vector<Piece>> blocks(side.area.generations_.size());
  for (std::uint32_t i = 0; i < side.layout.entries.size(); ++i) {
    const Entry& entry = side.layout.entries[i];
    for_each_word(entry.bit_offset, entry.bit_length,
                  [&](std::uint32_t byte, std::uint32_t shift, std::uint32_t bits, std::uint32_t) {
                    const Piece piece{low_bits(bits) << shift, byte, i};
                    const std::size_t first = byte / kBlockBytes;
                    const std::size_t last = (byte + (shift + bits - 1) / 8) / kBlockBytes;
                    blocks[first].push_back(piece);
                    if (last != first) {
                      blocks[last].push_back(piece);
                    }
                  });
  }
  for (const std::vector<Piece>& pieces : blocks) {
    side.block_first.push_back(static_cast<std::uint32_t>(side.pieces.size()));
    side.pieces.insert(side.pieces.end(), pieces.begin(), pieces.end());
  }
  side.block_first.push_back(static_cast<std::uint32_t>(side.pieces.size()));
}

std::span<const std::byte> ProcessImage::bytes(Direction direction) const {
  return {area(direction).data(), area(direction).size()};
}

bool ProcessImage::write_entry(Direction direction, std::uint32_t entry,
                               std::span<const std::byte> value) {
  Side& s = side(direction);
  LINEGATE_ASSERT(entry < s.layout.entries.size(), "the entry exists");
  const Entry& at = s.layout.entries[entry];
  LINEGATE_ASSERT(value.size() * 8 >= at.bit_length, "the value has every bit of the entry");
  bool changed = false;
  for_each_word(
      at.bit_offset, at.bit_length,
      [&](std::uint32_t byte, std::uint32_t shift, std::uint32_t bits, std::uint32_t done) {
        const auto source = value.subspan(done / 8, (bits + 7) / 8);
        changed |= s.area.merge(byte, load_le(source) << shift, low_bits(bits) << shift);
      });
  note_written(direction, entry, changed);
  return changed;
}

[[gnu::hot]] void ProcessImage::note_written(Direction direction, std::uint32_t entry,
                                             bool changed) {
  Side& s = side(direction);
  if (!get_bit(s.known, entry)) {
    set_bit(s.known, entry, true);
    s.area.hot_.changed_in = s.area.hot_.generation;
  }
  if (is_sent(s, entry)) {
    if (changed) {
      set_entry_valid(direction, entry, false);
    }
  } else if (s.listener != nullptr && s.layout.entries[entry].local_pdo == 0) [[unlikely]] {
    s.listener->output_written(entry);
  } else {
    set_entry_valid(direction, entry, true);
  }
}

[[gnu::hot]] bool ProcessImage::write_entry(Direction direction, std::uint32_t entry,
                                            std::uint64_t value) {
  Side& s = side(direction);
  LINEGATE_ASSERT(entry < s.layout.entries.size(), "the entry exists");
  const Entry& at = s.layout.entries[entry];
  if (is_in_one_word(at)) [[likely]] {
    const std::uint32_t shift = at.bit_offset % 8;
    const bool changed =
        s.area.merge(at.bit_offset / 8, value << shift, low_bits(at.bit_length) << shift);
    note_written(direction, entry, changed);
    return changed;
  }
  LINEGATE_ASSERT(at.bit_length <= 64, "the value has every bit of the entry");
  std::array<std::byte, 8> raw;
  store_le(std::span(raw), value);
  return write_entry(direction, entry, std::span<const std::byte>(raw));
}

bool ProcessImage::write_part(Direction direction, std::uint32_t entry, std::uint8_t part,
                              std::uint64_t value) {
  Side& s = side(direction);
  LINEGATE_ASSERT(entry < s.layout.entries.size(), "the entry exists");
  const Entry& at = s.layout.entries[entry];
  LINEGATE_ASSERT(part < value_parts(at), "the entry has the part");
  bool changed = false;
  for_each_word(
      at.bit_offset + 64U * part, std::min(at.bit_length - 64U * part, 64U),
      [&](std::uint32_t byte, std::uint32_t shift, std::uint32_t bits, std::uint32_t done) {
        const std::uint64_t mask = low_bits(bits) << shift;
        changed |= s.area.merge(byte, value >> done << shift, mask);
      });
  note_written(direction, entry, changed);
  return changed;
}

bool ProcessImage::write_bytes(Direction direction, std::uint32_t offset,
                               std::span<const std::byte> value) {
  Side& s = side(direction);
  LINEGATE_ASSERT(std::uint64_t{offset} + value.size() <= s.area.size(),
                  "the bytes lie in the area");
  const std::uint64_t begin = std::uint64_t{offset} * 8;
  const std::uint64_t end = begin + value.size() * 8;
  const std::size_t first_block = offset / kBlockBytes;
  const std::size_t last_block = (offset + value.size()) / kBlockBytes;
  for (std::uint32_t i = s.block_first[first_block]; i < s.block_first[last_block + 1]; ++i) {
    const Piece& piece = s.pieces[i];
    const Entry& entry = s.layout.entries[piece.entry];
    if (entry.bit_offset >= begin && entry.bit_offset + entry.bit_length <= end) {
      const std::span<const std::byte> written = value.subspan(piece.offset - offset);
      const std::uint64_t word = load_le(written.first(std::min<std::size_t>(8, written.size())));
      const auto before = load_le<std::uint64_t>(s.area.data() + piece.offset);
      note_written(direction, piece.entry, ((word ^ before) & piece.mask) != 0);
    }
  }
  bool changed = false;
  for (std::size_t done = 0; done < value.size(); done += 8) {
    const auto part = value.subspan(done, std::min<std::size_t>(8, value.size() - done));
    changed |= s.area.merge(static_cast<std::uint32_t>(offset + done), load_le(part),
                            low_bits(static_cast<std::uint32_t>(8 * part.size())));
  }
  if (s.listener != nullptr && !value.empty()) {
    const auto bits = static_cast<std::uint32_t>(8 * value.size());
    for_each_entry(s, 8 * offset, bits, [&s](std::uint32_t entry) {
      if (s.layout.entries[entry].local_pdo == 0) {
        s.listener->output_written(entry);
      }
    });
  }
  return changed;
}

template <class Function>
void ProcessImage::for_each_entry(const Side& side, std::uint32_t bit_offset, std::uint32_t bits,
                                  Function function) {
  const std::size_t last_block = (bit_offset + bits - 1) / 8 / kBlockBytes;
  for (std::uint32_t i = side.block_first[bit_offset / 8 / kBlockBytes];
       i < side.block_first[last_block + 1]; ++i) {
    const Entry& entry = side.layout.entries[side.pieces[i].entry];
    if (entry.bit_offset < bit_offset + bits && entry.bit_offset + entry.bit_length > bit_offset) {
      function(side.pieces[i].entry);
    }
  }
}

[[gnu::hot]] std::uint64_t ProcessImage::read_entry(Direction direction,
                                                    std::uint32_t entry) const {
  const Side& s = side(direction);
  LINEGATE_ASSERT(entry < s.layout.entries.size(), "the entry exists");
  const Entry& at = s.layout.entries[entry];
  if (is_in_one_word(at)) [[likely]] {
    const auto word = load_le<std::uint64_t>(s.area.data() + at.bit_offset / 8);
    return word >> at.bit_offset % 8 & low_bits(at.bit_length);
  }
  return read_part(direction, entry, 0);
}

std::uint64_t ProcessImage::read_part(Direction direction, std::uint32_t entry,
                                      std::uint8_t part) const {
  const Side& s = side(direction);
  LINEGATE_ASSERT(entry < s.layout.entries.size(), "the entry exists");
  const Entry& at = s.layout.entries[entry];
  LINEGATE_ASSERT(part < value_parts(at), "the entry has the part");
  std::uint64_t value = 0;
  for_each_word(
      at.bit_offset + 64U * part, std::min(at.bit_length - 64U * part, 64U),
      [&](std::uint32_t byte, std::uint32_t shift, std::uint32_t bits, std::uint32_t done) {
        const auto word = load_le<std::uint64_t>(s.area.data() + byte);
        value |= (word >> shift & low_bits(bits)) << done;
      });
  return value;
}

void ProcessImage::mark_written(Direction direction, std::uint32_t bit_offset, std::uint32_t bits) {
  for_each_word(bit_offset, bits,
                [&](std::uint32_t byte, std::uint32_t shift, std::uint32_t count, std::uint32_t) {
                  area(direction).mark(byte, low_bits(count) << shift);
                });
  Side& s = side(direction);
  if ((!s.follows_transmission && s.listener == nullptr) || bits == 0) {
    return;
  }
  for_each_entry(s, bit_offset, bits, [&](std::uint32_t entry) {
    if (is_sent(s, entry)) {
      set_entry_valid(direction, entry, false);
    } else if (s.listener != nullptr && s.layout.entries[entry].local_pdo == 0) {
      s.listener->output_written(entry);
    }
  });
}

void ProcessImage::set_node_valid(std::uint8_t node, bool valid) {
  const std::vector<Pdo>& pdos = side(Direction::inputs).pdos;
  for (std::size_t i = 0; i < pdos.size(); ++i) {
    if (pdos[i].entries.count != 0 && pdos[i].node == node) {
      set_pdo_valid(Direction::inputs, static_cast<std::uint16_t>(i + 1), valid);
    }
  }
}

[[gnu::hot]] void ProcessImage::set_pdo_valid(Direction direction, std::uint16_t local_pdo,
                                              bool valid) {
  Side& s = side(direction);
  if (local_pdo == 0 || local_pdo > s.area.pdos()) {
    return;
  }
  std::uint32_t& attention = s.area.pdo(local_pdo - 1U).attention;
  attention = valid ? attention & ~PdoState::kNotValid : attention | PdoState::kNotValid;
  const EntryRange range = entries_of(direction, local_pdo);
  for (std::uint32_t entry = range.first; entry < range.first + range.count; ++entry) {
    set_entry_valid(direction, entry, valid);
  }
}

[[gnu::hot]] void ProcessImage::set_entry_valid(Direction direction, std::uint32_t entry,
                                                bool valid) {
  Side& s = side(direction);
  if (get_bit(s.valid, entry) == valid) {
    return;
  }
  set_bit(s.valid, entry, valid);
  s.area.hot_.changed_in = s.area.hot_.generation;
  if (!valid && is_sent(s, entry)) {
    s.area.pdo(s.layout.entries[entry].local_pdo - 1U).attention |= PdoState::kNotValid;
  }
}

[[gnu::hot]] bool ProcessImage::is_valid(Direction direction, std::uint32_t entry) const {
  return get_bit(side(direction).valid, entry);
}

[[gnu::hot]] bool ProcessImage::is_known(Direction direction, std::uint32_t entry) const {
  return get_bit(side(direction).known, entry);
}

[[gnu::hot]] bool ProcessImage::pdo_known(Direction direction, std::uint16_t local_pdo) const {
  const EntryRange range = entries_of(direction, local_pdo);
  for (std::uint32_t entry = range.first; entry < range.first + range.count; ++entry) {
    if (!is_known(direction, entry)) {
      return false;
    }
  }
  return true;
}

void ProcessImage::forget_entry(Direction direction, std::uint32_t entry) {
  Side& s = side(direction);
  if (get_bit(s.known, entry)) {
    set_bit(s.known, entry, false);
    s.area.hot_.changed_in = s.area.hot_.generation;
  }
  set_entry_valid(direction, entry, false);
}

[[gnu::hot]] ProcessImage::EntryRange ProcessImage::entries_of(Direction direction,
                                                               std::uint16_t local_pdo) const {
  const std::vector<Pdo>& pdos = side(direction).pdos;
  return local_pdo == 0 || local_pdo > pdos.size() ? EntryRange{} : pdos[local_pdo - 1U].entries;
}

std::uint8_t ProcessImage::node_of(Direction direction, std::uint16_t local_pdo) const {
  const std::vector<Pdo>& pdos = side(direction).pdos;
  return local_pdo == 0 || local_pdo > pdos.size() ? std::uint8_t{0} : pdos[local_pdo - 1U].node;
}

std::optional<Place> ProcessImage::locate(const std::byte* data) const {
  const auto inside = [data](const std::byte* begin, std::size_t size) {
    return size != 0 && !std::less<>()(data, begin) && std::less<>()(data, begin + size);
  };
  for (const Direction direction : {Direction::inputs, Direction::outputs}) {
    const Side& s = side(direction);
    if (inside(s.area.data(), s.area.size())) {
      return Place{direction, static_cast<std::uint32_t>(data - s.area.data()) * 8};
    }
    if (inside(s.booleans.data(), s.booleans.size())) {
      return Place{direction, static_cast<std::uint32_t>(data - s.booleans.data())};
    }
  }
  return std::nullopt;
}

std::span<std::byte> ProcessImage::boolean_bytes(Direction direction, std::size_t count) {
  Side& s = side(direction);
  if (s.booleans.empty()) {
    s.booleans.resize(count);
  }
  return s.booleans;
}

}  // namespace linegate::image

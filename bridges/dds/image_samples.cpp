// SPDX-License-Identifier: Apache-2.0
#include "bridges/dds/image_samples.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "bridges/dds/bytes.h"
#include "stack/base/short_text.h"
#include "stack/image/limits.h"

namespace linegate::dds {
namespace {

template <class Wire, class Stack, class Pair>
void each_member(Wire& wire, Stack& stack, Pair pair) {
  pair(wire.bit_offset(), stack.bit_offset);
  pair(wire.bit_length(), stack.bit_length);
  pair(wire.data_type(), stack.type);
  pair(wire.node(), stack.node);
  pair(wire.index(), stack.index);
  pair(wire.sub(), stack.sub);
  pair(wire.remote_pdo(), stack.remote_pdo);
  pair(wire.local_pdo(), stack.local_pdo);
  pair(wire.variable_index(), stack.variable_index);
  pair(wire.variable_sub(), stack.variable_sub);
  pair(wire.profile(), stack.profile);
  pair(wire.product_code(), stack.product_code);
  pair(wire.scale(), stack.scaling.scale);
  pair(wire.offset(), stack.scaling.offset);
  pair(wire.access(), stack.access);
  pair(wire.transmission_type(), stack.transmission_type);
}

struct GivenNumber {
  std::uint8_t bit;
  std::optional<double> image::Entry::*stack;
  double (v1::LayoutEntry::*get)() const;
  void (v1::LayoutEntry::*set)(double);
};
constexpr GivenNumber kGivenNumbers[] = {
    {v1::GIVEN_LOW, &image::Entry::low, &v1::LayoutEntry::low, &v1::LayoutEntry::low},
    {v1::GIVEN_HIGH, &image::Entry::high, &v1::LayoutEntry::high, &v1::LayoutEntry::high},
    {v1::GIVEN_INITIAL, &image::Entry::initial, &v1::LayoutEntry::initial,
     &v1::LayoutEntry::initial},
};

void meaning_to_wire(const image::Entry& from, v1::LayoutEntry& to) {
  to.name(short_text(from.name, image::kLongestEntryName));
  to.unit(short_text(from.scaling.unit, od::kLongestUnit));
  to.given(0);
  for (const GivenNumber& number : kGivenNumbers) {
    const double value = (from.*number.stack).value_or(0.0);
    const bool given = (from.*number.stack).has_value() && std::isfinite(value);
    (to.*number.set)(given ? value : 0.0);
    to.given(static_cast<std::uint8_t>(to.given() | (given ? number.bit : 0)));
  }
  to.inhibit_ns(from.inhibit.count());
  to.event_timer_ns(from.event_timer.count());
  to.group(from.group ? std::int32_t{*from.group} : -1);
}

// The contract numbers bits from the low end of each octet, which is the bit order of little-endian
// words.
void words_to_octets(const std::vector<std::uint64_t>& from, std::vector<std::uint8_t>& to) {
  to.resize(from.size() * 8);
  for (std::size_t i = 0; i < to.size(); ++i) {
    to[i] = static_cast<std::uint8_t>(from[i / 8] >> (i % 8 * 8));
  }
}

void octets_to_words(const std::vector<std::uint8_t>& from, std::vector<std::uint64_t>& to) {
  to.assign((from.size() + 7) / 8, 0);
  for (std::size_t i = 0; i < from.size(); ++i) {
    to[i / 8] |= std::uint64_t{from[i]} << (i % 8 * 8);
  }
}

void describe(std::uint32_t number, const image::Entry& entry, v1::PdoValue& to) {
  to.entry(number);
  to.index(entry.index);
  to.sub(entry.sub);
  to.data_type(static_cast<std::uint16_t>(entry.type));
  to.bit_length(entry.bit_length);
}

void values_from_wire(const std::vector<v1::PdoValue>& from, std::vector<PdoValue>& to) {
  to.resize(from.size());
  for (std::size_t i = 0; i < to.size(); ++i) {
    to[i].entry = from[i].entry();
    to[i].index = from[i].index();
    to[i].sub = from[i].sub();
    to[i].type = static_cast<od::DataType>(from[i].data_type());
    to[i].bit_length = from[i].bit_length();
    copy_bytes(from[i].data(), to[i].data);
  }
}

}  // namespace

std::uint16_t layout_parts(const image::Layout& layout) {
  const std::size_t parts = (layout.entries.size() + kMaxLayoutPart - 1) / kMaxLayoutPart;
  return static_cast<std::uint16_t>(std::max<std::size_t>(parts, 1));
}

void to_wire(const image::Layout& from, std::uint16_t part, v1::ImageLayout& to) {
  const std::size_t first = std::size_t{part} * kMaxLayoutPart;
  const std::size_t end = std::min(first + kMaxLayoutPart, from.entries.size());
  to.direction(static_cast<std::uint8_t>(from.direction));
  to.part(part);
  to.layout_id(from.id);
  to.parts(layout_parts(from));
  to.byte_size(from.byte_size);
  to.entry_count(static_cast<std::uint32_t>(from.entries.size()));
  to.first_entry(static_cast<std::uint32_t>(first));
  to.entries().resize(end - std::min(first, end));
  for (std::size_t i = 0; i < to.entries().size(); ++i) {
    const image::Entry& entry = from.entries[first + i];
    each_member(to.entries()[i], entry, [](auto& wire, const auto& stack) {
      wire = static_cast<std::remove_reference_t<decltype(wire)>>(stack);
    });
    meaning_to_wire(entry, to.entries()[i]);
  }
}

void from_wire(const v1::LayoutEntry& from, image::Entry& to) {
  each_member(from, to, [](const auto& wire, auto& stack) {
    stack = static_cast<std::remove_reference_t<decltype(stack)>>(wire);
  });
  to.name = from.name().to_string();
  to.scaling.unit = from.unit().to_string();
  for (const GivenNumber& number : kGivenNumbers) {
    to.*number.stack =
        (from.given() & number.bit) != 0 ? std::optional((from.*number.get)()) : std::nullopt;
  }
  to.inhibit = Duration(from.inhibit_ns());
  to.event_timer = Duration(from.event_timer_ns());
  to.group = from.group() >= 0 && from.group() <= 0xFFFF
                 ? std::optional(static_cast<std::uint16_t>(from.group()))
                 : std::nullopt;
}

bool is_plausible(const v1::LayoutEntry& entry) {
  return std::isfinite(entry.scale()) && std::abs(entry.scale()) > 0 &&
         std::isfinite(entry.offset()) && std::isfinite(entry.low()) &&
         std::isfinite(entry.high()) && std::isfinite(entry.initial()) &&
         entry.access() <= v1::OBJECT_CONST && entry.inhibit_ns() >= 0 &&
         entry.event_timer_ns() >= 0;
}

bool to_wire(const image::Snapshot& from, const ClockMap& clock, v1::ProcessImage& to) {
  constexpr std::size_t kMaxWords = kMaxEntries / 64;
  if (from.bytes.size() > image::kMaxAreaBytes || from.changed.size() > kMaxWords ||
      from.valid.size() > kMaxWords || from.known.size() > kMaxWords ||
      from.marks.size() > kMaxStamps) {
    return false;
  }
  to.direction(static_cast<std::uint8_t>(from.direction));
  to.layout_id(from.layout_id);
  to.sequence_number(from.sequence);
  to.time(clock.utc(from.acquired));
  to.clock(static_cast<std::uint8_t>(clock.quality));
  to.sync_count(from.sync_count);
  copy_bytes(from.bytes, to.bytes());
  words_to_octets(from.changed, to.changed());
  words_to_octets(from.valid, to.valid());
  if (from.direction == image::Direction::outputs) {
    words_to_octets(from.known, to.known());
  } else {
    to.known().clear();
  }
  to.pdos().resize(from.marks.size());
  for (std::size_t i = 0; i < from.marks.size(); ++i) {
    const image::PdoMark& mark = from.marks[i];
    v1::PdoStamp& stamp = to.pdos()[i];
    stamp.node(mark.node);
    stamp.remote_pdo(mark.remote_pdo);
    stamp.local_pdo(mark.local_pdo);
    stamp.first_entry(mark.first_entry);
    stamp.entries(mark.entries);
    stamp.frames(mark.count);
    stamp.time(clock.utc(mark.time));
  }
  return true;
}

bool from_wire(const v1::ProcessImage& from, const ClockMap& clock, image::Snapshot& to) {
  if (from.direction() > v1::DIRECTION_OUTPUTS || from.bytes().size() > image::kMaxAreaBytes ||
      from.changed().size() != from.valid().size() || from.valid().size() > kMaxEntries / 8 ||
      from.pdos().size() > kMaxStamps ||
      (!from.known().empty() && from.known().size() != from.valid().size())) {
    return false;
  }
  to.direction = static_cast<image::Direction>(from.direction());
  to.layout_id = from.layout_id();
  to.sequence = from.sequence_number();
  to.generation = 0;
  to.acquired = clock.instant(from.time());
  to.sync_count = from.sync_count();
  copy_bytes(from.bytes(), to.bytes);
  octets_to_words(from.changed(), to.changed);
  octets_to_words(from.valid(), to.valid);
  octets_to_words(from.known(), to.known);
  to.known.resize(to.valid.size());
  to.marks.resize(from.pdos().size());
  for (std::size_t i = 0; i < to.marks.size(); ++i) {
    const v1::PdoStamp& stamp = from.pdos()[i];
    to.marks[i] = {stamp.local_pdo(),           stamp.remote_pdo(),  stamp.node(),   stamp.frames(),
                   clock.instant(stamp.time()), stamp.first_entry(), stamp.entries()};
  }
  return true;
}

void extract_bits(std::span<const std::byte> area, std::uint32_t offset, std::uint16_t bits,
                  std::vector<std::uint8_t>& to) {
  to.assign((bits + 7U) / 8U, 0);
  for (std::uint32_t i = 0; i < bits; ++i) {
    const std::uint32_t from = offset + i;
    const auto bit = std::to_integer<unsigned>(area[from / 8] >> (from % 8)) & 1U;
    to[i / 8] = static_cast<std::uint8_t>(to[i / 8] | bit << (i % 8));
  }
}

bool to_wire(const image::Layout& layout, const image::Snapshot& snapshot,
             const image::PdoMark& mark, std::uint32_t receptions, const ClockMap& clock,
             v1::PdoUpdate& to) {
  if (mark.entries > kMaxPdoValues || mark.first_entry > layout.entries.size() ||
      mark.entries > layout.entries.size() - mark.first_entry || snapshot.layout_id != layout.id) {
    return false;
  }
  to.node(mark.node);
  to.pdo(mark.remote_pdo);
  to.time(clock.utc(mark.time));
  to.clock(static_cast<std::uint8_t>(clock.quality));
  to.receptions(receptions);
  to.values().resize(mark.entries);
  for (std::uint32_t i = 0; i < mark.entries; ++i) {
    const image::Entry& entry = layout.entries[mark.first_entry + i];
    const std::size_t end = std::size_t{entry.bit_offset} + entry.bit_length;
    if (end > snapshot.bytes.size() * 8 || entry.bit_length > 512)
      return false;
    describe(mark.first_entry + i, entry, to.values()[i]);
    extract_bits(snapshot.bytes, entry.bit_offset, entry.bit_length, to.values()[i].data());
  }
  return true;
}

bool to_wire(const image::Layout& layout, const pdo::Reception& reception, const ClockMap& clock,
             v1::PdoReception& to) {
  if (reception.layout_id != layout.id || reception.entries > kMaxPdoValues ||
      reception.first_entry > layout.entries.size() ||
      reception.entries > layout.entries.size() - reception.first_entry) {
    return false;
  }
  to.time(clock.utc(reception.time));
  to.clock(static_cast<std::uint8_t>(clock.quality));
  to.node(reception.node);
  to.pdo(reception.remote_pdo);
  to.lost(reception.lost);
  to.values().resize(reception.entries);
  std::uint32_t bit = 0;
  for (std::uint32_t i = 0; i < reception.entries; ++i) {
    const image::Entry& entry = layout.entries[reception.first_entry + i];
    if (bit + entry.bit_length > 8 * reception.values.size())
      return false;
    describe(reception.first_entry + i, entry, to.values()[i]);
    extract_bits(reception.values, bit, entry.bit_length, to.values()[i].data());
    bit += entry.bit_length;
  }
  return true;
}

void from_wire(const v1::PdoUpdate& from, const ClockMap& clock, PdoUpdate& to) {
  to.node = from.node();
  to.pdo = from.pdo();
  to.time = clock.instant(from.time());
  to.receptions = from.receptions();
  values_from_wire(from.values(), to.values);
}

void from_wire(const v1::PdoReception& from, const ClockMap& clock, PdoReception& to) {
  to.node = from.node();
  to.pdo = from.pdo();
  to.time = clock.instant(from.time());
  to.number = from.number();
  to.lost = from.lost();
  values_from_wire(from.values(), to.values);
}

}  // namespace linegate::dds

// SPDX-License-Identifier: Apache-2.0
#include "bridges/named/type_parts.h"

#include <algorithm>
#include <bit>

#include "bridges/named/identifiers.h"
#include "stack/base/utf8.h"

namespace linegate::named {
namespace {

using od::DataType;

// The smallest integer with so many bits; precondition: at most 64.
Form unsigned_form(unsigned bits) {
  return bits <= 8    ? Form::uint8
         : bits <= 16 ? Form::uint16
         : bits <= 32 ? Form::uint32
                      : Form::uint64;
}
Form signed_form(unsigned bits) {
  return bits <= 8 ? Form::int8 : bits <= 16 ? Form::int16 : bits <= 32 ? Form::int32 : Form::int64;
}

bool has_octets(DataType type) {
  return od::is_string(type) || type == DataType::domain;
}

void choose_text(const image::Entry& entry, Member& to) {
  const unsigned octets = entry.bit_length / 8U;
  const bool is_wide = entry.type == DataType::unicode_string;
  to.form = Form::text;
  to.reading = is_wide ? Reading::utf16 : Reading::characters;
  // A unit of UTF-16 has at most 3 octets in UTF-8, an octet of Latin-1 at most 2.
  to.length = static_cast<std::uint16_t>(is_wide ? octets / 2 * 3 : octets * 2);
}

// A PDO may map fewer or more bits than the type of the object has.
void choose_form(const image::Entry& entry, Member& to) {
  const unsigned bits = entry.bit_length;
  const unsigned size = od::bit_size(entry.type);
  const bool fits = bits <= size;
  if (entry.type == DataType::boolean && bits == 1) {
    to.form = Form::boolean;
  } else if (od::is_signed(entry.type) && fits) {
    to.form = signed_form(size);
    to.reading = Reading::signed_bits;
  } else if (od::is_integer(entry.type) && fits) {
    to.form = unsigned_form(size);
  } else if (od::is_real(entry.type) && bits == size) {
    to.form = size == 32 ? Form::float32 : Form::float64;
  } else if (entry.type == DataType::time_of_day && bits == size) {
    to.form = Form::int64;
    to.reading = Reading::time_of_day;
  } else if (entry.type == DataType::time_difference && bits == size) {
    to.form = Form::int64;
    to.reading = Reading::duration;
  } else if ((entry.type == DataType::visible_string && bits % 8 == 0) ||
             (entry.type == DataType::unicode_string && bits % 16 == 0)) {
    choose_text(entry, to);
  } else if (bits <= 64 && !has_octets(entry.type)) {
    to.form = unsigned_form(bits);
  } else {
    to.form = Form::octets;
    to.length = static_cast<std::uint16_t>((bits + 7U) / 8U);
  }
}

}  // namespace

void TypeHash::add(std::string_view text) {
  for (const char c : text) {
    add_octet(static_cast<std::uint8_t>(c));
  }
  add_octet(0);
}

void TypeHash::add(std::uint64_t number) {
  add(std::string_view(std::to_string(number)));
}

void TypeHash::add(const Member& member) {
  add(std::string_view(member.identifier));
  add(static_cast<std::uint64_t>(member.form));
  add(static_cast<std::uint64_t>(member.reading));
  add(member.length);
  add(member.bit_length);
  add(member.pdo);
  add(member.object.index);
  add(member.object.sub);
  add(static_cast<std::uint64_t>(member.type));
  // A reader that has another scale must not match. Limits do not change the meaning of a value.
  if (member.scaling.is_scaled() || !member.scaling.unit.empty()) {
    add(std::string_view(member.scaling.unit));
    add(std::bit_cast<std::uint64_t>(member.scaling.scale));
    add(std::bit_cast<std::uint64_t>(member.scaling.offset));
  }
}

std::string TypeHash::digits() const {
  constexpr std::string_view kDigits = "0123456789abcdef";
  std::string out;
  for (unsigned shift = 64; shift > 0; shift -= 4) {
    out += kDigits[value_ >> (shift - 4) & 0xFU];
  }
  return out;
}

// Names of nodes have no full stop.
NameParts parts_of(const image::Entry& entry) {
  const std::string_view name = entry.name;
  const std::size_t dot = std::min(name.find('.'), name.size());
  return {name.substr(0, dot), name.substr(std::min(dot + 1, name.size()))};
}

std::string object_identifier(const image::Layout& layout, const image::Entry& entry,
                              std::span<const Alias> aliases) {
  const auto alias = std::ranges::find_if(aliases, [&](const Alias& one) {
    return one.direction == layout.direction && one.entry == entry.name;
  });
  return alias == aliases.end() ? identifier_of(parts_of(entry).object) : alias->identifier;
}

Member member_of(const image::Layout& layout, std::uint32_t number) {
  const image::Entry& entry = layout.entries[number];
  Member member{.identifier = {},
                .entry = number,
                .bit_offset = entry.bit_offset,
                .bit_length = entry.bit_length,
                .pdo = entry.remote_pdo,
                .object = {entry.index, entry.sub},
                .type = entry.type,
                .object_name = std::string(parts_of(entry).object),
                .scaling = entry.scaling,
                .low = entry.low,
                .high = entry.high};
  choose_form(entry, member);
  return member;
}

std::string name_part(std::string_view name) {
  const std::string identifier = identifier_of(name);
  if (identifier.empty()) {
    return "n";
  }
  return identifier.ends_with('_') ? identifier.substr(0, identifier.size() - 1) : identifier;
}

std::string printable(std::string_view text) {
  std::string out;
  while (!text.empty()) {
    const std::string_view rest = text;
    const auto code = take_code_point(text);
    if (!code) {
      text.remove_prefix(1);
    }
    const bool control = code && (*code < 0x20 || (*code >= 0x7F && *code < 0xA0));
    out += code && !control ? rest.substr(0, rest.size() - text.size()) : std::string_view("?");
  }
  return out;
}

}  // namespace linegate::named

// SPDX-License-Identifier: Apache-2.0
#include "bridges/named/device_types.h"

#include <algorithm>
#include <map>
#include <utility>

#include "bridges/named/identifiers.h"

namespace linegate::named {
namespace {

using od::DataType;

// The version of the fixed members, and of the readings: part of the hash.
constexpr std::string_view kScheme = "1";

// FNV-1a. Includes the end of each text, so that "a", "b" differs from "ab", "".
class Hash {
 public:
  void add(std::string_view text) {
    for (const char c : text) {
      add_octet(static_cast<std::uint8_t>(c));
    }
    add_octet(0);
  }
  void add(std::uint64_t number) { add(std::to_string(number)); }
  std::string digits() const {
    constexpr std::string_view kDigits = "0123456789abcdef";
    std::string out;
    for (unsigned shift = 64; shift > 0; shift -= 4) {
      out += kDigits[value_ >> (shift - 4) & 0xFU];
    }
    return out;
  }

 private:
  void add_octet(std::uint8_t octet) { value_ = (value_ ^ octet) * 0x100000001B3U; }

  std::uint64_t value_ = 0xCBF29CE484222325U;
};

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

// For messages.
std::string printable(std::string_view text) {
  std::string out(text);
  std::ranges::replace_if(
      out, [](char c) { return c < ' ' || c > '~'; }, '?');
  return out;
}

struct NameParts {
  std::string_view device;
  std::string_view object;
};

// Names of nodes have no full stop.
NameParts parts_of(const image::Entry& entry) {
  const std::string_view name = entry.name;
  const std::size_t dot = std::min(name.find('.'), name.size());
  return {name.substr(0, dot), name.substr(std::min(dot + 1, name.size()))};
}

class Maker {
 public:
  Maker(std::string_view line, const image::Layout& layout, std::span<const Alias> aliases)
      : line_(line), layout_(layout), aliases_(aliases) {}

  DeviceTypes run() {
    for (std::uint32_t i = 0; i < layout_.entries.size(); ++i) {
      add(i);
    }
    DeviceTypes out{.types = {}, .collisions = std::move(collisions_)};
    for (Draft& draft : drafts_) {
      if (!draft.collides) {
        finish(draft.type);
        out.types.push_back(std::move(draft.type));
      }
    }
    return out;
  }

 private:
  struct Draft {
    DeviceType type;
    Identifiers scope;
    bool collides = false;
  };

  Draft& draft_of(std::string_view device, std::uint8_t node) {
    const auto [known, is_new] = places_.try_emplace(std::string(device), drafts_.size());
    if (is_new) {
      drafts_.emplace_back();
      DeviceType& type = drafts_.back().type;
      type.line = line_;
      type.device = device;
      type.direction = layout_.direction;
      type.node = node;
    }
    return drafts_[known->second];
  }

  std::string identifier_for(const image::Entry& entry, std::string_view object) const {
    const auto alias = std::ranges::find_if(aliases_, [&](const Alias& one) {
      return one.direction == layout_.direction && one.entry == entry.name;
    });
    return alias == aliases_.end() ? identifier_of(object) : alias->identifier;
  }

  void add(std::uint32_t number) {
    const image::Entry& entry = layout_.entries[number];
    const NameParts parts = parts_of(entry);
    Draft& draft = draft_of(parts.device, entry.node);
    Member member{.identifier = identifier_for(entry, parts.object),
                  .entry = number,
                  .bit_offset = entry.bit_offset,
                  .bit_length = entry.bit_length,
                  .pdo = entry.remote_pdo,
                  .object = {entry.index, entry.sub},
                  .type = entry.type,
                  .object_name = std::string(parts.object)};
    choose_form(entry, member);
    if (const std::string why = complaint_about(draft, entry, member); !why.empty()) {
      collisions_.push_back(why);
      draft.collides = true;
      return;
    }
    draft.type.members.push_back(std::move(member));
  }

  std::string complaint_about(Draft& draft, const image::Entry& entry, const Member& member) const {
    const std::string name = printable(entry.name);
    const std::string of = std::string(image::name(layout_.direction)) + " of line " + line_ + ": ";
    if (entry.node != draft.type.node) {
      return of + "\"" + name + "\" is of node " + std::to_string(entry.node) + ", and node " +
             std::to_string(draft.type.node) + " has the name " + draft.type.device +
             ", too: give it another name";
    }
    if (!is_identifier(member.identifier)) {
      return of + "\"" + name + "\" makes no identifier: give it an alias";
    }
    const auto other = draft.scope.add(member.identifier, entry.name);
    return other ? of + "\"" + name + "\" and \"" + printable(*other) +
                       "\" make the same identifier " + member.identifier +
                       ": give one of them an alias"
                 : std::string();
  }

  static void finish(DeviceType& type) {
    for (const Member& member : type.members) {
      const auto place = std::ranges::lower_bound(type.pdos, member.pdo);
      if (member.pdo != 0 && (place == type.pdos.end() || *place != member.pdo)) {
        type.pdos.insert(place, member.pdo);
      }
    }
    Hash hash;
    hash.add(kScheme);
    hash.add(type.line);
    hash.add(type.device);
    hash.add(image::name(type.direction));
    for (const Member& member : type.members) {
      hash.add(member.identifier);
      hash.add(static_cast<std::uint64_t>(member.form));
      hash.add(static_cast<std::uint64_t>(member.reading));
      hash.add(member.length);
      hash.add(member.bit_length);
      hash.add(member.pdo);
      hash.add(member.object.index);
      hash.add(member.object.sub);
      hash.add(static_cast<std::uint64_t>(member.type));
    }
    type.name = name_part(type.line) + '_' + name_part(type.device) + '_' +
                std::string(image::name(type.direction)) + '_' + hash.digits();
  }

  // Of a name in plant.yaml: letters, digits, '-' and '_'.
  static std::string name_part(std::string_view name) {
    const std::string identifier = identifier_of(name);
    if (identifier.empty()) {
      return "n";
    }
    return identifier.ends_with('_') ? identifier.substr(0, identifier.size() - 1) : identifier;
  }

  std::string line_;
  const image::Layout& layout_;
  std::span<const Alias> aliases_;
  std::vector<Draft> drafts_;
  std::map<std::string, std::size_t> places_;  // of the draft of each device
  std::vector<std::string> collisions_;
};

}  // namespace

std::string DeviceType::type_name() const {
  return std::string(kModule) + "::" + name;
}

std::string DeviceType::topic() const {
  return std::string(kModule) + '/' + line + '/' + device + '/' +
         std::string(image::name(direction));
}

DeviceTypes device_types(std::string_view line, const image::Layout& layout,
                         std::span<const Alias> aliases) {
  return Maker(line, layout, aliases).run();
}

}  // namespace linegate::named

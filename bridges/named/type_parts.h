// SPDX-License-Identifier: Apache-2.0
// What the types of devices and of output groups have in common. Internal to this folder.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "bridges/named/device_types.h"
#include "stack/image/layout.h"

namespace linegate::named {

// FNV-1a. Includes the end of each text, so that "a", "b" differs from "ab", "".
class TypeHash {
 public:
  void add(std::string_view text);
  void add(std::uint64_t number);
  // Everything that a program must know to interpret the member.
  void add(const Member& member);
  // 16 hexadecimal digits.
  std::string digits() const;

 private:
  void add_octet(std::uint8_t octet) { value_ = (value_ ^ octet) * 0x100000001B3U; }

  std::uint64_t value_ = 0xCBF29CE484222325U;
};

// The name of an entry: that of its device, a full stop, and that of its object.
struct NameParts {
  std::string_view device;
  std::string_view object;
};
NameParts parts_of(const image::Entry& entry);

// The identifier of the object of an entry: that of its alias, or made from its name.
std::string object_identifier(const image::Layout& layout, const image::Entry& entry,
                              std::span<const Alias> aliases);

// The member of an entry, with the name of its object, and without an identifier.
Member member_of(const image::Layout& layout, std::uint32_t number);

// Of a name in plant.yaml (letters, digits, '-' and '_'): a part of the name of a type.
std::string name_part(std::string_view name);

// For messages: UTF-8, with a question mark for each control character (C0, C1, DEL) and each octet
// that is not well-formed.
std::string printable(std::string_view text);

}  // namespace linegate::named

// SPDX-License-Identifier: Apache-2.0
// Text forms of values by CiA 301 data type.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "stack/image/layout.h"
#include "stack/od/data_type.h"

namespace linegate::console {

// "0A3F": hexadecimal, with at least `digits` digits, up to 8.
std::string hex_digits(std::uint32_t value, int digits);

// "4660", "-3", "1.5", "true", "\"text\"", "12 34 AB" (bytes in transmission order). Reals have the
// fewest digits with which from_text() gives the same value. Values whose length does not fit the
// type are printed as bytes.
std::string to_text(od::DataType type, std::span<const std::byte> value);

// The numeric value: integers, finite reals, booleans as 0 and 1. Nothing for other types.
std::optional<double> to_number(od::DataType type, std::span<const std::byte> value);

// The value of an entry as people read it: in its unit, if it is scaled, without the unit itself.
std::string to_text(const image::Entry& entry, std::span<const std::byte> value);
std::optional<double> to_number(const image::Entry& entry, std::span<const std::byte> value);
// The unit of an entry, or the one that its name ends with; empty if it is unknown.
std::string unit_of(const image::Entry& entry);
// to_text(), with the unit that its name does not end with.
std::string text_with_unit(const image::Entry& entry, std::span<const std::byte> value);

// The value of an entry that a person typed: in its unit and within its limits, or the value in the
// PDO itself (raw), without limits.
struct TypedValue {
  std::vector<std::byte> data;
  std::string error;  // a sentence, with the text in its printable form; empty: data is the value
};
TypedValue typed_value(const image::Entry& entry, std::string_view text, bool raw);

// The bytes alone: "12 34 AB".
std::string to_hex(std::span<const std::byte> value);

// Parses a value into little-endian bytes: decimal, 0x.., true, false, text for VISIBLE_STRING,
// hexadecimal bytes for all other types, with the size of the type for times. Nothing if the text
// does not fit the type.
std::optional<std::vector<std::byte>> from_text(od::DataType type, std::string_view text);

// Parses the short names of CiA 309-3 (b, u8..u64, i8..i64, r32, r64, t, td, vs, os, us, d) and the
// long names of CiA 301, in any case. Nothing for other names.
std::optional<od::DataType> type_from_name(std::string_view name);

}  // namespace linegate::console

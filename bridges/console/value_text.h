// SPDX-License-Identifier: Apache-2.0
// Values as people write and read them, by CiA 301 data type.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "stack/od/data_type.h"

namespace linegate::console {

// "0A3F": hexadecimal, with at least that many of 8 digits.
std::string hex_digits(std::uint32_t value, int digits);

// "4660", "-3", "1.5", "true", "\"text\"", "12 34 AB" (bytes in the order of the bus). Values whose
// length does not fit the type are shown as bytes.
std::string to_text(od::DataType type, std::span<const std::byte> value);

// The number that a value is: integers, reals that are finite, booleans as 0 and 1. Nothing for all
// others.
std::optional<double> to_number(od::DataType type, std::span<const std::byte> value);

// The bytes alone: "12 34 AB".
std::string to_hex(std::span<const std::byte> value);

// The value as bytes, little-endian: decimal, 0x.., true, false, text for VISIBLE_STRING,
// hexadecimal bytes for all others: as many as a time has. Nothing if the text does not fit the
// type.
std::optional<std::vector<std::byte>> from_text(od::DataType type, std::string_view text);

// The short names of CiA 309-3 (b, u8..u64, i8..i64, r32, r64, t, td, vs, os, us, d) and CiA 301's
// long ones, any case. Nothing for others.
std::optional<od::DataType> type_from_name(std::string_view name);

}  // namespace linegate::console

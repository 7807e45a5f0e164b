// SPDX-License-Identifier: Apache-2.0
// An object as text: "6200:0A", index and sub-index hexadecimal with four and two digits, as CiA
// documents write them. What one command prints, all others read.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "stack/od/description.h"

namespace linegate::od {

// "6200:0A".
std::string to_text(Address address);

// "6200:0A", "6200:A", "0x6200:0x0A"; "6200" is sub-index 0. Upper or lower case. Nothing if the
// text is anything else, or a number is out of range.
std::optional<Address> parse_address(std::string_view text);

// The two parts, where they are given one by one.
std::optional<std::uint16_t> parse_index(std::string_view text);
std::optional<std::uint8_t> parse_sub(std::string_view text);

}  // namespace linegate::od

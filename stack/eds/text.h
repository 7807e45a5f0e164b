// SPDX-License-Identifier: Apache-2.0
// Small tools for text of device files. "Blank" is a space or a control
// character other than a line end; case is that of ASCII.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace linegate::eds {

std::string_view trim(std::string_view text);
std::string lower(std::string_view text);
// In lower case and without any blanks: what names of sections are compared by.
std::string comparable(std::string_view text);
bool equal_ignoring_case(std::string_view a, std::string_view b);

// The text before a ';', trimmed: some files comment behind numbers.
std::string_view without_comment(std::string_view text);

// For messages: 'text', shortened to 40 characters, with '?' for what cannot be printed.
std::string quote(std::string_view text);

// Upper-case hexadecimal with at least `digits` digits and CiA's suffix: hex(0x12, 4) is "0012h".
std::string hex(std::uint64_t value, unsigned digits);

bool is_utf8(std::string_view text);
// Where the first character is that is not UTF-8; the size of the text if all of it is.
std::size_t first_not_utf8(std::string_view text);
// UTF-8 as it is, anything else read as Latin-1.
std::string to_utf8(std::string_view text);
// Little-endian UTF-16 of the same.
std::vector<std::byte> to_utf16(std::string_view text);
// UTF-8 of little-endian UTF-16; '?' for halves of pairs, and half a character at the end is lost.
std::string from_utf16(std::span<const std::byte> text);

}  // namespace linegate::eds

// SPDX-License-Identifier: Apache-2.0
// Functions for the text of device files. A "blank" is a space or a control character other than a
// line end; case is that of ASCII.
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
// The text in lower case and without blanks, for comparing section names.
std::string comparable(std::string_view text);
bool equal_ignoring_case(std::string_view a, std::string_view b);

// The text before a ';', trimmed: some files have comments after numbers.
std::string_view without_comment(std::string_view text);

// For messages: 'text', shortened to 40 characters, with '?' for unprintable characters.
std::string quote(std::string_view text);

// Upper-case hexadecimal with at least `digits` digits and CiA's suffix: hex(0x12, 4) is "0012h".
std::string hex(std::uint64_t value, unsigned digits);

bool is_utf8(std::string_view text);
// Position of the first character that is not valid UTF-8; the size of the text if all of it is
// valid.
std::size_t first_not_utf8(std::string_view text);
// Valid UTF-8 is returned unchanged, anything else is read as Latin-1.
std::string to_utf8(std::string_view text);
// The same as little-endian UTF-16.
std::vector<std::byte> to_utf16(std::string_view text);
// Converts little-endian UTF-16 to UTF-8; '?' for unpaired surrogates; half a character at the end
// is dropped.
std::string from_utf16(std::span<const std::byte> text);

}  // namespace linegate::eds

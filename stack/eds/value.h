// SPDX-License-Identifier: Apache-2.0
// Parses and formats numbers and values (DefaultValue, LowLimit, ParameterValue ...) in the
// notation of CiA 306; private to stack/eds except for the node list.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "stack/od/data_type.h"

namespace linegate::eds {

// A number: decimal, 0x hexadecimal, octal with a leading 0, or a sum with $NODEID.
struct Number {
  std::string problem;  // error message; empty if it is a number
  std::string remark;   // warning about a valid number with a questionable notation; empty if none
  std::uint64_t magnitude = 0;
  bool negative = false;
  bool hexadecimal = false;
  bool uses_node_id = false;

  bool ok() const { return problem.empty(); }
};

// Parses a number without a formula: an optional sign, then at most 64 bits. Decimal numbers are
// often padded with zeros: 008 cannot be octal and is read as decimal, 001 is read as octal; both
// have a remark.
Number parse_number(std::string_view text);

// A number, or terms joined by '+' of which at least one is $NODEID ("$NODEID+0x180").
Number parse_formula(std::string_view text, std::uint8_t node_id);

// A value as the bytes of its data type.
struct Value {
  std::string problem;           // error message; empty if the text is a valid value
  std::string remark;            // warning about a valid value with a questionable notation
  std::vector<std::byte> bytes;  // little-endian, in the size of the type
  bool uses_node_id = false;
};

// Integers: numbers and formulas; hexadecimal digits of a signed type may be its bit pattern.
// BOOLEAN: also true and false. REALn: decimal, or 0x and the bit pattern. VISIBLE_STRING: the text
// unchanged. UNICODE_STRING: the text in UTF-16. OCTET_STRING, DOMAIN and unknown types: pairs of
// hexadecimal digits, optionally separated by blanks. Times: 48 bits as a number.
Value parse_value(od::DataType type, std::string_view text, std::uint8_t node_id);

// value: in the size of the type. formula: the value is the node-ID plus an offset, and is written
// as $NODEID+offset. parse_value() of the text returns the same bytes, except for characters of a
// VISIBLE_STRING that a file cannot hold: control characters become '?', blanks at its ends are
// dropped.
std::string format_value(od::DataType type, std::span<const std::byte> value, bool formula = false,
                         std::uint8_t node_id = 0);

// "0x" and at least `digits` upper-case digits.
std::string format_hex(std::uint64_t value, unsigned digits = 1);

// Converts the text to one line: control characters become '?', blanks at the ends are removed.
std::string one_line(std::string_view text);

}  // namespace linegate::eds

// SPDX-License-Identifier: Apache-2.0
// Numbers and values (DefaultValue, LowLimit, ParameterValue ...) as CiA 306 writes them, read and
// written; private to stack/eds but for the node list.
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
  std::string problem;  // in words; empty if it is a number
  std::string remark;   // what is odd about a number that is one; empty if nothing
  std::uint64_t magnitude = 0;
  bool negative = false;
  bool hexadecimal = false;
  bool uses_node_id = false;

  bool ok() const { return problem.empty(); }
};

// A number alone. An optional sign, then at most 64 bits. Decimal numbers are often filled up with
// zeros: 008 is no octal number and read as decimal, with a remark; so is 001, which is both.
Number parse_number(std::string_view text);

// A number, or terms joined by '+' of which at least one is $NODEID ("$NODEID+0x180").
Number parse_formula(std::string_view text, std::uint8_t node_id);

// A value as the bytes of its data type.
struct Value {
  std::string problem;           // in words; empty if the text is such a value
  std::string remark;            // what is odd about it all the same
  std::vector<std::byte> bytes;  // little-endian, as many as the type has
  bool uses_node_id = false;
};

// Integers: numbers and formulas; hexadecimal digits of a signed type may be its bit pattern.
// BOOLEAN also true and false. REALn: decimal, or 0x and the bit pattern. VISIBLE_STRING: the text
// as it is. UNICODE_STRING: the text in UTF-16. OCTET_STRING, DOMAIN and types that are not known:
// pairs of hexadecimal digits, blanks between them. Times: 48 bits as a number.
Value parse_value(od::DataType type, std::string_view text, std::uint8_t node_id);

// value: as many bytes as the type has. formula: the value is the node-ID and something, written as
// $NODEID+something. parse_value() of the text gives the same bytes, but for characters of a
// VISIBLE_STRING that a file cannot hold: control characters become '?', blanks at its ends are
// lost.
std::string format_value(od::DataType type, std::span<const std::byte> value, bool formula = false,
                         std::uint8_t node_id = 0);

// "0x" and upper-case digits, at least so many.
std::string format_hex(std::uint64_t value, unsigned digits = 1);

// One line: control characters become '?', blanks at the ends are taken away.
std::string one_line(std::string_view text);

}  // namespace linegate::eds

// SPDX-License-Identifier: Apache-2.0
// Numbers as CiA 306 writes them: decimal, 0x hexadecimal, octal with a leading 0, and sums with
// $NODEID; private to stack/eds.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace linegate::eds {

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

}  // namespace linegate::eds

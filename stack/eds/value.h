// SPDX-License-Identifier: Apache-2.0
// A value of an EDS (DefaultValue, LowLimit, ParameterValue ...) as the bytes of its data type;
// private to stack/eds.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "stack/od/data_type.h"

namespace linegate::eds {

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

}  // namespace linegate::eds

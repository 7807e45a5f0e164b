// SPDX-License-Identifier: Apache-2.0
// Values as CiA 306 writes them: the other way round of value.h.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "stack/od/data_type.h"

namespace linegate::eds {

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

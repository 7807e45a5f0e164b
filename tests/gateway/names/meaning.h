// SPDX-License-Identifier: Apache-2.0
// What the bits of a value mean by CiA 301, as text: "true", "-5", "3FF8000000000000" (bits of a
// double, "nan" for each one that is no number), "'Press" (a text), "x01FF" (octets). The decoders
// of the product are not used; widths and signs are those of stack/od.
#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "stack/od/data_type.h"

namespace linegate::names {

std::string meaning(od::DataType type, unsigned bits, std::uint64_t raw);

std::string text_of(double value);
std::string hex(std::span<const std::uint8_t> octets);

}  // namespace linegate::names

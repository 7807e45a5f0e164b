// SPDX-License-Identifier: Apache-2.0
// What the bits of a value mean by CiA 301, as text: "true", "-5", "3FF8000000000000" (bits of a
// double, "nan" for each one that is no number), "'Press" (a text), "x01FF" (octets). Written
// from CiA 301 (7.4.7.1, table 44): of stack/od only the names of the types are used.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>

#include "stack/od/data_type.h"

namespace linegate::names {

enum class Number : std::uint8_t { none, plain, negative_too, real };

// A type of CiA 301.
struct CiaType {
  od::DataType type = od::DataType::none;
  unsigned bits = 0;  // 0: any number of `unit`, up to 64 in a PDO
  unsigned unit = 1;
  Number number = Number::none;
};

inline constexpr std::array kCiaTypes{
    CiaType{od::DataType::boolean, 1},
    CiaType{od::DataType::integer8, 8, 1, Number::negative_too},
    CiaType{od::DataType::integer16, 16, 1, Number::negative_too},
    CiaType{od::DataType::integer24, 24, 1, Number::negative_too},
    CiaType{od::DataType::integer32, 32, 1, Number::negative_too},
    CiaType{od::DataType::integer40, 40, 1, Number::negative_too},
    CiaType{od::DataType::integer48, 48, 1, Number::negative_too},
    CiaType{od::DataType::integer56, 56, 1, Number::negative_too},
    CiaType{od::DataType::integer64, 64, 1, Number::negative_too},
    CiaType{od::DataType::unsigned8, 8, 1, Number::plain},
    CiaType{od::DataType::unsigned16, 16, 1, Number::plain},
    CiaType{od::DataType::unsigned24, 24, 1, Number::plain},
    CiaType{od::DataType::unsigned32, 32, 1, Number::plain},
    CiaType{od::DataType::unsigned40, 40, 1, Number::plain},
    CiaType{od::DataType::unsigned48, 48, 1, Number::plain},
    CiaType{od::DataType::unsigned56, 56, 1, Number::plain},
    CiaType{od::DataType::unsigned64, 64, 1, Number::plain},
    CiaType{od::DataType::real32, 32, 1, Number::real},
    CiaType{od::DataType::real64, 64, 1, Number::real},
    CiaType{od::DataType::visible_string, 0, 8},
    CiaType{od::DataType::octet_string, 0, 1},  // CiA 301 has octets; devices map bits of one too
    CiaType{od::DataType::unicode_string, 0, 16},
    CiaType{od::DataType::domain, 0, 1},
    CiaType{od::DataType::time_of_day, 48},
    CiaType{od::DataType::time_difference, 48}};

const CiaType& cia_type(od::DataType type);

std::string meaning(od::DataType type, unsigned bits, std::uint64_t raw);

std::string text_of(double value);
std::string hex(std::span<const std::uint8_t> octets);

}  // namespace linegate::names

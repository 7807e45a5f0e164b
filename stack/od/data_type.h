// SPDX-License-Identifier: Apache-2.0
// CANopen data types (CiA 301, 7.1.6 and 7.4.1), by their code in the object dictionary.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

#include "stack/base/abort_code.h"

namespace linegate::od {

enum class DataType : std::uint16_t {
  none = 0x00,
  boolean = 0x01,
  integer8 = 0x02,
  integer16 = 0x03,
  integer32 = 0x04,
  unsigned8 = 0x05,
  unsigned16 = 0x06,
  unsigned32 = 0x07,
  real32 = 0x08,
  visible_string = 0x09,
  octet_string = 0x0A,
  unicode_string = 0x0B,
  time_of_day = 0x0C,
  time_difference = 0x0D,
  domain = 0x0F,
  integer24 = 0x10,
  real64 = 0x11,
  integer40 = 0x12,
  integer48 = 0x13,
  integer56 = 0x14,
  integer64 = 0x15,
  unsigned24 = 0x16,
  unsigned40 = 0x18,
  unsigned48 = 0x19,
  unsigned56 = 0x1A,
  unsigned64 = 0x1B,
};

// Size of a value in a PDO, in bits; 1 for BOOLEAN; 0 for types of variable length and unknown
// codes.
unsigned bit_size(DataType type);
// Size of a value in an SDO, in bytes; 1 for BOOLEAN; 0 for types of variable length and unknown
// codes.
unsigned byte_size(DataType type);
// Whether byte_size() is not 0.
constexpr bool has_fixed_size(DataType type) {
  constexpr std::uint32_t kFixed = 0x0F7F'31FE;  // by code
  const auto code = static_cast<unsigned>(type);
  return code < 32 && (kFixed >> code & 1U) != 0;
}

bool is_signed(DataType type);   // INTEGERn
bool is_integer(DataType type);  // INTEGERn, UNSIGNEDn and BOOLEAN
bool is_real(DataType type);
bool is_string(DataType type);  // VISIBLE_STRING, OCTET_STRING, UNICODE_STRING

// CiA's name, e.g. "UNSIGNED16"; "unknown" for other codes.
std::string_view name(DataType type);

// Compares a value with the LowLimit and HighLimit of its object (CiA 306; CiA 301 abort codes 0609
// 0031h, 0609 0032h and 0609 0036h). All three are little-endian; an empty limit means no limit,
// and types without an order (strings, DOMAIN, times) are not limited. value has byte_size(type)
// bytes. Returns none, value_too_low, value_too_high, max_less_than_min if the limits exclude every
// value, or invalid_value for a real that is not a number if there is a limit.
AbortCode check_limits(DataType type, std::span<const std::byte> value,
                       std::span<const std::byte> low, std::span<const std::byte> high);

}  // namespace linegate::od

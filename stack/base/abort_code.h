// SPDX-License-Identifier: Apache-2.0
// SDO abort codes of CiA 301, 7.2.4.3.17. The object dictionary uses the same codes: an access that
// is refused returns the reason as an abort code.
#pragma once

#include <cstdint>
#include <string_view>

#include "stack/base/result.h"

namespace linegate {

enum class AbortCode : std::uint32_t {
  none = 0,
  toggle_bit = 0x0503'0000,
  timeout = 0x0504'0000,
  command_specifier = 0x0504'0001,
  block_size = 0x0504'0002,
  sequence_number = 0x0504'0003,
  crc = 0x0504'0004,
  out_of_memory = 0x0504'0005,
  unsupported_access = 0x0601'0000,
  write_only = 0x0601'0001,
  read_only = 0x0601'0002,
  no_object = 0x0602'0000,
  not_mappable = 0x0604'0041,
  pdo_length_exceeded = 0x0604'0042,
  parameter_incompatible = 0x0604'0043,
  device_incompatible = 0x0604'0047,
  hardware = 0x0606'0000,
  length_mismatch = 0x0607'0010,
  length_too_high = 0x0607'0012,
  length_too_low = 0x0607'0013,
  no_sub_index = 0x0609'0011,
  invalid_value = 0x0609'0030,
  value_too_high = 0x0609'0031,
  value_too_low = 0x0609'0032,
  max_less_than_min = 0x0609'0036,
  sdo_connection = 0x060A'0023,
  general = 0x0800'0000,
  cannot_transfer = 0x0800'0020,
  local_control = 0x0800'0021,
  device_state = 0x0800'0022,
  no_dictionary = 0x0800'0023,
  no_data = 0x0800'0024,
};

// The code in words, e.g. "object does not exist"; "unknown abort code" for other codes.
std::string_view describe(AbortCode code);

constexpr Error to_error(AbortCode code) {
  return Error{Domain::sdo, static_cast<std::uint32_t>(code)};
}

}  // namespace linegate

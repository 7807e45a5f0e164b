// SPDX-License-Identifier: Apache-2.0
#include "stack/base/abort_code.h"

namespace linegate {

std::string_view describe(AbortCode code) {
  switch (code) {
    case AbortCode::none:
      return "no error";
    case AbortCode::toggle_bit:
      return "toggle bit not alternated";
    case AbortCode::timeout:
      return "SDO protocol timed out";
    case AbortCode::command_specifier:
      return "command specifier not valid or unknown";
    case AbortCode::block_size:
      return "invalid block size";
    case AbortCode::sequence_number:
      return "invalid sequence number";
    case AbortCode::crc:
      return "CRC error";
    case AbortCode::out_of_memory:
      return "out of memory";
    case AbortCode::unsupported_access:
      return "unsupported access to an object";
    case AbortCode::write_only:
      return "attempt to read a write-only object";
    case AbortCode::read_only:
      return "attempt to write a read-only object";
    case AbortCode::no_object:
      return "object does not exist in the object dictionary";
    case AbortCode::not_mappable:
      return "object cannot be mapped to the PDO";
    case AbortCode::pdo_length_exceeded:
      return "mapped objects would exceed the PDO length";
    case AbortCode::parameter_incompatible:
      return "general parameter incompatibility";
    case AbortCode::device_incompatible:
      return "general internal incompatibility in the device";
    case AbortCode::hardware:
      return "access failed due to a hardware error";
    case AbortCode::length_mismatch:
      return "data type or length does not match";
    case AbortCode::length_too_high:
      return "data type does not match, length too high";
    case AbortCode::length_too_low:
      return "data type does not match, length too low";
    case AbortCode::no_sub_index:
      return "sub-index does not exist";
    case AbortCode::invalid_value:
      return "invalid value for parameter";
    case AbortCode::value_too_high:
      return "value of parameter too high";
    case AbortCode::value_too_low:
      return "value of parameter too low";
    case AbortCode::max_less_than_min:
      return "maximum value is less than minimum value";
    case AbortCode::sdo_connection:
      return "resource not available: SDO connection";
    case AbortCode::general:
      return "general error";
    case AbortCode::cannot_transfer:
      return "data cannot be transferred or stored";
    case AbortCode::local_control:
      return "data cannot be transferred or stored: local control";
    case AbortCode::device_state:
      return "data cannot be transferred or stored: present device state";
    case AbortCode::no_dictionary:
      return "object dictionary not present or not generated";
    case AbortCode::no_data:
      return "no data available";
  }
  return "unknown abort code";
}

}  // namespace linegate

// SPDX-License-Identifier: Apache-2.0
#include "stack/od/data_type.h"

namespace linegate::od {

unsigned bit_size(DataType type) {
  switch (type) {
    case DataType::boolean:
      return 1;
    case DataType::integer8:
    case DataType::unsigned8:
      return 8;
    case DataType::integer16:
    case DataType::unsigned16:
      return 16;
    case DataType::integer24:
    case DataType::unsigned24:
      return 24;
    case DataType::integer32:
    case DataType::unsigned32:
    case DataType::real32:
      return 32;
    case DataType::integer40:
    case DataType::unsigned40:
      return 40;
    case DataType::integer48:
    case DataType::unsigned48:
    case DataType::time_of_day:
    case DataType::time_difference:
      return 48;
    case DataType::integer56:
    case DataType::unsigned56:
      return 56;
    case DataType::integer64:
    case DataType::unsigned64:
    case DataType::real64:
      return 64;
    case DataType::none:
    case DataType::visible_string:
    case DataType::octet_string:
    case DataType::unicode_string:
    case DataType::domain:
      break;
  }
  return 0;
}

unsigned byte_size(DataType type) {
  return (bit_size(type) + 7) / 8;
}

bool is_signed(DataType type) {
  switch (type) {
    case DataType::integer8:
    case DataType::integer16:
    case DataType::integer24:
    case DataType::integer32:
    case DataType::integer40:
    case DataType::integer48:
    case DataType::integer56:
    case DataType::integer64:
      return true;
    default:
      return false;
  }
}

bool is_integer(DataType type) {
  switch (type) {
    case DataType::boolean:
    case DataType::unsigned8:
    case DataType::unsigned16:
    case DataType::unsigned24:
    case DataType::unsigned32:
    case DataType::unsigned40:
    case DataType::unsigned48:
    case DataType::unsigned56:
    case DataType::unsigned64:
      return true;
    default:
      return is_signed(type);
  }
}

bool is_real(DataType type) {
  return type == DataType::real32 || type == DataType::real64;
}

bool is_string(DataType type) {
  return type == DataType::visible_string || type == DataType::octet_string ||
         type == DataType::unicode_string;
}

std::string_view name(DataType type) {
  switch (type) {
    case DataType::none:
      break;
    case DataType::boolean:
      return "BOOLEAN";
    case DataType::integer8:
      return "INTEGER8";
    case DataType::integer16:
      return "INTEGER16";
    case DataType::integer32:
      return "INTEGER32";
    case DataType::unsigned8:
      return "UNSIGNED8";
    case DataType::unsigned16:
      return "UNSIGNED16";
    case DataType::unsigned32:
      return "UNSIGNED32";
    case DataType::real32:
      return "REAL32";
    case DataType::visible_string:
      return "VISIBLE_STRING";
    case DataType::octet_string:
      return "OCTET_STRING";
    case DataType::unicode_string:
      return "UNICODE_STRING";
    case DataType::time_of_day:
      return "TIME_OF_DAY";
    case DataType::time_difference:
      return "TIME_DIFFERENCE";
    case DataType::domain:
      return "DOMAIN";
    case DataType::integer24:
      return "INTEGER24";
    case DataType::real64:
      return "REAL64";
    case DataType::integer40:
      return "INTEGER40";
    case DataType::integer48:
      return "INTEGER48";
    case DataType::integer56:
      return "INTEGER56";
    case DataType::integer64:
      return "INTEGER64";
    case DataType::unsigned24:
      return "UNSIGNED24";
    case DataType::unsigned40:
      return "UNSIGNED40";
    case DataType::unsigned48:
      return "UNSIGNED48";
    case DataType::unsigned56:
      return "UNSIGNED56";
    case DataType::unsigned64:
      return "UNSIGNED64";
  }
  return "unknown";
}

}  // namespace linegate::od

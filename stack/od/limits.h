// SPDX-License-Identifier: Apache-2.0
// Comparing a value with the LowLimit and HighLimit of its object (CiA 306, CiA 301 abort codes
// 0609 0031h, 0609 0032h and 0609 0036h).
#pragma once

#include <cstddef>
#include <span>

#include "stack/base/abort_code.h"
#include "stack/od/data_type.h"

namespace linegate::od {

// All three are little-endian; an empty limit is none, and types that cannot be compared (strings,
// DOMAIN, times) have no limits. value has byte_size(type) bytes. Gives none, value_too_low,
// value_too_high, max_less_than_min if no value at all could be right, or invalid_value for a real
// that is not a number where a limit exists.
AbortCode check_limits(DataType type, std::span<const std::byte> value,
                       std::span<const std::byte> low, std::span<const std::byte> high);

}  // namespace linegate::od

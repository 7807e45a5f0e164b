// SPDX-License-Identifier: Apache-2.0
// Whether an object may be mapped into a PDO (CiA 301, 7.5.2.36 and 7.5.2.38).
#pragma once

#include <cstddef>

#include "stack/base/abort_code.h"
#include "stack/od/data_type.h"
#include "stack/od/dictionary.h"
#include "stack/pdo/parameters.h"

namespace linegate::pdo {

// Whether a static data type (0001h, 0005h, ...) is mapped as a filler.
inline bool is_dummy(const Mapping& mapping) {
  return mapping.address.index != 0 && mapping.address.index < 0x20 && mapping.address.sub == 0 &&
         od::bit_size(static_cast<od::DataType>(mapping.address.index)) == mapping.bits;
}

// Number of bits of a variable in a PDO: of its type, or of its present value for strings; 0 for
// DOMAIN.
inline std::uint32_t pdo_bits(const od::Variable& variable) {
  return od::is_string(variable.type) ? 8 * variable.size : od::bit_size(variable.type);
}

// Returns none, or why the object cannot be mapped: no_object, no_sub_index, not_mappable (at all,
// or in this direction), length_mismatch (the number of bits is not that of the object).
AbortCode check_mapping(const od::Dictionary& dictionary, PdoKind kind, const Mapping& mapping);

// Returns not_mappable for a value of no whole bytes in a PDO of CANopen FD, else none. max_bits:
// the longest PDO, above 64 on a CAN FD line.
constexpr AbortCode check_granularity(const Mapping& mapping, std::size_t max_bits) {
  return max_bits > 64 && mapping.bits % 8 != 0 ? AbortCode::not_mappable : AbortCode::none;
}

}  // namespace linegate::pdo

// SPDX-License-Identifier: Apache-2.0
// What may be mapped into a PDO (CiA 301, 7.5.2.36 and 7.5.2.38), asked of a dictionary.
#pragma once

#include "stack/base/abort_code.h"
#include "stack/od/data_type.h"
#include "stack/od/dictionary.h"
#include "stack/pdo/parameters.h"

namespace linegate::pdo {

// A static data type (0001h, 0005h, ...) mapped as a filler.
inline bool is_dummy(const Mapping& mapping) {
  return mapping.address.index != 0 && mapping.address.index < 0x20 && mapping.address.sub == 0 &&
         od::bit_size(static_cast<od::DataType>(mapping.address.index)) == mapping.bits;
}

// Bits of a variable in a PDO: of its type, or of its present value for strings; 0 for DOMAIN.
inline std::uint32_t pdo_bits(const od::Variable& variable) {
  return od::is_string(variable.type) ? 8 * variable.size : od::bit_size(variable.type);
}

// none, or why the dictionary's object cannot be mapped so: no_object, no_sub_index, not_mappable
// (not at all, or not in this direction), length_mismatch (another number of bits than it has).
AbortCode check_mapping(const od::Dictionary& dictionary, PdoKind kind, const Mapping& mapping);

}  // namespace linegate::pdo

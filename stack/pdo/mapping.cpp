// SPDX-License-Identifier: Apache-2.0
#include "stack/pdo/mapping.h"

namespace linegate::pdo {

AbortCode check_mapping(const od::Dictionary& dictionary, PdoKind kind, const Mapping& mapping) {
  if (is_dummy(mapping)) {
    return kind == PdoKind::rpdo ? AbortCode::none : AbortCode::not_mappable;
  }
  const std::optional<od::Variable> variable = dictionary.find(mapping.address);
  if (!variable) {
    return AbortCode::no_object;  // also for a missing sub-index (CiA 301 7.5.2.36)
  }
  const bool direction = kind == PdoKind::rpdo ? od::rpdo_mappable(variable->access)
                                               : od::tpdo_mappable(variable->access);
  if (!variable->mappable || !direction) {
    return AbortCode::not_mappable;
  }
  const bool length = mapping.bits != 0 && mapping.bits == pdo_bits(*variable);
  return length ? AbortCode::none : AbortCode::length_mismatch;
}

}  // namespace linegate::pdo

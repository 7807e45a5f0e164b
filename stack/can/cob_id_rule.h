// SPDX-License-Identifier: Apache-2.0
// What CiA 301 lets one write to an object that holds a COB-ID.
#pragma once

#include "stack/base/abort_code.h"
#include "stack/can/cob_id.h"

namespace linegate::can {

// Bits 0..29 hold an identifier that may be configured: not restricted, and no more than 11 bits
// without bit 29.
constexpr bool has_allowed_id(CobId cob_id) {
  return cob_id.extended() ||
         ((cob_id.raw & 0x1FFF'FFFFU) == cob_id.id() && !is_restricted(cob_id.id()));
}

// Valid by bit 31, and with an allowed identifier: device files list elements that are not in use
// as 0, which would be node control.
constexpr bool is_usable(CobId cob_id) {
  return cob_id.valid() && has_allowed_id(cob_id);
}

// For COB-IDs with a valid bit (1014h, 1028h, 1201h..). invalid_value for another value while the
// present one is in use and stays so, and for an identifier that is not allowed. A COB-ID that is
// written invalid may say anything else.
constexpr AbortCode check_cob_id(CobId present, CobId wanted) {
  if (!wanted.valid()) {
    return AbortCode::none;
  }
  const bool changed = is_usable(present) && present != wanted;
  return changed || !has_allowed_id(wanted) ? AbortCode::invalid_value : AbortCode::none;
}

}  // namespace linegate::can

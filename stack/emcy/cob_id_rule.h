// What CiA 301 lets one write to an EMCY COB-ID (1014h and the elements of 1028h).
#pragma once

#include "stack/base/abort_code.h"
#include "stack/can/cob_id.h"

namespace linegate::emcy {

// Valid by bit 31, and an identifier that EMCY may have: device files list unused elements of 1028h
// as 0, which would be node control.
constexpr bool is_usable(can::CobId cob_id) {
  return cob_id.valid() && (cob_id.extended() || !can::is_restricted(cob_id.id()));
}

// invalid_value for another CAN-ID while the present one is in use and stays so, for a restricted
// CAN-ID, and for more than 11 bits without bit 29. A COB-ID that is written invalid may say
// anything else.
constexpr AbortCode check_cob_id(can::CobId present, can::CobId wanted) {
  if (!wanted.valid()) {
    return AbortCode::none;
  }
  const bool changed = is_usable(present) && present != wanted;
  const bool too_long = !wanted.extended() && (wanted.raw & 0x1FFF'FFFFU) != wanted.id();
  return changed || too_long || !is_usable(wanted) ? AbortCode::invalid_value : AbortCode::none;
}

}  // namespace linegate::emcy

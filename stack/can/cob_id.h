// SPDX-License-Identifier: Apache-2.0
// CAN identifiers (CiA 301, 7.3.3 and 7.3.5) and the COB-ID value of the objects. No other file has
// a table of identifiers.
#pragma once

#include <cstdint>

#include "stack/base/abort_code.h"
#include "stack/base/assert.h"
#include "stack/can/frame.h"

namespace linegate::can {

inline constexpr std::uint8_t kMinNodeId = 1;
inline constexpr std::uint8_t kMaxNodeId = 127;

inline constexpr std::uint32_t kNmtId = 0x000;
inline constexpr std::uint32_t kSyncId = 0x080;
inline constexpr std::uint32_t kEmcyBase = 0x080;  // + node-ID
inline constexpr std::uint32_t kTimeId = 0x100;
inline constexpr std::uint32_t kSdoResponseBase = 0x580;   // + node-ID, server to client
inline constexpr std::uint32_t kSdoRequestBase = 0x600;    // + node-ID, client to server
inline constexpr std::uint32_t kErrorControlBase = 0x700;  // + node-ID

// Default PDO identifiers of the pre-defined connection set: PDO 1..4 of a node.
constexpr std::uint32_t default_tpdo_id(unsigned number, std::uint8_t node) {
  LINEGATE_ASSERT(number >= 1 && number <= 4, "PDOs 1 to 4 have a default identifier");
  return 0x180 + (number - 1) * 0x100 + node;
}
constexpr std::uint32_t default_rpdo_id(unsigned number, std::uint8_t node) {
  LINEGATE_ASSERT(number >= 1 && number <= 4, "PDOs 1 to 4 have a default identifier");
  return 0x200 + (number - 1) * 0x100 + node;
}

// CiA 301 7.3.5, table "restricted CAN-IDs": never allowed where a COB-ID can be configured.
// Extended (29-bit) identifiers are not restricted.
constexpr bool is_restricted(std::uint32_t id) {
  return id <= 0x07F || (id >= 0x101 && id <= 0x180) || (id >= 0x581 && id <= 0x5FF) ||
         (id >= 0x601 && id <= 0x67F) || (id >= 0x6E0 && id <= 0x6FF) ||
         (id >= 0x701 && id <= 0x7FF);
}

// The U32 in 1005h, 1012h, 1014h, 1200h.., 1400h.., 1800h..: bits 0-28 identifier, 29 frame format,
// 30 and 31 as the object defines them.
struct CobId {
  std::uint32_t raw = kInvalidBit;

  static constexpr std::uint32_t kInvalidBit = 0x8000'0000;   // PDO, SDO, EMCY: does not exist
  static constexpr std::uint32_t kNoRtrBit = 0x4000'0000;     // TPDO: no RTR allowed
  static constexpr std::uint32_t kProducerBit = 0x4000'0000;  // SYNC, TIME: produce
  static constexpr std::uint32_t kExtendedBit = 0x2000'0000;

  constexpr bool valid() const { return (raw & kInvalidBit) == 0; }
  constexpr bool extended() const { return (raw & kExtendedBit) != 0; }
  constexpr std::uint32_t id() const { return raw & (extended() ? 0x1FFF'FFFFU : 0x7FFU); }
  // The header of a classical data frame with this identifier.
  constexpr Header header(std::uint8_t length) const {
    return {id(), length, extended() ? std::uint8_t{Frame::kExtended} : std::uint8_t{0}};
  }

  friend constexpr bool operator==(CobId, CobId) = default;
};

// --- checks for writing an object that holds a COB-ID (CiA 301) ---------------------------------

// Bits 0..29 hold an identifier that may be configured: it is not restricted, and has at most 11
// bits if bit 29 is 0.
constexpr bool has_allowed_id(CobId cob_id) {
  return cob_id.extended() ||
         ((cob_id.raw & 0x1FFF'FFFFU) == cob_id.id() && !is_restricted(cob_id.id()));
}

// Valid according to bit 31, and with an allowed identifier: device files list unused elements as
// 0, which would be the identifier of node control.
constexpr bool is_usable(CobId cob_id) {
  return cob_id.valid() && has_allowed_id(cob_id);
}

// Checks a write to a COB-ID with a valid bit (1014h, 1028h, 1201h..). Returns invalid_value for a
// changed COB-ID while the present one is valid and stays valid, and for an identifier that is not
// allowed. If the written COB-ID is marked invalid, its other bits may have any value.
constexpr AbortCode check_cob_id(CobId present, CobId wanted) {
  if (!wanted.valid()) {
    return AbortCode::none;
  }
  const bool changed = is_usable(present) && present != wanted;
  return changed || !has_allowed_id(wanted) ? AbortCode::invalid_value : AbortCode::none;
}

}  // namespace linegate::can

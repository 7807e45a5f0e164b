// SPDX-License-Identifier: Apache-2.0
// What the SDO channels of a node, 1200h to 127Fh and 1280h to 12FFh, have in common.
#pragma once

#include <cstdint>

#include "stack/can/cob_id.h"
#include "stack/od/dictionary.h"

namespace linegate::node {

// Sub-indices of a channel: the COB-IDs from client to server, and back.
inline constexpr std::uint8_t kRequestSub = 1;
inline constexpr std::uint8_t kResponseSub = 2;

// Whether one of the objects first to last (both included), place's own left out, has the
// identifier of cob_id at the sub-index of place, and both are valid. Two channels on one
// identifier would answer, or take for their answer, what is meant for the other.
bool has_identifier(const od::Dictionary& dictionary, std::uint16_t first, std::uint16_t last,
                    od::Address place, can::CobId cob_id);

}  // namespace linegate::node

// SPDX-License-Identifier: Apache-2.0
// Two devices of a line that send on one identifier: neither is understood by anybody.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "stack/can/cob_id.h"
#include "stack/scan/scanned_node.h"

namespace linegate::scan {

struct Producer {
  std::uint8_t node = 0;
  od::Address object{};  // that holds the COB-ID: 1005h:0 (SYNC), 1014h:0 (EMCY), 1800h.. :1
};

struct Conflict {
  can::CobId cob_id;
  Producer first;
  Producer second;
};

// The identifier that the node produces by that object; nothing if the object is no COB-ID, was not
// read or says that nothing is produced.
std::optional<can::CobId> produced(const ScannedNode& node, od::Address object);

// Each identifier that more than one of them produces, as pairs with the first who does.
std::vector<Conflict> conflicts(std::span<const ScannedNode> nodes);

}  // namespace linegate::scan

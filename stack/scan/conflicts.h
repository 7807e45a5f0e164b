// SPDX-License-Identifier: Apache-2.0
// Two devices of a line that send on one identifier: neither is understood by anybody.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "stack/can/cob_id.h"
#include "stack/od/description.h"
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

// PDOs of devices that a manager takes no part in: there must be exactly one who sends on an
// identifier, or nobody can tell whose data these are.
struct LeftOut {
  std::uint8_t node = 0;
  std::uint16_t record = 0;  // 1400h.. (an RPDO), 1800h.. (a TPDO)
  can::CobId cob_id;
  Producer other;  // who sends on that identifier, or sends on it too
};

// TPDOs on an identifier that somebody else produces; RPDOs on one that more than one device
// produces, or that is a device's EMCY or SYNC. An RPDO on the identifier of one TPDO is not among
// them: pdo::plan_links() takes the two as linked to each other, and never sends it.
std::vector<LeftOut> left_out(std::span<const ScannedNode> nodes);

// Takes those of the node, and PDOs that cannot be linked (pdo::describe_pdo()), out of its
// description: their COB-ID there says that they do not exist, and is no configured value, so that
// nothing is written to the device. Gives a sentence for each.
std::vector<std::string> leave_out(od::DeviceDescription& device, std::uint8_t node,
                                   std::span<const LeftOut> pdos);

}  // namespace linegate::scan

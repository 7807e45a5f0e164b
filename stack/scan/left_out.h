// SPDX-License-Identifier: Apache-2.0
// PDOs of devices that a manager takes no part in: there must be exactly one who sends on an
// identifier, or nobody can tell whose data these are.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "stack/can/cob_id.h"
#include "stack/od/description.h"
#include "stack/scan/conflicts.h"
#include "stack/scan/scanned_node.h"

namespace linegate::scan {

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

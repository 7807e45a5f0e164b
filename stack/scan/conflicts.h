// SPDX-License-Identifier: Apache-2.0
// Two devices of a line that send on the same identifier: their frames cannot be distinguished.
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
  od::Address object{};  // the object with the COB-ID: 1005h:0 (SYNC), 1014h:0 (EMCY), 1800h.. :1
};

struct Conflict {
  can::CobId cob_id;
  Producer first;
  Producer second;
};

// The identifier that the node produces according to that object; nothing if the object is not a
// COB-ID, was not read, or says that nothing is produced.
std::optional<can::CobId> produced(const ScannedNode& node, od::Address object);

// Each identifier that more than one node produces: one pair of the first producer with each
// further one.
std::vector<Conflict> conflicts(std::span<const ScannedNode> nodes);

// PDOs of devices that the manager does not use: an identifier must have exactly one producer,
// otherwise the source of the data is ambiguous.
struct LeftOut {
  std::uint8_t node = 0;
  std::uint16_t record = 0;  // 1400h.. (an RPDO), 1800h.. (a TPDO)
  can::CobId cob_id;
  Producer other;  // a producer of that identifier
};

// TPDOs on an identifier that another device also produces; RPDOs on an identifier that more than
// one device produces, or that is the EMCY or SYNC of a device. An RPDO on the identifier of
// exactly one TPDO is not included: pdo::plan_links() treats the two as linked to each other, and
// never sends it.
std::vector<LeftOut> left_out(std::span<const ScannedNode> nodes);

// Removes these PDOs of the node, and PDOs that cannot be linked (pdo::describe_pdo()), from its
// description: their COB-IDs become not valid, as defaults and not as configured values, so that
// nothing is written to the device. Returns one sentence for each. longest_pdo: in bits.
std::vector<std::string> leave_out(od::DeviceDescription& device, std::uint8_t node,
                                   std::span<const LeftOut> pdos, std::size_t longest_pdo = 64);

}  // namespace linegate::scan

// SPDX-License-Identifier: Apache-2.0
#include "stack/scan/conflicts.h"

#include <map>

#include "stack/od/objects.h"

namespace linegate::scan {
namespace {

constexpr od::Address kSync{od::objects::kSyncCobId, 0};
constexpr od::Address kEmcy{od::objects::kEmcyCobId, 0};

bool is_tpdo(od::Address address) {
  return od::objects::is_tpdo_communication(address.index) && address.sub == 1;
}

bool produces(od::Address address, can::CobId cob_id) {
  if (address == kSync) {
    return (cob_id.raw & can::CobId::kProducerBit) != 0;
  }
  return (address == kEmcy || is_tpdo(address)) && cob_id.valid();
}

// An identifier together with its frame format.
std::uint32_t key(can::CobId cob_id) {
  return cob_id.id() | (cob_id.extended() ? can::CobId::kExtendedBit : 0U);
}

}  // namespace

std::optional<can::CobId> produced(const ScannedNode& node, od::Address object) {
  if (object != kSync && object != kEmcy && !is_tpdo(object)) {
    return std::nullopt;
  }
  const auto number = node.number(object);
  const can::CobId cob_id{static_cast<std::uint32_t>(number.value_or(0))};
  return number && produces(object, cob_id) ? std::optional(cob_id) : std::nullopt;
}

std::vector<Conflict> conflicts(std::span<const ScannedNode> nodes) {
  std::vector<Conflict> out;
  std::map<std::uint32_t, Producer> producers;
  for (const ScannedNode& node : nodes) {
    for (const manager::ObjectWrite& value : node.values) {
      const auto cob_id = produced(node, value.address);
      if (!cob_id) {
        continue;
      }
      const Producer self{node.id, value.address};
      const auto [known, is_first] = producers.try_emplace(key(*cob_id), self);
      if (!is_first) {
        out.push_back({*cob_id, known->second, self});
      }
    }
  }
  return out;
}

}  // namespace linegate::scan

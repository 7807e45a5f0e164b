// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <map>
#include <string>

#include "stack/base/byte_order.h"
#include "stack/base/hex_text.h"
#include "stack/od/description.h"
#include "stack/od/objects.h"
#include "stack/pdo/parameters.h"
#include "stack/scan/conflicts.h"

namespace linegate::scan {
namespace {

using pdo::PdoKind;
using Producers = std::map<std::uint32_t, std::vector<Producer>>;  // by key_of()

constexpr std::uint16_t kPdoRecords = 0x200;

bool is_in(std::uint16_t index, std::uint16_t first) {
  return index >= first && index < first + kPdoRecords;
}

bool is_pdo(od::Address address, std::uint16_t first) {
  return is_in(address.index, first) && address.sub == 1;
}

std::uint32_t key_of(can::CobId cob_id) {
  return cob_id.id() | (cob_id.extended() ? can::CobId::kExtendedBit : 0U);
}

Producers producers_among(std::span<const ScannedNode> nodes) {
  Producers out;
  for (const ScannedNode& node : nodes) {
    for (const manager::ObjectWrite& value : node.values) {
      if (const auto cob_id = produced(node, value.address)) {
        out[key_of(*cob_id)].push_back({node.id, value.address});
      }
    }
  }
  return out;
}

// The producer that conflicts with that PDO; nullptr if there is none.
const Producer* in_the_way(const Producers& producers, std::uint8_t node, od::Address address,
                           can::CobId cob_id) {
  const auto known = producers.find(key_of(cob_id));
  if (known == producers.end()) {
    return nullptr;
  }
  const std::vector<Producer>& all = known->second;
  if (is_pdo(address, od::objects::kRpdoCommunication)) {
    const bool linked =
        all.size() == 1 && is_pdo(all.front().object, od::objects::kTpdoCommunication);
    return linked ? nullptr : &all.front();
  }
  const auto other = std::ranges::find_if(
      all, [&](const Producer& one) { return one.node != node || one.object != address; });
  return other == all.end() ? nullptr : &*other;
}

std::string name_of(std::uint16_t record) {
  const bool sent = is_in(record, od::objects::kTpdoCommunication);
  return (sent ? "TPDO " : "RPDO ") +
         std::to_string(record -
                        (sent ? od::objects::kTpdoCommunication : od::objects::kRpdoCommunication) +
                        1);
}

std::string sentence(const LeftOut& pdo) {
  return name_of(pdo.record) + " is left out: on its identifier " + hex_text(pdo.cob_id.id(), 3) +
         " node " + std::to_string(pdo.other.node) + " sends (" + od::to_text(pdo.other.object) +
         ")";
}

void mark_invalid(od::DeviceDescription& device, std::uint16_t record) {
  od::VariableDescription* const cob_id = device.find(od::Address{record, 1});
  if (cob_id != nullptr && cob_id->value.size() == sizeof(std::uint32_t)) {
    const auto raw = load_le<std::uint32_t>(cob_id->value.data());
    store_le(cob_id->value.data(), raw | can::CobId::kInvalidBit);
    cob_id->configured = false;
  }
}

void leave_out_what_cannot_be(od::DeviceDescription& device, PdoKind kind, std::uint16_t first,
                              std::size_t longest_pdo, std::vector<std::string>& notes) {
  for (std::uint16_t number = 1; number <= kPdoRecords; ++number) {
    const auto record = static_cast<std::uint16_t>(first + number - 1);
    if (device.find(record) == nullptr) {
      continue;
    }
    const auto described = pdo::describe_pdo(device, kind, number, longest_pdo);
    const auto fault =
        std::ranges::find(described.diagnostics, Severity::error, &Diagnostic::severity);
    if (fault != described.diagnostics.end()) {
      notes.push_back(name_of(record) + " is left out: " + fault->text);
      mark_invalid(device, record);
    }
  }
}

}  // namespace

std::vector<LeftOut> left_out(std::span<const ScannedNode> nodes) {
  const Producers producers = producers_among(nodes);
  std::vector<LeftOut> out;
  for (const ScannedNode& node : nodes) {
    for (const manager::ObjectWrite& value : node.values) {
      const can::CobId cob_id{static_cast<std::uint32_t>(node.number(value.address).value_or(0))};
      const bool pdo = is_pdo(value.address, od::objects::kRpdoCommunication) ||
                       is_pdo(value.address, od::objects::kTpdoCommunication);
      if (!pdo || !cob_id.valid()) {
        continue;
      }
      if (const Producer* other = in_the_way(producers, node.id, value.address, cob_id)) {
        out.push_back({node.id, value.address.index, cob_id, *other});
      }
    }
  }
  return out;
}

std::vector<std::string> leave_out(od::DeviceDescription& device, std::uint8_t node,
                                   std::span<const LeftOut> pdos, std::size_t longest_pdo) {
  std::vector<std::string> notes;
  for (const LeftOut& pdo : pdos) {
    if (pdo.node == node) {
      notes.push_back(sentence(pdo));
      mark_invalid(device, pdo.record);
    }
  }
  leave_out_what_cannot_be(device, PdoKind::rpdo, od::objects::kRpdoCommunication, longest_pdo,
                           notes);
  leave_out_what_cannot_be(device, PdoKind::tpdo, od::objects::kTpdoCommunication, longest_pdo,
                           notes);
  return notes;
}

}  // namespace linegate::scan

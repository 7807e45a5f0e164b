// SPDX-License-Identifier: Apache-2.0
// add_linked_objects(): the manager's own PDO records.
#include <algorithm>
#include <chrono>

#include "stack/image/network_variables.h"
#include "stack/od/description.h"
#include "stack/pdo/link.h"
#include "stack/pdo/mapping.h"

namespace linegate::pdo {
namespace {

using od::Access;
using od::DataType;

od::ObjectDescription record(std::uint16_t base, PdoKind kind, std::string_view what,
                             std::uint16_t number) {
  od::ObjectDescription out;
  out.index = static_cast<std::uint16_t>(base + number - 1);
  out.name =
      std::string(name(kind)) + " " + std::string(what) + " parameter " + std::to_string(number);
  out.type = od::ObjectType::record;
  return out;
}

od::ObjectDescription communication_record(PdoKind kind, const Parameters& pdo,
                                           Access fixed = Access::ro) {
  using std::chrono::duration_cast;
  od::ObjectDescription out = record(communication_base(kind), kind, "communication", pdo.number);
  const bool tpdo = kind == PdoKind::tpdo;
  const auto inhibit = pdo.inhibit / std::chrono::microseconds(100);
  const auto timer = duration_cast<std::chrono::milliseconds>(pdo.event_timer).count();
  out.variables = {
      od::number_variable(0, "Highest sub-index supported", DataType::unsigned8, Access::constant,
                          tpdo ? 6 : 5),
      od::number_variable(1, "COB-ID", DataType::unsigned32, fixed, pdo.cob_id.raw),
      od::number_variable(2, "Transmission type", DataType::unsigned8, Access::rw, pdo.type),
      od::number_variable(3, "Inhibit time", DataType::unsigned16, Access::rw,
                          static_cast<std::uint64_t>(inhibit)),
      od::number_variable(5, "Event timer", DataType::unsigned16, Access::rw,
                          static_cast<std::uint64_t>(timer)),
  };
  if (tpdo) {
    out.variables.push_back(od::number_variable(6, "SYNC start value", DataType::unsigned8,
                                                Access::rw, pdo.sync_start));
  }
  return out;
}

od::ObjectDescription mapping_record(PdoKind kind, const Parameters& pdo) {
  od::ObjectDescription out = record(mapping_base(kind), kind, "mapping", pdo.number);
  const std::size_t count = std::min<std::size_t>(pdo.mapping.size(), kMaxMapped);
  out.variables.push_back(
      od::number_variable(0, "Number of mapped objects", DataType::unsigned8, Access::ro, count));
  for (std::size_t i = 0; i < count; ++i) {
    const auto sub = static_cast<std::uint8_t>(i + 1);
    out.variables.push_back(od::number_variable(sub, "Mapped object " + std::to_string(sub),
                                                DataType::unsigned32, Access::ro,
                                                pdo.mapping[i].raw()));
  }
  return out;
}

Result<void> add_records(od::Dictionary& dictionary, PdoKind kind,
                         const std::vector<LinkedPdo>& pdos) {
  for (const LinkedPdo& pdo : pdos) {
    if (pdo.parameters.number > kMaxPdo || pdo.is_srdo()) {
      continue;
    }
    Result<void> added = dictionary.add(communication_record(kind, pdo.parameters));
    if (added.ok()) {
      added = dictionary.add(mapping_record(kind, pdo.parameters));
    }
    if (!added.ok()) {
      return added;
    }
  }
  return {};
}

// With space for further entries.
od::ObjectDescription own_mapping_record(PdoKind kind, const Parameters& pdo) {
  od::ObjectDescription out = mapping_record(kind, pdo);
  out.variables.front().access = Access::rw;
  if (pdo.mpdo != MpdoMode::none) {
    const bool source = pdo.mpdo == MpdoMode::source;
    out.variables.front().value = {std::byte{source ? kSourceMode : kDestinationMode}};
  }
  for (std::size_t i = 1; i <= kMaxMapped; ++i) {
    const auto sub = static_cast<std::uint8_t>(i);
    if (i < out.variables.size()) {
      out.variables[i].access = Access::rw;
    } else {
      out.variables.push_back(od::number_variable(sub, "Mapped object " + std::to_string(sub),
                                                  DataType::unsigned32, Access::rw, 0));
    }
  }
  return out;
}

}  // namespace

Result<void> add_own_pdo(od::Dictionary& dictionary, PdoKind kind, const Parameters& pdo) {
  Result<void> added = dictionary.add(communication_record(kind, pdo, Access::rw));
  return added.ok() ? dictionary.add(own_mapping_record(kind, pdo)) : added;
}

Result<void> add_linked_objects(od::Dictionary& dictionary, image::ProcessImage& image,
                                const LinkPlan& plan) {
  Result<void> added = image::add_network_variables(dictionary, image);
  if (added.ok()) {
    added = add_records(dictionary, PdoKind::rpdo, plan.rpdos);
  }
  if (added.ok()) {
    added = add_records(dictionary, PdoKind::tpdo, plan.tpdos);
  }
  return added;
}

}  // namespace linegate::pdo

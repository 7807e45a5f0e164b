// SPDX-License-Identifier: Apache-2.0
#include "bridges/console/explain_own_node.h"

#include <algorithm>
#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "stack/pdo/parameters.h"
#include "stack/routing/forward.h"

namespace linegate::console {
namespace {

using od::Access;
using od::DataType;

// By address, because a description has its objects in ascending order.
using OwnVariables = std::map<od::Address, od::VariableDescription>;

void add_records(pdo::PdoKind kind, const pdo::Parameters& pdo, OwnVariables& out) {
  const auto record = static_cast<std::uint16_t>(communication_base(kind) + pdo.number - 1);
  const auto mapping = static_cast<std::uint16_t>(mapping_base(kind) + pdo.number - 1);
  const auto set = [&out](od::Address place, DataType type, std::uint64_t value) {
    out[place] = od::number_variable(place.sub, "", type, Access::rw, value);
  };
  set({record, 1}, DataType::unsigned32, pdo.cob_id.raw);
  set({record, 2}, DataType::unsigned8, pdo.type);
  std::uint64_t count = pdo.mapping.size();
  if (pdo.mpdo != pdo::MpdoMode::none) {
    count = pdo.mpdo == pdo::MpdoMode::source ? pdo::kSourceMode : pdo::kDestinationMode;
  }
  set({mapping, 0}, DataType::unsigned8, count);
  for (std::size_t i = 0; i < pdo.mapping.size(); ++i) {
    set({mapping, static_cast<std::uint8_t>(i + 1)}, DataType::unsigned32, pdo.mapping[i].raw());
  }
}

std::string record_name(std::uint16_t index) {
  const auto in = [index](std::uint16_t base) {
    return index >= base && index < base + pdo::kMaxPdo;
  };
  for (const auto kind : {pdo::PdoKind::rpdo, pdo::PdoKind::tpdo}) {
    if (in(communication_base(kind))) {
      return std::string(name(kind)) + " communication parameter";
    }
    if (in(mapping_base(kind))) {
      return std::string(name(kind)) + " mapping parameter";
    }
  }
  return "";
}

}  // namespace

od::DeviceDescription describe_own_node(const line::LineConfig& line) {
  OwnVariables variables;
  for (const line::OwnObject& object : line.own_objects) {
    variables[{object.index, object.variable.sub}] = object.variable;
  }
  for (const routing::ForwardedObject& object : line.forwarding.objects) {
    const auto type = routing::forward_type(object.address);
    for (const od::Address place : {object.address, routing::shown_address(object.address)}) {
      variables[place] =
          od::number_variable(place.sub, object.name, type.value_or(DataType::none), Access::rw);
      variables[place].mappable = true;
    }
  }
  for (const pdo::Parameters& pdo : line.forwarding.rpdos) {
    add_records(pdo::PdoKind::rpdo, pdo, variables);
  }
  for (const pdo::Parameters& pdo : line.forwarding.tpdos) {
    add_records(pdo::PdoKind::tpdo, pdo, variables);
  }
  od::DeviceDescription out;
  for (auto& [place, variable] : variables) {
    if (out.objects.empty() || out.objects.back().index != place.index) {
      out.objects.push_back({.index = place.index, .name = record_name(place.index)});
    }
    od::ObjectDescription& object = out.objects.back();
    if (object.name.empty()) {
      object.name = variable.name;
    }
    object.variables.push_back(std::move(variable));
  }
  return out;
}

}  // namespace linegate::console

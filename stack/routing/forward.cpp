// SPDX-License-Identifier: Apache-2.0
#include "stack/routing/forward.h"

#include <algorithm>
#include <set>
#include <string>
#include <utility>

#include "stack/base/assert.h"
#include "stack/image/network_variables.h"
#include "stack/od/objects.h"
#include "stack/pdo/link.h"

namespace linegate::routing {
namespace {

// From A000h to B000h, and from one half to the other (CiA 302-4, input and output network
// variables).
constexpr std::uint16_t kFromVariables =
    od::objects::kSharedVariables - od::objects::kInputVariables;
constexpr std::uint16_t kHalf = od::objects::kOutputVariables - od::objects::kInputVariables;

void check_numbers(const std::vector<pdo::Parameters>& own,
                   const std::vector<pdo::LinkedPdo>& linked, std::string_view kind,
                   const std::string& file, std::vector<Diagnostic>& out) {
  std::set<std::uint16_t> seen;
  for (const pdo::Parameters& parameters : own) {
    const std::uint16_t number = parameters.number;
    const std::string text = std::string(kind) + " " + std::to_string(number);
    if (number < 1 || number > pdo::kMaxPdo) {
      out.push_back({Severity::error, file, 0, 0, text + " of the own node is not in 1..512"});
    } else if (number <= linked.size()) {
      out.push_back({Severity::error, file, 0, 0,
                     text + " of the own node is linked to a device: 1 to " +
                         std::to_string(linked.size()) + " are"});
    } else if (!seen.insert(number).second) {
      out.push_back({Severity::error, file, 0, 0, text + " of the own node is there twice"});
    }
  }
}

}  // namespace

std::optional<od::Address> forward_address(od::DataType type, std::uint32_t bits,
                                           std::uint32_t element) {
  const auto variable =
      image::variable_address(image::Direction::outputs, type, element * bits, bits);
  if (!variable) {
    return std::nullopt;
  }
  return od::Address{static_cast<std::uint16_t>(variable->index + kFromVariables), variable->sub};
}

od::Address shown_address(od::Address object) {
  return {static_cast<std::uint16_t>(object.index + kHalf), object.sub};
}

std::optional<od::DataType> forward_type(od::Address object) {
  const auto place = image::variable_place(
      {static_cast<std::uint16_t>(object.index - kFromVariables), object.sub});
  if (!place || place->direction != image::Direction::outputs) {
    return std::nullopt;
  }
  return place->type;
}

std::vector<Diagnostic> check(const Forwarding& config, const pdo::LinkPlan& plan,
                              const std::string& file) {
  std::vector<Diagnostic> out;
  std::set<od::Address> seen;
  for (const ForwardedObject& object : config.objects) {
    if (!forward_type(object.address)) {
      out.push_back({Severity::error, file, 0, 0,
                     "\"" + object.name + "\" is no object B000h..B47Fh, sub-index 1..254"});
    } else if (!seen.insert(object.address).second) {
      out.push_back(
          {Severity::error, file, 0, 0, "\"" + object.name + "\" has the object of another"});
    }
  }
  check_numbers(config.rpdos, plan.rpdos, "RPDO", file, out);
  check_numbers(config.tpdos, plan.tpdos, "TPDO", file, out);
  return out;
}

void show_in_records(const Forwarding& config, pdo::LinkPlan& plan) {
  for (const ForwardedObject& object : config.objects) {
    if (!object.entry) {
      continue;
    }
    const bool input = object.entry->direction == image::Direction::inputs;
    const image::Layout& layout = input ? plan.inputs : plan.outputs;
    LINEGATE_ASSERT(object.entry->number < layout.entries.size(), "check() found every entry");
    const image::Entry& entry = layout.entries[object.entry->number];
    auto& pdos = input ? plan.rpdos : plan.tpdos;
    const auto pdo = std::ranges::find_if(pdos, [&](const pdo::LinkedPdo& linked) {
      return linked.parameters.number == entry.local_pdo;
    });
    if (pdo == pdos.end()) {
      continue;
    }
    for (pdo::Mapping& mapping : pdo->parameters.mapping) {
      if (mapping.address == od::Address{entry.variable_index, entry.variable_sub}) {
        mapping.address = object.address;
      }
    }
  }
}

}  // namespace linegate::routing

// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <set>

#include "gateway/config/patch.h"
#include "gateway/config/sections.h"
#include "stack/base/byte_order.h"
#include "stack/can/cob_id.h"
#include "stack/eds/value.h"
#include "stack/od/data_type.h"
#include "stack/srdo/parameters.h"

namespace linegate::config {
namespace {

// Beyond its limits the device would refuse the value, and its boot would fail.
void check_value_limits(Findings& findings, Place place, od::Address address,
                        const od::VariableDescription& variable, std::span<const std::byte> value) {
  const AbortCode why =
      od::check_limits(variable.type, value, variable.low_limit, variable.high_limit);
  if (why == AbortCode::none || why == AbortCode::max_less_than_min) {
    return;
  }
  const bool low = why == AbortCode::value_too_low;
  findings.error(place,
                 "object " + format_address(address) + " (" + variable.name + "): " +
                     (why == AbortCode::invalid_value
                          ? "this is not a number"
                          : std::string("the value is ") +
                                (low ? "below the LowLimit " : "above the HighLimit ") +
                                eds::format_value(variable.type,
                                                  low ? variable.low_limit : variable.high_limit)) +
                     " of the device file");
}

void read_object(Section& section, const YAML::Node& key, const YAML::Node& value,
                 line::NodeConfig& config) {
  Findings& findings = section.findings();
  if (!key.IsScalar()) {
    return;  // already reported by the section
  }
  const auto address = parse_address(key.Scalar());
  if (!address) {
    findings.error(place_of(key),
                   "expected an object such as 6083:1 (index and sub-index "
                   "hexadecimal), got \"" +
                       key.Scalar() + "\"");
    return;
  }
  const auto* variable = config.device.find(*address);
  if (variable == nullptr) {
    findings.error(place_of(key),
                   config.device.file + " has no object " + format_address(*address));
    return;
  }
  if (!od::writable(variable->access)) {
    findings.error(place_of(key), "object " + format_address(*address) + " (" + variable->name +
                                      ") cannot be written: its access is read-only");
    return;
  }
  const auto text = section.text(value);
  if (!text) {
    return;
  }
  auto data = parse_value(*text, variable->type);
  if (!data) {
    findings.error(place_of(value), "\"" + *text + "\" is no " +
                                        std::string(od::name(variable->type)) + " for object " +
                                        format_address(*address) + " (" + variable->name + ")");
    return;
  }
  check_value_limits(findings, place_of(value), *address, *variable, *data);
  check_pdo_cob_id(findings, place_of(value), *address, *data);
  if (is_pdo_record(address->index) || srdo::is_srdo_object(address->index)) {
    set_value(config.device, *address, *data);
  }
  config.objects.push_back({*address, std::move(*data)});
}

}  // namespace

od::VariableDescription* find_variable(od::DeviceDescription& device, od::Address address) {
  for (auto& object : device.objects) {
    if (object.index != address.index) {
      continue;
    }
    const auto it = std::find_if(object.variables.begin(), object.variables.end(),
                                 [&](const auto& v) { return v.sub == address.sub; });
    return it == object.variables.end() ? nullptr : &*it;
  }
  return nullptr;
}

void set_value(od::DeviceDescription& device, od::Address address,
               const std::vector<std::byte>& value) {
  if (auto* variable = find_variable(device, address)) {
    variable->value = value;
    // The line writes it in a position of its own.
    variable->configured = false;
    variable->overridden = true;
  }
}

void check_pdo_cob_id(Findings& findings, Place place, od::Address address,
                      const std::vector<std::byte>& value) {
  const bool communication = is_pdo_record(address.index) && (address.index & 0x0200U) == 0;
  if (!communication || address.sub != 1 || value.size() != sizeof(std::uint32_t)) {
    return;
  }
  const can::CobId cob_id{load_le<std::uint32_t>(value.data())};
  if (cob_id.valid() && !can::has_allowed_id(cob_id)) {
    findings.error(place, "object " + format_address(address) +
                              ": a PDO that is valid must not have this CAN-ID (CiA 301 7.3.5); "
                              "bit 31 of a COB-ID that is not in use is set");
  }
}

void read_objects(Findings& findings, const YAML::Node& node, line::NodeConfig& config) {
  if (!node.IsDefined()) {
    return;
  }
  Section section(findings, node, "objects");
  if (!section.valid()) {
    return;
  }
  std::set<od::Address> seen;
  for (const auto& pair : node) {
    const auto address = pair.first.IsScalar() ? parse_address(pair.first.Scalar()) : std::nullopt;
    if (address && !seen.insert(*address).second) {
      findings.error(place_of(pair.first),
                     "object " + format_address(*address) + " is there twice");
    }
    read_object(section, pair.first, pair.second, config);
  }
}

}  // namespace linegate::config

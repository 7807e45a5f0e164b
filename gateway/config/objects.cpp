#include <algorithm>

#include "gateway/config/patch.h"
#include "gateway/config/sections.h"

namespace linegate::config {
namespace {

void read_object(Section& section, const YAML::Node& key, const YAML::Node& value,
                 line::NodeConfig& config) {
  Findings& findings = section.findings();
  if (!key.IsScalar()) {
    return;  // the section has said so
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
  if (is_pdo_record(address->index)) {
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
    // The line writes it itself, in its place among the others.
    variable->configured = false;
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
  std::vector<od::Address> seen;
  for (const auto& pair : node) {
    const auto address = pair.first.IsScalar() ? parse_address(pair.first.Scalar()) : std::nullopt;
    if (address && std::find(seen.begin(), seen.end(), *address) != seen.end()) {
      findings.error(place_of(pair.first),
                     "object " + format_address(*address) + " is there twice");
    }
    if (address) {
      seen.push_back(*address);
    }
    read_object(section, pair.first, pair.second, config);
  }
}

}  // namespace linegate::config

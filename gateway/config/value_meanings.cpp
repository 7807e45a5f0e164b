// SPDX-License-Identifier: Apache-2.0
// `values:` of a node or device: name, unit, scaling and limits of its objects.
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "gateway/config/patch.h"
#include "gateway/config/sections.h"
#include "stack/image/scaling.h"
#include "stack/pdo/object_names.h"

namespace linegate::config {
namespace {

constexpr std::size_t kLongestAlias =
    64;  // leaves room for the name of the node in that of an entry

bool is_printable(const std::string& text) {
  return std::ranges::none_of(
      text, [](char c) { return static_cast<unsigned char>(c) < 0x20 || c == 0x7F; });
}

// A finite number; nothing if the key is absent or after an error.
std::optional<double> read_finite(Section& section, const char* key) {
  const YAML::Node node = section.find(key);
  const auto text = section.text(node);
  if (!text) {
    return std::nullopt;
  }
  const auto number = image::parse_number(*text);
  if (!number || !std::isfinite(*number)) {
    section.findings().error(
        place_of(node), std::string(key) + ": \"" + *text + "\" is no finite number such as 0.1");
    return std::nullopt;
  }
  return number;
}

}  // namespace

void read_scaling(Section& section, std::string_view what, od::VariableDescription& variable) {
  Findings& findings = section.findings();
  const YAML::Node unit = section.find("unit");
  if (auto text = section.text(unit)) {
    if (text->empty() || text->size() > od::kLongestUnit || !is_printable(*text)) {
      findings.error(place_of(unit), "a unit has 1 to " + std::to_string(od::kLongestUnit) +
                                         " bytes and no control characters");
    } else {
      variable.scaling.unit = std::move(*text);
    }
  }
  const auto scale = read_finite(section, "scale");
  const auto offset = read_finite(section, "offset");
  for (const char* key : {"unit", "scale", "offset"}) {
    const YAML::Node node = section.find(key);
    const auto bits = static_cast<std::uint16_t>(od::bit_size(variable.type));
    if (node.IsDefined() && !image::is_scalable(variable.type, bits)) {
      findings.error(place_of(node), std::string(what) + " is " +
                                         std::string(od::name(variable.type)) + ": " + key +
                                         " is for integers and reals");
      return;
    }
  }
  if (scale && !(std::abs(*scale) > 0)) {
    findings.error(place_of(section.find("scale")),
                   "scale is 0: the value in the unit is raw * scale + offset");
    return;
  }
  variable.scaling.scale = scale.value_or(variable.scaling.scale);
  variable.scaling.offset = offset.value_or(variable.scaling.offset);
}

void read_scaled_limits(Section& section, std::string_view what,
                        od::VariableDescription& variable) {
  Findings& findings = section.findings();
  const auto bits = static_cast<std::uint16_t>(od::bit_size(variable.type));
  const bool turned = variable.scaling.scale < 0;  // the lowest value has the highest raw value
  std::array<std::optional<double>, 2> limits;
  for (std::size_t i = 0; i < limits.size(); ++i) {
    const char* const key = i == 0 ? "low" : "high";
    limits[i] = read_finite(section, key);
    if (!limits[i]) {
      continue;
    }
    std::vector<std::byte>& raw = (i == 0) != turned ? variable.low_limit : variable.high_limit;
    const auto fault = image::raw_of_scaled(variable.scaling, variable.type, bits, *limits[i], raw);
    bool& formula = (i == 0) != turned ? variable.notes.low_formula : variable.notes.high_formula;
    formula = formula && fault != image::ScalingFault::none;
    if (fault != image::ScalingFault::none) {
      findings.error(place_of(section.find(key)), std::string(key) + " of " + std::string(what) +
                                                      ' ' + std::string(image::describe(fault)) +
                                                      ' ' + std::string(od::name(variable.type)));
    }
  }
  if (limits[0] && limits[1] && *limits[0] > *limits[1]) {
    findings.error(place_of(section.find("low")), "low is above high");
  }
}

namespace {

// An object by its address or by its name in the device file.
od::VariableDescription* object_of(Findings& findings, const YAML::Node& key,
                                   od::DeviceDescription& device) {
  const std::string& text = key.Scalar();
  if (const auto address = parse_address(text)) {
    od::VariableDescription* const variable = find_variable(device, *address);
    if (variable == nullptr) {
      findings.error(place_of(key), device.file + " has no object " + format_address(*address));
    }
    return variable;
  }
  findings.error(
      place_of(key),
      "expected an object such as 6401:1 (index and sub-index hexadecimal), got \"" + text + "\"");
  return nullptr;
}

struct Alias {
  std::string text;
  od::Address address;
  Place place;
};

// Commands find an output by its name or by its address: an alias that reads as an address would be
// taken for that of another object.
std::string_view reading_of_alias(const std::string& text, const od::DeviceDescription& device) {
  return other_reading(text, [&](std::uint16_t index) { return device.find(index) != nullptr; });
}

// The names of objects without an alias follow from the device file.
void check_names(Findings& findings, const od::DeviceDescription& device,
                 const std::vector<Alias>& aliases) {
  const pdo::ObjectNames names(device);
  std::map<std::string, od::Address> known;
  for (const od::ObjectDescription& object : device.objects) {
    for (const od::VariableDescription& variable : object.variables) {
      const od::Address address{object.index, variable.sub};
      if (variable.mappable && variable.alias.empty() && !aliases.empty()) {
        known.try_emplace(names.of(address), address);
      }
    }
  }
  for (const Alias& alias : aliases) {
    if (const auto other = known.find(alias.text); other != known.end()) {
      findings.error(alias.place, "\"" + alias.text + "\" is the name of object " +
                                      format_address(other->second) + " already");
    }
  }
}

void read_meaning(Findings& findings, const YAML::Node& key, const YAML::Node& value,
                  od::DeviceDescription& device, std::map<std::string, std::string>& aliases,
                  std::vector<Alias>& unique) {
  od::VariableDescription* const variable = object_of(findings, key, device);
  if (variable == nullptr) {
    return;
  }
  const std::string what = "object " + key.Scalar() + " (" + variable->name + ")";
  Section section(findings, value, what);
  const YAML::Node alias = section.find("alias");
  if (auto text = section.text(alias)) {
    const auto [other, is_new] = aliases.try_emplace(*text, key.Scalar());
    if (text->empty() || text->size() > kLongestAlias || !is_printable(*text)) {
      findings.error(place_of(alias), "an alias has 1 to " + std::to_string(kLongestAlias) +
                                          " bytes and no control characters");
    } else if (!is_new) {
      findings.error(place_of(alias),
                     "\"" + *text + "\" is the alias of " + other->second + " already");
    } else if (const auto reading = reading_of_alias(*text, device); !reading.empty()) {
      findings.error(place_of(alias), "\"" + *text + "\" reads as " + std::string(reading) +
                                          " in commands: give " + key.Scalar() + " another alias");
    } else {
      unique.push_back({*text, *parse_address(key.Scalar()), place_of(alias)});
    }
    variable->alias = std::move(*text);
  }
  const std::size_t before = findings.errors();
  read_scaling(section, what, *variable);
  if (findings.errors() == before) {
    read_scaled_limits(section, what, *variable);
  } else {
    (void)section.find("low");
    (void)section.find("high");
  }
  section.done();
}

}  // namespace

void read_values(Findings& findings, const YAML::Node& node, od::DeviceDescription& device) {
  if (!node.IsDefined()) {
    return;
  }
  Section section(findings, node, "values");
  if (!section.valid()) {
    return;
  }
  std::map<std::string, std::string> aliases;  // and the object of each
  std::vector<Alias> unique;
  std::set<od::Address> seen;
  for (const auto& pair : node) {
    if (!pair.first.IsScalar()) {
      continue;  // already reported by the section
    }
    const auto address = parse_address(pair.first.Scalar());
    if (address && !seen.insert(*address).second) {
      findings.error(place_of(pair.first),
                     "object " + format_address(*address) + " is there twice");
    }
    read_meaning(findings, pair.first, pair.second, device, aliases, unique);
  }
  check_names(findings, device, unique);
}

}  // namespace linegate::config

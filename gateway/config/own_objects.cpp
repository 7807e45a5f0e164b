// SPDX-License-Identifier: Apache-2.0
// `own_objects:` of a line: application objects in the dictionary of its own node.
#include <algorithm>
#include <set>
#include <string>
#include <utility>

#include "gateway/config/sections.h"
#include "stack/image/scaling.h"

namespace linegate::config {
namespace {

using od::DataType;

DataType read_type(Section& section) {
  DataType type = DataType::none;
  section.choose<DataType>(section.require("type"), type,
                           {{"b", DataType::boolean},      {"i8", DataType::integer8},
                            {"i16", DataType::integer16},  {"i24", DataType::integer24},
                            {"i32", DataType::integer32},  {"i40", DataType::integer40},
                            {"i48", DataType::integer48},  {"i56", DataType::integer56},
                            {"i64", DataType::integer64},  {"u8", DataType::unsigned8},
                            {"u16", DataType::unsigned16}, {"u24", DataType::unsigned24},
                            {"u32", DataType::unsigned32}, {"u40", DataType::unsigned40},
                            {"u48", DataType::unsigned48}, {"u56", DataType::unsigned56},
                            {"u64", DataType::unsigned64}, {"r32", DataType::real32},
                            {"r64", DataType::real64},     {"vs", DataType::visible_string},
                            {"os", DataType::octet_string}});
  return type;
}

// Empty if the key is absent or invalid.
std::vector<std::byte> read_typed(Section& section, const char* key, DataType type) {
  const YAML::Node node = section.find(key);
  const auto text = section.text(node);
  if (!text || type == DataType::none) {
    return {};
  }
  auto value = parse_value(*text, type);
  if (!value) {
    section.findings().error(place_of(node),
                             "\"" + *text + "\" is no " + std::string(od::name(type)));
  }
  return value ? *std::move(value) : std::vector<std::byte>();
}

void read_scaled_default(Section& section, const std::string& what,
                         od::VariableDescription& variable) {
  const YAML::Node node = section.find("default");
  const auto text = section.text(node);
  if (!text) {
    return;
  }
  const auto bits = static_cast<std::uint16_t>(od::bit_size(variable.type));
  const auto number = image::parse_number(*text);
  if (!number || image::raw_of_scaled(variable.scaling, variable.type, bits, *number,
                                      variable.value) != image::ScalingFault::none) {
    section.findings().error(place_of(node), "\"" + *text + "\" is no value of " + what +
                                                 " in its unit: it does not fit " +
                                                 std::string(od::name(variable.type)));
  }
}

line::OwnObject read_own_object(Findings& findings, const YAML::Node& node, od::Address address) {
  line::OwnObject out{.index = address.index, .variable = {}};
  od::VariableDescription& variable = out.variable;
  variable.sub = address.sub;
  variable.name = "Object " + format_address(address);
  Section section(findings, node, format_address(address));
  section.read("name", variable.name);
  variable.type = read_type(section);
  section.read_choice<od::Access>("access", variable.access,
                                  {{"ro", od::Access::ro},
                                   {"wo", od::Access::wo},
                                   {"rw", od::Access::rw},
                                   {"rwr", od::Access::rwr},
                                   {"rww", od::Access::rww},
                                   {"const", od::Access::constant}});
  const std::string what = "object " + format_address(address);
  if (variable.type != DataType::none) {
    read_scaling(section, what, variable);
  } else {
    for (const char* key : {"unit", "scale", "offset"}) {
      (void)section.find(key);  // it is known, whatever the type should be
    }
  }
  if (variable.scaling.is_scaled()) {
    read_scaled_default(section, what, variable);
    read_scaled_limits(section, what, variable);
  } else {
    variable.value = read_typed(section, "default", variable.type);
    variable.low_limit = read_typed(section, "low", variable.type);
    variable.high_limit = read_typed(section, "high", variable.type);
  }
  section.read("map", variable.mappable);
  section.read("store", variable.store);
  section.read("image", out.in_image);
  section.done();
  return out;
}

// As for an alias of an object of a device: commands find an object by its name or its address.
void check_own_names(Findings& findings, const YAML::Node& node,
                     const std::vector<line::OwnObject>& objects) {
  for (const auto& pair : node) {
    const auto address = pair.first.IsScalar() ? parse_address(pair.first.Scalar()) : std::nullopt;
    const YAML::Node name = pair.second.IsMap() ? pair.second["name"] : YAML::Node();
    if (!address || !name.IsDefined() || !name.IsScalar()) {
      continue;
    }
    const std::string_view reading = other_reading(name.Scalar(), [&](std::uint16_t index) {
      return std::ranges::any_of(
          objects, [index](const line::OwnObject& object) { return object.index == index; });
    });
    if (!reading.empty()) {
      findings.error(place_of(name), "\"" + name.Scalar() + "\" reads as " + std::string(reading) +
                                         " in commands: give " + format_address(*address) +
                                         " another name");
    }
  }
}

}  // namespace

void read_own_objects(Section& section, line::LineConfig& config) {
  Findings& findings = section.findings();
  const YAML::Node node = section.find("own_objects");
  if (!node.IsDefined() || !has_own_node(config)) {
    return;  // already reported
  }
  Section list(findings, node, "own_objects");
  std::set<od::Address> seen;
  for (const auto& pair : list.valid() ? node : YAML::Node(YAML::NodeType::Map)) {
    if (!pair.first.IsScalar()) {
      continue;
    }
    list.find(pair.first.Scalar());
    const auto address = parse_address(pair.first.Scalar());
    if (!address || !seen.insert(*address).second) {
      findings.error(place_of(pair.first),
                     address ? format_address(*address) + " is there twice"
                             : "expected an object such as 2100:1 (index and sub-index "
                               "hexadecimal), got \"" +
                                   pair.first.Scalar() + "\"");
      continue;
    }
    const std::size_t before = findings.errors();
    line::OwnObject object = read_own_object(findings, pair.second, *address);
    if (findings.errors() != before) {
      continue;
    }
    const std::string_view fault = line::fault_of(object);
    if (!fault.empty()) {
      findings.error(place_of(pair.first), format_address(*address) + ' ' + std::string(fault));
    } else if (object.variable.store && !config.stores_parameters) {
      findings.error(place_of(pair.first),
                     format_address(*address) + " is to be stored, but the line has no storage");
    }
    config.own_objects.push_back(std::move(object));
  }
  list.done();
  if (list.valid()) {
    check_own_names(findings, node, config.own_objects);
  }
}

}  // namespace linegate::config

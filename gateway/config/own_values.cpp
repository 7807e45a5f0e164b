// SPDX-License-Identifier: Apache-2.0
// `own_values:` and `own_concise_dcf:` of a line: values written to objects of its own node.
#include <algorithm>
#include <string>
#include <utility>

#include "gateway/config/concise_file.h"
#include "gateway/config/sections.h"
#include "gateway/config/value.h"
#include "stack/base/abort_code.h"
#include "stack/od/dictionary.h"
#include "stack/od/objects.h"

namespace linegate::config {
namespace {

void read_concise(Section& section, std::vector<OwnValueSection>& out) {
  const YAML::Node node = section.find("own_concise_dcf");
  const auto text = section.text(node);
  if (!text) {
    return;
  }
  for (manager::ObjectWrite& write : read_concise_file(section.findings(), place_of(node), *text)) {
    out.push_back({.object = write.address,
                   .data = std::move(write.data),
                   .place = place_of(node),
                   .value_place = place_of(node)});
  }
}

void read_value(Section& list, const YAML::Node& key, const YAML::Node& value,
                std::vector<OwnValueSection>& out) {
  Findings& findings = list.findings();
  const auto address = parse_address(key.Scalar());
  if (!address) {
    findings.error(place_of(key),
                   "expected an object such as 1007:0 (index and sub-index hexadecimal), got \"" +
                       key.Scalar() + "\"");
    return;
  }
  const auto same = [&](const OwnValueSection& other) {
    return other.text && other.object == *address;
  };
  if (std::ranges::any_of(out, same)) {
    findings.error(place_of(key), "object " + format_address(*address) + " is there twice");
    return;
  }
  if (auto text = list.text(value)) {
    out.push_back({.object = *address,
                   .text = std::move(text),
                   .place = place_of(key),
                   .value_place = place_of(value)});
  }
}

// The object with its name in the dictionary: "5F41:08 (Default PDO event time)".
std::string called(const od::Dictionary& dictionary, od::Address address) {
  return format_address(address) + " (" + std::string(dictionary.name(address)) + ")";
}

// The value by the type of the object; nothing, after an error, if it does not fit.
std::optional<std::vector<std::byte>> bytes_of(Findings& findings, const OwnValueSection& section,
                                               const od::Dictionary& dictionary) {
  const auto variable = dictionary.find(section.object);
  if (!variable) {
    findings.error(section.place, "the own node has no object " + format_address(section.object));
    return std::nullopt;
  }
  if (variable->access == od::Access::wo || !od::writable(variable->access)) {
    findings.error(section.place, "object " + called(dictionary, section.object) +
                                      " cannot have a value: its access is " +
                                      (od::writable(variable->access) ? "write" : "read") +
                                      "-only");
    return std::nullopt;
  }
  auto data = section.text ? parse_value(*section.text, variable->type) : section.data;
  if (!data) {
    findings.error(section.value_place, "\"" + *section.text + "\" is no " +
                                            std::string(od::name(variable->type)) + " for object " +
                                            called(dictionary, section.object));
  }
  return data;
}

void read_values(Section& section, const YAML::Node& node, std::vector<OwnValueSection>& out) {
  if (!node.IsDefined()) {
    return;
  }
  Section list(section.findings(), node, "own_values");
  if (!list.valid()) {
    return;
  }
  for (const auto& pair : node) {
    if (pair.first.IsScalar()) {
      list.find(pair.first.Scalar());
      read_value(list, pair.first, pair.second, out);
    }
  }
}

// COB-IDs of SYNC, TIME and EMCY must be known before the PDOs are checked against them.
void place_services(const std::vector<OwnValueSection>& values, line::LineConfig& config) {
  for (const OwnValueSection& value : values) {
    const std::uint16_t index = value.object.index;
    if (index != od::objects::kSyncCobId && index != od::objects::kTimeCobId &&
        index != od::objects::kEmcyCobId) {
      continue;
    }
    if (auto data = value.text ? parse_value(*value.text, od::DataType::unsigned32) : value.data) {
      config.own_values.push_back({value.object, *std::move(data)});
    }
  }
}

}  // namespace

std::vector<OwnValueSection> read_own_values(Section& section, line::LineConfig& config) {
  std::vector<OwnValueSection> out;
  const YAML::Node node = section.find("own_values");
  if (!has_own_node(config)) {
    section.find("own_concise_dcf");
    return out;  // already reported
  }
  read_concise(section, out);
  read_values(section, node, out);
  place_services(out, config);
  return out;
}

// Makes the line once and writes the values as its start will.
void resolve_own_values(Findings& findings, std::vector<LineSection>& lines) {
  for (LineSection& section : lines) {
    if (section.own_values.empty()) {
      continue;
    }
    auto made = line::Line::make(section.plan.config);
    if (!made.value) {
      continue;  // already reported
    }
    section.plan.config.own_values.clear();
    od::Dictionary& dictionary = (*made.value)->dictionary();
    for (const OwnValueSection& value : section.own_values) {
      auto data = bytes_of(findings, value, dictionary);
      if (!data) {
        continue;
      }
      const AbortCode why = dictionary.write(value.object, *data);
      if (why != AbortCode::none) {
        findings.error(value.value_place, "the own node refuses the value of object " +
                                              called(dictionary, value.object) + ": " +
                                              std::string(describe(why)));
      }
      section.plan.config.own_values.push_back({value.object, *std::move(data)});
    }
  }
}

}  // namespace linegate::config

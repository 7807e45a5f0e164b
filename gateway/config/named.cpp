// SPDX-License-Identifier: Apache-2.0
// `named:` of a line: topics of its devices with named members.
#include <algorithm>
#include <span>
#include <utility>

#include "bridges/named/described_type.h"
#include "bridges/named/identifiers.h"
#include "bridges/named/ros2_types.h"
#include "gateway/config/entry_names.h"
#include "gateway/config/sections.h"
#include "stack/line/line.h"

namespace linegate::config {
namespace {

// As long as the names that identifiers are made from.
constexpr std::size_t kLongestIdentifier = 128;

void read_aliases(Section& named, NamedSection& out) {
  const YAML::Node node = named.find("aliases");
  if (!node.IsDefined()) {
    return;
  }
  Section section(named.findings(), node, "aliases");
  if (!section.valid()) {
    return;
  }
  for (const auto& pair : node) {
    const auto text = section.text(pair.second);
    if (!pair.first.IsScalar() || !text) {
      continue;
    }
    section.find(pair.first.Scalar());
    if (named::is_identifier(*text) && text->size() <= kLongestIdentifier) {
      out.aliases.push_back({pair.first.Scalar(), *text, place_of(pair.first)});
    } else {
      const std::string guess = named::identifier_of(*text);
      named.findings().error(
          place_of(pair.second),
          "\"" + *text + "\" is no identifier: letters, digits and single underscores between " +
              "them, beginning with a letter, no reserved word, up to " +
              std::to_string(kLongestIdentifier) + " characters" +
              (guess.empty() ? "" : "; did you mean \"" + guess + "\"?"));
    }
  }
}

// Returns false if there is no such entry in the layout.
bool add_alias(Findings& findings, const NamedSection::Alias& alias, const image::Layout& layout,
               LinePlan& plan) {
  const EntryNames names(plan.config, layout);
  const auto found = names.find(alias.entry, false);
  if (const std::string several = names.ambiguity(alias.entry); !several.empty()) {
    findings.error(alias.place, several);
  } else if (!found.empty()) {
    plan.named.aliases.push_back(
        {layout.direction, layout.entries[found.front()].name, alias.identifier});
  }
  return !found.empty();
}

void report(Findings& findings, const Place& place, std::span<const std::string> collisions) {
  for (const std::string& collision : collisions) {
    findings.error(place, collision);
  }
}

// Its topic is published without a description.
void report_not_described(Findings& findings, const Place& place,
                          std::span<const named::DeviceType> types) {
  for (const named::DeviceType& type : types) {
    if (!named::can_be_described(type)) {
      findings.warning(place, "the type of " + type.topic() +
                                  " has too many members, or too long names, to be described over "
                                  "DDS");
    }
  }
}

}  // namespace

NamedSection read_named(Section& line, NamedTopics& named) {
  NamedSection out;
  const YAML::Node node = line.find("named");
  if (!node.IsDefined()) {
    return out;
  }
  out.place = place_of(node);
  if (!node.IsMap()) {
    line.read("named", named.published);
    return out;
  }
  named.published = true;
  Section section(line.findings(), node, "named");
  section.read("min_separation", named.min_separation, Duration::zero(), std::chrono::hours(1));
  const YAML::Node ros2 = section.find("ros2");
  out.ros2_place = place_of(ros2);
  section.read("ros2", named.ros2);
  const YAML::Node described = section.find("type_information");
  out.described_place = place_of(described);
  section.read("type_information", named.type_information);
  read_aliases(section, out);
  section.done();
  return out;
}

void resolve_named(Findings& findings, const NamedSection& section, const line::Line& made,
                   LinePlan& plan) {
  const auto& inputs = made.layout(image::Direction::inputs);
  const auto& outputs = made.layout(image::Direction::outputs);
  for (const NamedSection::Alias& alias : section.aliases) {
    const bool is_input = add_alias(findings, alias, inputs, plan);
    if (!add_alias(findings, alias, outputs, plan) && !is_input) {
      const std::string guess = EntryNames(plan.config, inputs).suggestion(alias.entry);
      findings.error(
          alias.place,
          "there is no input and no output \"" + alias.entry + "\"" +
              (guess.empty() ? EntryNames(plan.config, outputs).suggestion(alias.entry) : guess));
    }
  }
  if (!plan.named.published) {
    return;
  }
  for (const image::Layout* layout : {&inputs, &outputs}) {
    const named::DeviceTypes types =
        named::device_types(plan.config.name, *layout, plan.named.aliases);
    report(findings, section.place, types.collisions);
    if (plan.named.ros2) {
      report(findings, section.ros2_place, named::ros2_types(types.types).collisions);
    }
    if (plan.named.type_information) {
      report_not_described(findings, section.described_place, types.types);
    }
  }
}

}  // namespace linegate::config

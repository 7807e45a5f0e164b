// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <map>
#include <memory>
#include <span>

#include "gateway/config/entry_names.h"
#include "gateway/config/sections.h"
#include "stack/image/scaling.h"
#include "stack/line/line.h"

namespace linegate::config {
namespace {

GroupSection read_group(Findings& findings, const YAML::Node& node, std::size_t position) {
  GroupSection out;
  Section section(findings, node, "a group");
  out.place = section.place();
  const YAML::Node name = section.require("name");
  if (auto text = section.text(name)) {
    check_name(findings, *text, place_of(name), "name");
    out.group.name = std::move(*text);
  }
  out.group.number = static_cast<std::uint16_t>(position + 1);
  section.read_number("number", out.group.number, 0, 0xFFFF);
  section.read_choice<bool>("send", out.group.send_always,
                            {{"on_change", false}, {"always", true}});
  section.read_choice<bool>("written_by", out.by_name, {{"output_write", false}, {"named", true}});
  for (const YAML::Node& entry : elements(findings, section.require("entries"), "entries")) {
    if (auto text = section.text(entry)) {
      out.entries.push_back({std::move(*text), place_of(entry)});
    }
  }
  section.done();
  return out;
}

void resolve_groups(Findings& findings, const OutputsSection& outputs, const EntryNames& names,
                    const image::Layout& layout, LinePlan& plan) {
  line::LineConfig& config = plan.config;
  std::vector<std::string> owner(layout.entries.size());
  for (const auto& section : outputs.groups) {
    line::OutputGroup group = section.group;
    for (const auto& other : config.groups) {
      if (other.number == group.number || other.name == group.name) {
        findings.error(section.place, "group \"" + group.name + "\" has the " +
                                          (other.name == group.name ? "name" : "number") +
                                          " of another");
      }
    }
    for (const auto& reference : section.entries) {
      const auto found = names.find(reference.text, true);
      if (found.empty()) {
        findings.error(reference.place, "there is no output \"" + reference.text + "\"" +
                                            names.suggestion(reference.text));
      }
      for (const auto entry : found) {
        if (!owner[entry].empty()) {
          findings.error(reference.place, "the output \"" + layout.entries[entry].name +
                                              "\" is in group \"" + owner[entry] + "\" already");
        }
        owner[entry] = group.name;
        group.entries.push_back(entry);
      }
    }
    if (section.by_name) {
      plan.named.groups.push_back({group.name, group.number, group.entries});
    }
    config.groups.push_back(std::move(group));
  }
}

// Why the groups that are written by name have no topics.
void check_named_groups(Findings& findings, const OutputsSection& outputs,
                        const image::Layout& layout, const LinePlan& plan) {
  for (const GroupSection& section : outputs.groups) {
    if (!section.by_name) {
      continue;
    }
    const auto group =
        std::ranges::find(plan.named.groups, section.group.name, &named::Group::name);
    if (plan.config.role == line::Role::observer) {
      findings.error(section.place,
                     "written_by: a line in the role observer has no outputs to write");
    } else if (group != plan.named.groups.end()) {
      for (const std::string& collision :
           named::group_types(plan.config.name, layout, std::span(&*group, 1), plan.named.aliases)
               .collisions) {
        findings.error(section.place, collision);
      }
    }
  }
}

// In the unit of a scaled entry.
std::optional<std::vector<std::byte>> default_bytes(const std::string& text,
                                                    const image::Entry& entry) {
  if (!entry.scaling.is_scaled()) {
    auto value = parse_value(text, entry.type);
    const auto raw = value ? image::raw_number(entry.type, entry.bit_length, *value) : std::nullopt;
    const bool beyond = raw && image::check_limits(entry, *raw) != image::ScalingFault::none;
    return beyond ? std::nullopt : value;
  }
  const auto number = image::parse_number(text);
  std::vector<std::byte> out;
  return number && image::raw_of_scaled(entry, *number, out) == image::ScalingFault::none
             ? std::optional(out)
             : std::nullopt;
}

void resolve_defaults(Findings& findings, const OutputsSection& outputs, const EntryNames& names,
                      const image::Layout& layout, line::LineConfig& config) {
  std::map<std::uint32_t, std::string> given;  // by entry: its name here
  for (const auto& section : outputs.defaults) {
    const auto found = names.find(section.entry.text, false);
    if (found.empty()) {
      findings.error(section.entry.place, "there is no output \"" + section.entry.text + "\"" +
                                              names.suggestion(section.entry.text));
      continue;
    }
    if (const std::string several = names.ambiguity(section.entry.text); !several.empty()) {
      findings.error(section.entry.place, several);
      continue;
    }
    const auto& entry = layout.entries[found.front()];
    if (const auto [other, is_new] = given.try_emplace(found.front(), section.entry.text);
        !is_new) {
      findings.error(
          section.entry.place,
          "\"" + section.entry.text + "\" has a default already, as \"" + other->second + "\"");
      continue;
    }
    if (entry.bit_length > 64) {
      findings.error(section.entry.place, "\"" + entry.name + "\" has " +
                                              std::to_string(entry.bit_length) +
                                              " bits: a default has up to 64");
      continue;
    }
    const auto data = default_bytes(section.value, entry);
    if (!data || data->size() > sizeof(std::uint64_t)) {
      findings.error(section.value_place, "\"" + section.value + "\" is no " +
                                              std::string(od::name(entry.type)) + " for \"" +
                                              entry.name + "\"" +
                                              (entry.scaling.is_scaled() || entry.low || entry.high
                                                   ? ", in its unit and within its limits"
                                                   : ""));
      continue;
    }
    line::OutputDefault value{found.front(), 0};
    for (std::size_t i = data->size(); i > 0; --i) {
      value.value = value.value << 8U | std::to_integer<std::uint64_t>((*data)[i - 1]);
    }
    config.defaults.push_back(value);
  }
}

}  // namespace

OutputsSection read_outputs(Findings& findings, const YAML::Node& node) {
  OutputsSection out;
  if (!node.IsDefined()) {
    return out;
  }
  Section section(findings, node, "outputs");
  for (const YAML::Node& group : elements(findings, section.find("groups"), "groups")) {
    out.groups.push_back(read_group(findings, group, out.groups.size()));
  }
  const YAML::Node defaults = section.find("defaults");
  if (defaults.IsDefined()) {
    Section from(findings, defaults, "defaults");
    if (from.valid()) {
      for (const auto& pair : defaults) {
        auto text = from.text(pair.second);
        if (pair.first.IsScalar() && text) {
          from.find(pair.first.Scalar());
          out.defaults.push_back({{pair.first.Scalar(), place_of(pair.first)},
                                  std::move(*text),
                                  place_of(pair.second)});
        }
      }
    }
  }
  section.done();
  return out;
}

void resolve_outputs(Findings& findings, LineSection& section) {
  const auto made = make_line(findings, section);
  if (made == nullptr) {
    return;
  }
  LinePlan& plan = section.plan;
  const auto& layout = made->layout(image::Direction::outputs);
  const EntryNames names(plan.config, layout);
  resolve_history(findings, section.history, *made, plan);
  resolve_named(findings, section.named, *made, plan);
  const std::size_t before = findings.errors();
  resolve_groups(findings, section.outputs, names, layout, plan);
  if (findings.errors() == before) {
    check_named_groups(findings, section.outputs, layout, plan);
  }
  resolve_defaults(findings, section.outputs, names, layout, plan.config);
  if (findings.errors() == before &&
      !(plan.config.groups.empty() && plan.config.defaults.empty())) {
    // Reports the line's own diagnostics about its groups.
    (void)make_line(findings, section);
  }
}

}  // namespace linegate::config

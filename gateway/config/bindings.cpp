// SPDX-License-Identifier: Apache-2.0
// `bind:` of a device: its objects follow entries of an image, or entries follow its objects.
#include <optional>
#include <string>

#include "gateway/config/joined_lines.h"
#include "gateway/config/sections.h"

namespace linegate::config {
namespace {

using image::Direction;

// {entry: ..., when_lost: ...}; returns the entry.
YAML::Node read_binding_options(Findings& findings, const YAML::Node& value, BindingSection& out) {
  Section section(findings, value, "a binding");
  section.read_choice<bool>("when_lost", out.zero_when_lost, {{"hold", false}, {"zero", true}});
  YAML::Node entry = section.require("entry");
  section.done();
  return entry;
}

void read_binding(Findings& findings, const YAML::Node& key, const YAML::Node& value,
                  BindingSection out, std::vector<BindingSection>& bindings) {
  const auto address = key.IsScalar() ? parse_address(key.Scalar()) : std::nullopt;
  if (!address) {
    findings.error(place_of(key), "expected an object such as 6000:1");
    return;
  }
  out.object = *address;
  out.object_place = place_of(key);
  const YAML::Node entry = value.IsMap() ? read_binding_options(findings, value, out) : value;
  if (!entry.IsDefined()) {
    return;  // already reported by the section
  }
  if (!entry.IsScalar() || entry.Scalar().empty()) {
    findings.error(place_of(entry), "expected an entry such as press/axis.6041:0");
    return;
  }
  const std::string& text = entry.Scalar();
  const std::size_t slash = text.find('/');
  out.line = slash == std::string::npos ? "" : text.substr(0, slash);
  out.entry = slash == std::string::npos ? text : text.substr(slash + 1);
  out.entry_place = place_of(entry);
  bindings.push_back(std::move(out));
}

class BindingResolver {
 public:
  BindingResolver(Findings& findings, JoinedLines& lines) : findings_(findings), lines_(lines) {}

  void resolve(std::size_t line, const BindingSection& section) {
    Direction side = Direction::outputs;
    const auto own = find_object(line, section, side);
    const auto other_line =
        section.line.empty() ? line : lines_.find_line(section.line, section.entry_place);
    if (!own || !other_line) {
      return;
    }
    // A TPDO object of the device follows an input; an output follows an RPDO object.
    const Direction wanted = side == Direction::outputs ? Direction::inputs : Direction::outputs;
    const auto other = find_entry(*other_line, section, wanted);
    if (!other) {
      return;
    }
    const bool sends = side == Direction::outputs;
    Binding* const made =
        lines_.join(sends ? *other : *own, sends ? *own : *other, section.entry_place);
    if (made != nullptr) {
      made->when_lost = section.zero_when_lost ? WhenLost::zero : WhenLost::hold;
    }
  }

 private:
  using End = JoinedLines::End;

  std::optional<End> find_object(std::size_t line, const BindingSection& section, Direction& side) {
    for (const Direction direction : {Direction::inputs, Direction::outputs}) {
      const auto& entries = lines_.entries(line, direction);
      for (std::uint32_t i = 0; i < entries.size(); ++i) {
        if (entries[i].node == section.device && entries[i].index == section.object.index &&
            entries[i].sub == section.object.sub) {
          side = direction;
          return End{line, i, section.object_place};
        }
      }
    }
    findings_.error(
        section.object_place,
        "the device has no object " + format_address(section.object) + " that a PDO could carry");
    return std::nullopt;
  }

  std::optional<End> find_entry(std::size_t line, const BindingSection& section,
                                Direction direction) {
    const LinePlan& plan = lines_.line(line).plan;
    if (direction == Direction::outputs && plan.config.role == line::Role::observer) {
      findings_.error(section.entry_place,
                      "line \"" + plan.config.name + "\" is an observer, which writes no outputs");
      return std::nullopt;
    }
    if (const auto found = lines_.find_entry(line, direction, section.entry, section.entry_place)) {
      return End{line, *found, section.entry_place};
    }
    const Direction opposite =
        direction == Direction::inputs ? Direction::outputs : Direction::inputs;
    const std::string object = format_address(section.object);
    if (!lines_.find_entry(line, opposite, section.entry)) {
      findings_.error(section.entry_place,
                      "line \"" + plan.config.name + "\" has no " +
                          (direction == Direction::inputs ? "input" : "output") + " \"" +
                          section.entry + "\"" + lines_.suggestion(line, direction, section.entry));
    } else if (direction == Direction::inputs) {
      findings_.error(section.entry_place, "\"" + section.entry + "\" is an output; " + object +
                                               ", which the device sends, follows an input");
    } else {
      findings_.error(section.entry_place,
                      "\"" + section.entry + "\" is an input; " + object +
                          ", which the device receives, is followed by an output");
    }
    return std::nullopt;
  }

  Findings& findings_;
  JoinedLines& lines_;
};

}  // namespace

void read_bindings(Findings& findings, const YAML::Node& node, std::uint8_t device,
                   std::vector<BindingSection>& bindings) {
  if (!node.IsDefined()) {
    return;
  }
  if (!node.IsMap()) {
    findings.error(place_of(node), "bind is a mapping (\"6000:1: press/axis.6041:0\")");
    return;
  }
  for (const auto& pair : node) {
    read_binding(findings, pair.first, pair.second,
                 {.device = device, .object = {}, .line = {}, .entry = {}}, bindings);
  }
}

void resolve_bindings(Findings& findings, JoinedLines& lines) {
  BindingResolver resolver(findings, lines);
  for (std::size_t line = 0; line < lines.size(); ++line) {
    for (const BindingSection& section : lines.line(line).bindings) {
      resolver.resolve(line, section);
    }
  }
}

}  // namespace linegate::config

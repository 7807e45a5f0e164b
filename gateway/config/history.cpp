// SPDX-License-Identifier: Apache-2.0
// `history:` of a line: the entries whose values the journal stores.
#include <algorithm>

#include "gateway/config/entry_names.h"
#include "gateway/config/sections.h"
#include "stack/line/line.h"

namespace linegate::config {
namespace {

constexpr std::size_t kMostHistory = 1024;  // entries of a line

void read_entries(Findings& findings, const YAML::Node& list, HistorySection& out) {
  for (const YAML::Node& element : elements(findings, list, "history", kMostHistory)) {
    if (element.IsScalar()) {
      out.entries.push_back({element.Scalar(), place_of(element)});
    } else {
      findings.error(place_of(element), "expected the name of an entry of the process image");
    }
  }
}

void add_entries(Findings& findings, const HistorySection::Entry& reference,
                 const std::vector<std::uint32_t>& found, const image::Layout& layout,
                 History& to) {
  constexpr unsigned kMostBits = 64;
  for (const std::uint32_t entry : found) {
    if (layout.entries[entry].bit_length > kMostBits) {
      findings.error(reference.place, "\"" + layout.entries[entry].name +
                                          "\" is longer than the 64 bits of a history");
    }
    History::Entry one{layout.direction, layout.entries[entry].node, layout.entries[entry].name};
    if (std::ranges::find(to.entries, one) == to.entries.end()) {
      to.entries.push_back(std::move(one));
    }
  }
}

}  // namespace

HistorySection read_history(Section& line, History& history) {
  HistorySection out;
  const YAML::Node node = line.find("history");
  if (!node.IsDefined()) {
    return out;
  }
  out.place = place_of(node);
  if (!node.IsMap()) {
    read_entries(line.findings(), node, out);
    return out;
  }
  Section section(line.findings(), node, "history");
  read_entries(line.findings(), section.require("entries"), out);
  section.read("min_interval", history.min_interval, std::chrono::milliseconds(100),
               std::chrono::hours(24));
  section.done();
  return out;
}

void resolve_history(Findings& findings, const HistorySection& section, const line::Line& made,
                     LinePlan& plan) {
  const image::Layout& inputs = made.layout(image::Direction::inputs);
  const image::Layout& outputs = made.layout(image::Direction::outputs);
  const EntryNames input_names(plan.config, inputs);
  const EntryNames output_names(plan.config, outputs);
  for (const HistorySection::Entry& entry : section.entries) {
    const auto found_inputs = input_names.find(entry.text, true);
    const auto found_outputs = output_names.find(entry.text, true);
    if (found_inputs.empty() && found_outputs.empty()) {
      const std::string guess = input_names.suggestion(entry.text);
      findings.error(entry.place,
                     "there is no input and no output \"" + entry.text + "\"" +
                         (guess.empty() ? output_names.suggestion(entry.text) : guess));
    }
    add_entries(findings, entry, found_inputs, inputs, plan.history);
    add_entries(findings, entry, found_outputs, outputs, plan.history);
  }
  if (const std::size_t count = plan.history.entries.size(); count > kMostHistory) {
    findings.error(section.place, "history has " + std::to_string(count) + " entries, up to " +
                                      std::to_string(kMostHistory) + " of a line are possible");
  }
}

}  // namespace linegate::config

// SPDX-License-Identifier: Apache-2.0
// `forward`: builds the forwarding that the configuration would build from such rules.
#include <algorithm>
#include <memory>

#include "tests/plant/scenario_run.h"

namespace linegate::plant {
namespace {

using image::Direction;

// "5.6200:1"
line::Following::Object object_in_plant(const std::string& text) {
  const std::size_t dot = text.find('.');
  if (dot == std::string::npos) {
    throw BadStatement("expected NODE.INDEX:SUB, not '" + text + "'");
  }
  return {static_cast<std::uint8_t>(to_number(text.substr(0, dot))),
          parse_address(text.substr(dot + 1))};
}

std::uint32_t entry_in(const line::Line& line, Direction direction,
                       const line::Following::Object& object) {
  const auto& entries = line.layout(direction).entries;
  const auto found = std::ranges::find_if(entries, [&](const image::Entry& entry) {
    return entry.node == object.node && entry.index == object.address.index &&
           entry.sub == object.address.sub;
  });
  if (found == entries.end()) {
    throw BadStatement(line.config().name + " has no such entry to forward");
  }
  return static_cast<std::uint32_t>(found - entries.begin());
}

}  // namespace

// forward LINE NODE.INDEX:SUB to LINE NODE.INDEX:SUB [zero|stop]
void Scenario::describe_forward(Words& words) {
  if (built_) {
    throw BadStatement("a rule comes before the first 'at'");
  }
  ForwardRule rule;
  rule.from = words.take();
  rule.input = object_in_plant(words.take());
  words.expect("to");
  rule.to = words.take();
  rule.output = object_in_plant(words.take());
  if (words.accept("zero")) {
    rule.when_lost = line::WhenLost::zero;
  } else if (words.accept("stop")) {
    rule.when_lost = line::WhenLost::stop;
  }
  forwards_.push_back(rule);
}

NetworkPlan& Scenario::plan_of(const std::string& line) {
  const auto found = std::ranges::find_if(
      plans_, [&](const NetworkPlan& plan) { return plan.config.name == line; });
  if (found == plans_.end()) {
    throw BadStatement("no line '" + line + "'");
  }
  return *found;
}

void Scenario::plan_forwards() {
  std::uint32_t element = 0;  // one for each rule, whatever its type
  for (const ForwardRule& rule : forwards_) {
    line::LineConfig& from = plan_of(rule.from).config;
    line::LineConfig& to = plan_of(rule.to).config;
    const auto source = line::Line::make(from);
    const auto target = line::Line::make(to);
    if (!source.ok() || !target.ok()) {
      throw BadStatement("a line that cannot be made");
    }
    const std::uint32_t input = entry_in(**source.value, Direction::inputs, rule.input);
    const std::uint32_t output = entry_in(**target.value, Direction::outputs, rule.output);
    const image::Entry& value = (*source.value)->layout(Direction::inputs).entries[input];
    to.bound.push_back(output);
    std::ranges::sort(to.bound);
    followings_[{rule.from, rule.to}].push_back({.input = rule.input,
                                                 .output_entry = output,
                                                 .when_lost = rule.when_lost,
                                                 .forwarded = true});
    const auto address = routing::forward_address(value.type, value.bit_length, element++);
    from.forwarding.objects.push_back(
        {*address, value.name, routing::ForwardedObject::Entry{Direction::inputs, input}});
    to.forwarding.objects.push_back(
        {*address, value.name, routing::ForwardedObject::Entry{Direction::outputs, output}});
  }
}

}  // namespace linegate::plant

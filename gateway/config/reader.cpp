// SPDX-License-Identifier: Apache-2.0
#include "gateway/config/reader.h"

#include <algorithm>
#include <tuple>
#include <utility>

namespace linegate::config {
namespace {

std::string in_quotes(std::string_view text) {
  return '"' + std::string(text) + '"';
}

std::string kind_of(const YAML::Node& node) {
  switch (node.Type()) {
    case YAML::NodeType::Null:
      return "nothing";
    case YAML::NodeType::Scalar:
      return in_quotes(node.Scalar());
    case YAML::NodeType::Sequence:
      return "a list";
    case YAML::NodeType::Map:
      return "a mapping";
    case YAML::NodeType::Undefined:
      break;
  }
  return "nothing";
}

std::string joined(const std::vector<std::string>& names) {
  std::string out;
  for (std::size_t i = 0; i < names.size(); ++i) {
    out += (i == 0 ? "" : i + 1 == names.size() ? " or " : ", ") + names[i];
  }
  return out;
}

}  // namespace

Place place_of(const YAML::Mark& mark) {
  if (mark.is_null()) {
    return {};
  }
  return {static_cast<std::uint32_t>(mark.line + 1), static_cast<std::uint32_t>(mark.column + 1)};
}

Place place_of(const YAML::Node& node) {
  return place_of(node.Mark());
}

void Findings::error(Place place, std::string text) {
  add({{Severity::error, file_, place.line, place.column, std::move(text)}});
}

void Findings::warning(Place place, std::string text) {
  add({{Severity::warning, file_, place.line, place.column, std::move(text)}});
}

void Findings::add(std::vector<Diagnostic> diagnostics) {
  for (auto& d : diagnostics) {
    std::string key = std::to_string(d.line) + ':' + std::to_string(d.column) + ':' + d.file + ':';
    if (there_.insert(std::move(key) + d.text).second) {
      errors_ += d.severity == Severity::error ? 1 : 0;
      diagnostics_.push_back(std::move(d));
    }
  }
}

std::vector<Diagnostic> Findings::take() {
  std::stable_sort(diagnostics_.begin(), diagnostics_.end(), [&](const auto& a, const auto& b) {
    // Findings of the configuration come first: they often explain those in a device file.
    return std::make_tuple(a.file != file_, std::cref(a.file), a.line, a.column) <
           std::make_tuple(b.file != file_, std::cref(b.file), b.line, b.column);
  });
  return std::move(diagnostics_);
}

Section::Section(Findings& findings, const YAML::Node& node, std::string what)
    : findings_(&findings), node_(node), what_(std::move(what)), place_(place_of(node)) {
  valid_ = node_.IsMap();
  if (!valid_) {
    findings_->error(place_, what_ + " is a mapping (\"key: value\"), not " + kind_of(node_));
    return;
  }
  for (const auto& pair : node_) {
    if (!pair.first.IsScalar()) {
      findings_->error(place_of(pair.first), "a key is a word, not " + kind_of(pair.first));
    } else if (!members_.try_emplace(pair.first.Scalar(), Member{pair.first, pair.second}).second) {
      repeated_.push_back(pair.first);
    }
  }
}

YAML::Node Section::find(std::string_view key) {
  std::string name(key);
  const auto member = members_.find(name);
  if (is_known_.insert(name).second) {
    known_.push_back(std::move(name));
  }
  return member == members_.end() ? YAML::Node(YAML::NodeType::Undefined) : member->second.value;
}

YAML::Node Section::require(std::string_view key) {
  YAML::Node value = find(key);
  if (!value.IsDefined() && valid_) {
    findings_->error(place_, what_ + " needs the key " + in_quotes(key));
  }
  return value;
}

std::optional<std::string> Section::text(const YAML::Node& node) {
  if (!node.IsDefined()) {
    return std::nullopt;
  }
  if (!node.IsScalar() || node.Scalar().empty()) {
    findings_->error(place_of(node), "expected a value, got " + kind_of(node));
    return std::nullopt;
  }
  return node.Scalar();
}

std::optional<std::uint64_t> Section::number(const YAML::Node& node, std::uint64_t lowest,
                                             std::uint64_t highest) {
  if (!node.IsDefined()) {
    return std::nullopt;
  }
  const auto value = node.IsScalar() ? parse_unsigned(node.Scalar()) : std::nullopt;
  if (value && *value >= lowest && *value <= highest) {
    return value;
  }
  findings_->error(place_of(node), "expected a number from " + std::to_string(lowest) + " to " +
                                       std::to_string(highest) + ", got " + kind_of(node));
  return std::nullopt;
}

std::optional<Duration> Section::duration(const YAML::Node& node, Duration lowest,
                                          Duration highest) {
  if (!node.IsDefined()) {
    return std::nullopt;
  }
  const auto value = node.IsScalar() ? parse_duration(node.Scalar()) : std::nullopt;
  if (!value) {
    const bool unitless = node.IsScalar() && parse_unsigned(node.Scalar()).has_value();
    findings_->error(place_of(node),
                     unitless ? "the time " + kind_of(node) + " has no unit: write " +
                                    in_quotes(node.Scalar() + "ms") + ", \"us\", \"s\", \"min\""
                              : "expected a time such as 100ms, got " + kind_of(node));
    return std::nullopt;
  }
  if (*value < lowest || *value > highest) {
    findings_->error(place_of(node), "expected a time from " + format_duration(lowest) + " to " +
                                         format_duration(highest) + ", got " + kind_of(node));
    return std::nullopt;
  }
  return value;
}

void Section::read(std::string_view key, std::string& target) {
  if (auto value = text(find(key))) {
    target = std::move(*value);
  }
}

void Section::read(std::string_view key, bool& target) {
  read_choice<bool>(key, target, {{"true", true}, {"false", false}});
}

void Section::read(std::string_view key, Duration& target, Duration lowest, Duration highest) {
  if (const auto value = duration(find(key), lowest, highest)) {
    target = *value;
  }
}

void Section::read_multiple(std::string_view key, Duration& target, Duration unit,
                            Duration highest) {
  const YAML::Node node = find(key);
  const auto value = duration(node, Duration::zero(), highest);
  if (!value) {
    return;
  }
  if (*value % unit != Duration::zero()) {
    findings_->error(place_of(node),
                     "expected a multiple of " + format_duration(unit) + ", got " + kind_of(node));
    return;
  }
  target = *value;
}

void Section::not_one_of(const YAML::Node& node, const std::string& value,
                         const std::vector<std::string>& names) {
  const std::string guess = nearest(value, names);
  findings_->error(place_of(node),
                   "expected " + joined(names) + ", got " + in_quotes(value) +
                       (guess.empty() ? "" : "; did you mean " + in_quotes(guess) + "?"));
}

void Section::done() {
  if (!valid_) {
    return;
  }
  for (const YAML::Node& key : repeated_) {
    findings_->error(place_of(key), "the key " + in_quotes(key.Scalar()) + " is there twice");
  }
  report_unknown();
}

// Lists unknown keys in full up to a plausible number.
void Section::report_unknown() {
  constexpr std::size_t kMost = 100;
  std::size_t unknown = 0;
  for (const auto& pair : node_) {
    if (!pair.first.IsScalar() || is_known_.contains(pair.first.Scalar()) || ++unknown > kMost) {
      continue;
    }
    const std::string& key = pair.first.Scalar();
    const std::string guess = nearest(key, known_);
    findings_->error(place_of(pair.first),
                     "unknown key " + in_quotes(key) + " in " + what_ +
                         (guess.empty() ? "" : "; did you mean " + in_quotes(guess) + "?"));
  }
  if (unknown > kMost) {
    findings_->error(place_, std::to_string(unknown - kMost) + " more unknown keys in " + what_);
  }
}

std::vector<YAML::Node> elements(Findings& findings, const YAML::Node& node, std::string_view what,
                                 std::size_t most) {
  std::vector<YAML::Node> out;
  if (!node.IsDefined()) {
    return out;
  }
  if (!node.IsSequence()) {
    findings.error(place_of(node), std::string(what) + " is a list, not " + kind_of(node));
    return out;
  }
  for (const auto& element : node) {
    if (out.size() == most) {
      findings.error(place_of(element),
                     std::string(what) + " has at most " + std::to_string(most) + " elements");
      break;
    }
    out.push_back(element);
  }
  return out;
}

}  // namespace linegate::config

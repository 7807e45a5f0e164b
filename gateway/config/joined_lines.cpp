// SPDX-License-Identifier: Apache-2.0
#include "gateway/config/joined_lines.h"

#include <algorithm>
#include <numeric>
#include <set>

#include "gateway/config/entry_names.h"

namespace linegate::config {

using image::Direction;

namespace {

// The name of the entry and its type; with its length, if the other one has the same type.
std::string type_text(const image::Entry& entry, const image::Entry& other) {
  std::string out = '"' + entry.name + "\" is " + std::string(od::name(entry.type));
  if (entry.type != other.type) {
    return out;
  }
  const unsigned bits = entry.bit_length;
  return out + (bits % 8 == 0 ? " of " + std::to_string(bits / 8) + " bytes"
                              : " of " + std::to_string(bits) + " bits");
}

}  // namespace

const line::Line& JoinedLines::made(std::size_t line) {
  if (made_[line] == nullptr) {
    made_[line] = *line::Line::make(lines_[line].plan.config).value;  // it could be made before
  }
  return *made_[line];
}

const std::vector<image::Entry>& JoinedLines::entries(std::size_t line, Direction direction) {
  return made(line).layout(direction).entries;
}

const image::Entry& JoinedLines::entry(const End& end, Direction direction) {
  return entries(end.line, direction)[end.entry];
}

std::optional<std::uint32_t> JoinedLines::find_entry(std::size_t line, Direction direction,
                                                     const std::string& text,
                                                     std::optional<Place> place) {
  const EntryNames names(lines_[line].plan.config, made(line).layout(direction));
  const std::vector<std::uint32_t> found = names.find(text, false);
  if (const std::string several = names.ambiguity(text); place && !several.empty()) {
    findings_.error(*place, several);
  }
  return found.empty() ? std::nullopt : std::optional(found.front());
}

std::string JoinedLines::suggestion(std::size_t line, Direction direction,
                                    const std::string& text) {
  return EntryNames(lines_[line].plan.config, made(line).layout(direction)).suggestion(text);
}

std::optional<std::size_t> JoinedLines::find_line(const std::string& name, Place place) {
  std::vector<std::string> names;
  for (std::size_t i = 0; i < lines_.size(); ++i) {
    if (lines_[i].plan.config.name == name) {
      return i;
    }
    names.push_back(lines_[i].plan.config.name);
  }
  const std::string guess = nearest(name, names);
  findings_.error(place, "there is no line \"" + name + "\"" +
                             (guess.empty() ? "" : "; did you mean \"" + guess + "\"?"));
  return std::nullopt;
}

bool JoinedLines::is_free(const End& output) {
  const std::string& name = entry(output, Direction::outputs).name;
  const LinePlan& plan = lines_[output.line].plan;
  const line::LineConfig& target = plan.config;
  if (std::ranges::find(target.bound, output.entry) != target.bound.end() ||
      std::ranges::find(plan.remote_inputs, output.entry, &RemoteInput::output) !=
          plan.remote_inputs.end()) {
    findings_.error(output.place, "\"" + name + "\" follows another input already");
    return false;
  }
  for (const auto& group : target.groups) {
    if (std::ranges::find(group.entries, output.entry) != group.entries.end()) {
      findings_.error(output.place,
                      "\"" + name + "\" is in the output group \"" + group.name + "\"");
      return false;
    }
  }
  return true;
}

Binding* JoinedLines::join(const End& input, const End& output, Place place) {
  const image::Entry& from = entry(input, Direction::inputs);
  const image::Entry& to = entry(output, Direction::outputs);
  if (from.type != to.type || from.bit_length != to.bit_length) {
    findings_.error(place, type_text(from, to) + ", " + type_text(to, from));
    return nullptr;
  }
  if (!is_free(output)) {
    return nullptr;
  }
  line::LineConfig& target = lines_[output.line].plan.config;
  target.bound.push_back(output.entry);
  Binding binding;
  binding.from = name(input.line);
  binding.input = {from.node, {from.index, from.sub}, from.remote_pdo};
  binding.to = target.name;
  binding.output_entry = output.entry;
  binding.input_name = from.name;
  binding.output_name = to.name;
  binding.bits = to.bit_length;
  return &bindings_.emplace_back(std::move(binding));
}

void JoinedLines::reserve_objects() {
  clusters_ = clusters(true);
  for (const LineSection& line : lines_) {
    for (const routing::ForwardedObject& object : line.plan.config.forwarding.objects) {
      reserved_.insert(object.address);
    }
  }
}

std::optional<od::Address> JoinedLines::free_object(od::DataType type, std::uint32_t bits,
                                                    std::size_t line) {
  const auto has = [](const LineSection& section, od::Address address) {
    const auto& objects = section.plan.config.forwarding.objects;
    return std::any_of(objects.begin(), objects.end(),
                       [&](const auto& object) { return object.address == address; });
  };
  const auto taken = [&](od::Address address) {
    if (reserved_.contains(address)) {
      return true;
    }
    for (std::size_t i = 0; i < lines_.size(); ++i) {
      if (clusters_[i] == clusters_[line] && has(lines_[i], address)) {
        return true;
      }
    }
    return false;
  };
  for (std::uint32_t element = 0;; ++element) {
    const auto address = routing::forward_address(type, bits, element);
    if (!address || !taken(*address)) {
      return address;
    }
  }
}

void JoinedLines::finish() {
  for (LineSection& line : lines_) {
    std::sort(line.plan.config.bound.begin(), line.plan.config.bound.end());
  }
  share_executors();
  add_to_sources();
}

std::size_t JoinedLines::line_called(const std::string& name) const {
  const auto found = std::find_if(lines_.begin(), lines_.end(), [&](const LineSection& line) {
    return line.plan.config.name == name;
  });
  return static_cast<std::size_t>(found - lines_.begin());
}

// Each line gets the lowest number among the lines it is joined with.
std::vector<std::size_t> JoinedLines::clusters(bool forwarding_alone) const {
  std::vector<std::size_t> out(lines_.size());
  std::iota(out.begin(), out.end(), std::size_t{0});
  for (std::size_t round = 0; round < lines_.size(); ++round) {
    for (const Binding& binding : bindings_) {
      if (binding.forwarded || !forwarding_alone) {
        std::size_t& a = out[line_called(binding.from)];
        std::size_t& b = out[line_called(binding.to)];
        a = b = std::min(a, b);
      }
    }
  }
  return out;
}

// By entries and objects, because names may change in one of the two lines.
void JoinedLines::add_to_sources() {
  std::vector<std::set<std::string>> parts(lines_.size());
  for (const Binding& binding : bindings_) {
    const std::string part = binding.from + ' ' + std::to_string(binding.input.node) + ':' +
                             format_address(binding.input.address) + '>' + binding.to + ' ' +
                             std::to_string(binding.output_entry) + ' ' +
                             std::string(line::name(binding.when_lost)) +
                             (binding.forwarded ? " forwarded " : " ") +
                             (binding.object ? format_address(*binding.object) : "") + " of " +
                             std::to_string(binding.input.pdo);
    parts[line_called(binding.from)].insert(part);
    parts[line_called(binding.to)].insert(part);
  }
  for (std::size_t i = 0; i < lines_.size(); ++i) {
    for (const routing::ForwardedObject& object : lines_[i].plan.config.forwarding.objects) {
      parts[i].insert(format_address(object.address));
    }
    for (const std::string& part : parts[i]) {
      lines_[i].plan.source += '+' + part;
    }
  }
}

// The first executor, by name, that one of the lines names; otherwise a new one with a name that no
// configuration can contain. Independent of the order of the lines.
void JoinedLines::share_executors() {
  const std::vector<std::size_t> cluster = clusters(true);
  std::vector<std::set<std::string>> named(lines_.size());
  std::vector<std::set<std::string>> all(lines_.size());
  for (std::size_t i = 0; i < lines_.size(); ++i) {
    const LinePlan& plan = lines_[i].plan;
    all[cluster[i]].insert(plan.config.name);
    if (!plan.executor.empty()) {
      named[cluster[i]].insert(plan.executor);
    }
  }
  for (std::size_t i = 0; i < lines_.size(); ++i) {
    std::string& executor = lines_[i].plan.executor;
    if (!executor.empty() || all[cluster[i]].size() < 2) {
      continue;
    }
    if (!named[cluster[i]].empty()) {
      executor = *named[cluster[i]].begin();
      continue;
    }
    for (const std::string& name : all[cluster[i]]) {
      executor += (executor.empty() ? "" : "+") + name;
    }
  }
}

}  // namespace linegate::config

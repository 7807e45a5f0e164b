// `bind:` of a device: its objects follow entries of an image, or entries follow them.
#include <algorithm>
#include <memory>
#include <numeric>

#include "gateway/config/entry_names.h"
#include "gateway/config/sections.h"
#include "stack/line/line.h"

namespace linegate::config {
namespace {

using image::Direction;

// {entry: ..., when_lost: ...}; gives the entry.
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
    return;  // the section has said so
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

class Resolver {
 public:
  Resolver(Findings& findings, std::vector<LineSection>& lines, std::vector<Binding>& bindings)
      : findings_(findings), lines_(lines), bindings_(bindings), made_(lines.size()) {}

  void run() {
    for (std::size_t line = 0; line < lines_.size(); ++line) {
      for (const BindingSection& section : lines_[line].bindings) {
        resolve(line, section);
      }
    }
    for (LineSection& line : lines_) {
      std::sort(line.plan.config.bound.begin(), line.plan.config.bound.end());
    }
    unite_sources();
  }

 private:
  // An entry, by its number in the layout of its line and direction.
  struct End {
    std::size_t line = 0;
    std::uint32_t entry = 0;
    Place place;
  };

  const line::Line& made(std::size_t line) {
    if (made_[line] == nullptr) {
      made_[line] = *line::Line::make(lines_[line].plan.config).value;  // has been made before
    }
    return *made_[line];
  }

  const image::Entry& entry(const End& end, Direction direction) {
    return made(end.line).layout(direction).entries[end.entry];
  }

  void resolve(std::size_t line, const BindingSection& section) {
    Direction side = Direction::outputs;
    const auto own = find_object(line, section, side);
    const auto other_line = find_line(line, section);
    if (!own || !other_line) {
      return;
    }
    // What the device sends follows an input; what it receives is followed by an output.
    const Direction wanted = side == Direction::outputs ? Direction::inputs : Direction::outputs;
    const auto other = find_entry(*other_line, section, wanted);
    if (!other) {
      return;
    }
    const bool sends = side == Direction::outputs;
    add(sends ? *other : *own, sends ? *own : *other, section);
  }

  std::optional<End> find_object(std::size_t line, const BindingSection& section, Direction& side) {
    for (const Direction direction : {Direction::inputs, Direction::outputs}) {
      const auto& entries = made(line).layout(direction).entries;
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

  std::optional<std::size_t> find_line(std::size_t own, const BindingSection& section) {
    if (section.line.empty()) {
      return own;
    }
    std::vector<std::string> names;
    for (std::size_t i = 0; i < lines_.size(); ++i) {
      if (lines_[i].plan.config.name == section.line) {
        return i;
      }
      names.push_back(lines_[i].plan.config.name);
    }
    const std::string guess = nearest(section.line, names);
    findings_.error(section.entry_place,
                    "there is no line \"" + section.line + "\"" +
                        (guess.empty() ? "" : "; did you mean \"" + guess + "\"?"));
    return std::nullopt;
  }

  std::optional<End> find_entry(std::size_t line, const BindingSection& section,
                                Direction direction) {
    const LinePlan& plan = lines_[line].plan;
    if (direction == Direction::outputs && plan.config.role == line::Role::observer) {
      findings_.error(section.entry_place,
                      "line \"" + plan.config.name + "\" is an observer, which writes no outputs");
      return std::nullopt;
    }
    const EntryNames names(plan.config, made(line).layout(direction));
    const auto found = names.find(section.entry, false);
    if (!found.empty()) {
      return End{line, found.front(), section.entry_place};
    }
    const Direction opposite =
        direction == Direction::inputs ? Direction::outputs : Direction::inputs;
    const bool turned =
        !EntryNames(plan.config, made(line).layout(opposite)).find(section.entry, false).empty();
    const std::string object = format_address(section.object);
    if (!turned) {
      findings_.error(section.entry_place,
                      "line \"" + plan.config.name + "\" has no " +
                          (direction == Direction::inputs ? "input" : "output") + " \"" +
                          section.entry + "\"" + names.suggestion(section.entry));
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

  void add(const End& input, const End& output, const BindingSection& section) {
    const image::Entry& from = entry(input, Direction::inputs);
    const image::Entry& to = entry(output, Direction::outputs);
    if (from.type != to.type || from.bit_length != to.bit_length) {
      findings_.error(section.entry_place, "\"" + from.name + "\" is " +
                                               std::string(od::name(from.type)) + ", \"" + to.name +
                                               "\" is " + std::string(od::name(to.type)));
      return;
    }
    line::LineConfig& target = lines_[output.line].plan.config;
    if (std::find(target.bound.begin(), target.bound.end(), output.entry) != target.bound.end()) {
      findings_.error(output.place, "\"" + to.name + "\" follows another input already");
      return;
    }
    for (const auto& group : target.groups) {
      if (std::find(group.entries.begin(), group.entries.end(), output.entry) !=
          group.entries.end()) {
        findings_.error(output.place,
                        "\"" + to.name + "\" is in the output group \"" + group.name + "\"");
        return;
      }
    }
    target.bound.push_back(output.entry);
    bindings_.push_back({.from = lines_[input.line].plan.config.name,
                         .input = {from.node, {from.index, from.sub}},
                         .to = target.name,
                         .output_entry = output.entry,
                         .zero_when_lost = section.zero_when_lost,
                         .input_name = from.name,
                         .output_name = to.name});
  }

  std::size_t line_called(const std::string& name) const {
    const auto found = std::find_if(lines_.begin(), lines_.end(), [&](const LineSection& line) {
      return line.plan.config.name == name;
    });
    return static_cast<std::size_t>(found - lines_.begin());
  }

  // Every line gets the lowest number among those it is bound to.
  std::vector<std::size_t> clusters() const {
    std::vector<std::size_t> out(lines_.size());
    std::iota(out.begin(), out.end(), std::size_t{0});
    for (std::size_t round = 0; round < lines_.size(); ++round) {
      for (const Binding& binding : bindings_) {
        std::size_t& a = out[line_called(binding.from)];
        std::size_t& b = out[line_called(binding.to)];
        a = b = std::min(a, b);
      }
    }
    return out;
  }

  void unite_sources() {
    const std::vector<std::size_t> cluster = clusters();
    std::vector<std::string> united(lines_.size());
    for (std::size_t i = 0; i < lines_.size(); ++i) {
      united[cluster[i]] += lines_[i].plan.source;
    }
    for (std::size_t i = 0; i < lines_.size(); ++i) {
      lines_[i].plan.source = united[cluster[i]];
    }
  }

  Findings& findings_;
  std::vector<LineSection>& lines_;
  std::vector<Binding>& bindings_;
  std::vector<std::unique_ptr<line::Line>> made_;
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

void resolve_bindings(Findings& findings, std::vector<LineSection>& lines,
                      std::vector<Binding>& bindings) {
  Resolver(findings, lines, bindings).run();
}

}  // namespace linegate::config

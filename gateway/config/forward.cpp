// SPDX-License-Identifier: Apache-2.0
// `forward:`: rules that copy values from one line to another.
#include <algorithm>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <tuple>
#include <utility>
#include <vector>

#include "gateway/config/joined_lines.h"
#include "gateway/config/sections.h"
#include "stack/line/outputs.h"

namespace linegate::config {
namespace {

using image::Direction;

constexpr std::string_view kArrow = "->";

constexpr std::pair<const char*, std::uint8_t> kReactions[] = {
    {"zero", line::kZeroOutputs},
    {"nmt_pre_operational", line::kNmtPreOperational},
    {"nmt_stop", line::kNmtStop},
    {"nmt_reset_communication", line::kNmtResetCommunication},
    {"nmt_reset_node", line::kNmtResetNode},
    {"emcy", line::kSendEmcy},
    {"heartbeat_off", line::kHeartbeatOff},
};

// "press.axis1.Position" or "press/axis1.Position". Names of lines contain neither dot nor slash.
std::optional<ForwardSection::End> parse_end(std::string_view text, Place place) {
  const std::size_t split = text.find_first_of("./");
  if (split == std::string_view::npos || split == 0 || split + 1 == text.size()) {
    return std::nullopt;
  }
  return ForwardSection::End{std::string(text.substr(0, split)),
                             std::string(text.substr(split + 1)), place, std::string(text)};
}

std::optional<ForwardSection::End> read_end(Findings& findings, std::string_view text,
                                            Place place) {
  auto end = parse_end(text, place);
  if (!end) {
    findings.error(place, "expected LINE.NODE.OBJECT, such as press.axis.Position");
  }
  return end;
}

// Position within a scalar; a quoted scalar begins with its quote.
Place place_within(const YAML::Node& scalar, std::size_t offset) {
  Place place = place_of(scalar);
  place.column += static_cast<std::uint32_t>(offset + (scalar.Tag() == "!" ? 1 : 0));
  return place;
}

bool read_arrow(Findings& findings, const YAML::Node& node, ForwardSection& out) {
  constexpr std::string_view kBlanks = " \t";
  const std::string& text = node.Scalar();
  const std::size_t arrow = text.find(kArrow);
  const std::size_t last =
      arrow == std::string::npos ? arrow : text.find_last_not_of(kBlanks, arrow - 1);
  const std::size_t next =
      arrow == std::string::npos ? arrow : text.find_first_not_of(kBlanks, arrow + kArrow.size());
  if (arrow == 0 || last == std::string::npos || next == std::string::npos) {
    findings.error(place_of(node), "expected LINE.NODE.OBJECT -> LINE.NODE.OBJECT");
    return false;
  }
  const auto from = read_end(findings, std::string_view(text).substr(0, last + 1), place_of(node));
  const auto to = read_end(findings, std::string_view(text).substr(next), place_within(node, next));
  if (!from || !to) {
    return false;
  }
  out.from = *from;
  out.to = *to;
  return true;
}

// What happens when the source is lost: one word, or several reactions (GATEWAY/LINE.NODE.OBJECT).
void read_when_lost(Section& section, const YAML::Node& node, ForwardSection& out) {
  if (!node.IsDefined()) {
    return;
  }
  out.when_lost_place = place_of(node);
  std::vector<YAML::Node> words{node};
  if (node.IsSequence()) {
    words = elements(section.findings(), node, "when_lost");
  }
  for (const YAML::Node& word : words) {
    const auto text = section.text(word);
    if (!text) {
      continue;
    }
    std::vector<std::string> names{"hold", "stop"};
    for (const auto& [name, bit] : kReactions) {
      names.emplace_back(name);
      if (*text == name) {
        out.reactions = static_cast<std::uint8_t>(out.reactions | bit);
      }
    }
    if (std::ranges::find(names, *text) == names.end()) {
      section.not_one_of(word, *text, names);
    }
    out.reaction_words.push_back(*text);
  }
  const std::string first = out.reaction_words.empty() ? "" : out.reaction_words.front();
  out.when_lost = first == "zero"   ? WhenLost::zero
                  : first == "stop" ? WhenLost::stop
                                    : WhenLost::hold;
}

bool read_members(Findings& findings, const YAML::Node& node, ForwardSection& out) {
  constexpr Duration kShortestTimeout = std::chrono::milliseconds(100);
  constexpr Duration kLongestTimeout = std::chrono::hours(1);
  Section section(findings, node, "a forwarding rule");
  read_when_lost(section, section.find("when_lost"), out);
  const YAML::Node timeout = section.find("timeout");
  if (timeout.IsDefined()) {
    out.timeout = section.duration(timeout, kShortestTimeout, kLongestTimeout);
    out.timeout_place = place_of(timeout);
  }
  bool good = section.valid();
  for (const auto& [key, end] : {std::pair("from", &out.from), std::pair("to", &out.to)}) {
    const YAML::Node named = section.require(key);
    const auto text = section.text(named);
    const auto read = text ? read_end(findings, *text, place_of(named)) : std::nullopt;
    good = good && read;
    *end = read.value_or(ForwardSection::End{});
  }
  section.done();
  return good;
}

class ForwardResolver {
 public:
  ForwardResolver(Findings& findings, const Plant& plant, const std::vector<ForwardSection>& rules,
                  JoinedLines& lines)
      : findings_(findings), plant_(plant), rules_(rules), lines_(lines) {}

  void run() {
    for (const ForwardSection& rule : rules_) {
      if (const auto from = remote_end(rule.from)) {
        resolve_remote(rule, *from);
      } else {
        resolve(rule);
      }
    }
    show_values();
    make_remote_groups();
  }

 private:
  using End = JoinedLines::End;

  struct Joined {
    std::size_t binding = 0;
    End input;
    End output;
  };

  // The order depends neither on the order of lines and rules nor on names of nodes, so that a
  // line's objects keep their index when another line changes.
  void show_values() {
    const auto key = [this](const Joined& joined) {
      const image::Entry& from = lines_.entry(joined.input, Direction::inputs);
      const image::Entry& to = lines_.entry(joined.output, Direction::outputs);
      return std::tuple(lines_.name(joined.input.line), from.node, from.index, from.sub,
                        from.remote_pdo, lines_.name(joined.output.line), to.node, to.index,
                        to.sub);
    };
    std::sort(joined_.begin(), joined_.end(),
              [&](const Joined& a, const Joined& b) { return key(a) < key(b); });
    lines_.reserve_objects();
    for (const Joined& joined : joined_) {
      lines_.binding(joined.binding).object = make_object(joined.input, joined.output);
    }
  }

  struct RemoteEnd {
    RemoteLine line;
    std::string entry;
  };

  bool has_line(std::string_view name) const {
    for (std::size_t i = 0; i < lines_.size(); ++i) {
      if (lines_.name(i) == name) {
        return true;
      }
    }
    return false;
  }

  // GATEWAY/LINE.NODE.OBJECT. The form LINE/NODE.OBJECT of an end in this gateway has fewer dots,
  // or begins with a line of this gateway.
  std::optional<RemoteEnd> remote_end(const ForwardSection::End& end) const {
    const std::size_t slash = end.text.find_first_of("./");
    const std::size_t dot = end.entry.find_first_of("./");
    if (slash == std::string::npos || end.text[slash] != '/' || has_line(end.line) ||
        dot == std::string::npos || end.entry[dot] != '.' ||
        end.entry.find('.', dot + 1) == std::string::npos) {
      return std::nullopt;
    }
    return RemoteEnd{{end.line, end.entry.substr(0, dot)}, end.entry.substr(dot + 1)};
  }

  void resolve_remote(const ForwardSection& rule, const RemoteEnd& from) {
    if (const auto to = lines_.find_line(rule.to.line, rule.to.place);
        to && check_remote(rule, from)) {
      if (const auto output = find_output(*to, rule)) {
        add_remote(rule, from, *output);
      }
    }
  }

  bool check_remote(const ForwardSection& rule, const RemoteEnd& from) {
    const std::size_t before = findings_.errors();
    const Place place = rule.from.place;
    if (from.line.gateway == plant_.gateway) {
      findings_.error(place, "\"" + from.line.gateway +
                                 "\" is this gateway: name the source as \"" + from.line.line +
                                 '.' + from.entry + "\"");
    } else if (check_name(findings_, from.line.gateway, place, "name of a gateway")) {
      check_name(findings_, from.line.line, place, "name of a line");
    }
    if (std::ranges::find(rule.reaction_words, "stop") != rule.reaction_words.end()) {
      findings_.error(rule.when_lost_place,
                      "when_lost: stop is for a source in this gateway: with one in another "
                      "gateway, its PDO continues; use hold or zero, and emcy or an NMT reaction");
    } else if (!line::valid_reactions(rule.reactions)) {
      findings_.error(rule.when_lost_place, "when_lost has more than one NMT reaction");
    } else if (rule.reaction_words.size() > 1 &&
               std::ranges::find(rule.reaction_words, "hold") != rule.reaction_words.end() &&
               std::ranges::find(rule.reaction_words, "zero") != rule.reaction_words.end()) {
      findings_.error(rule.when_lost_place, "when_lost has both hold and zero");
    }
    return findings_.errors() == before;
  }

  void add_remote(const ForwardSection& rule, const RemoteEnd& from, const End& output) {
    const image::Entry& to = lines_.entry(output, Direction::outputs);
    LinePlan& plan = lines_.line(output.line).plan;
    if (!lines_.is_free(output)) {
      return;
    }
    RemoteInput made{.from = from.line,
                     .entry = from.entry,
                     .output = output.entry,
                     .output_name = to.name,
                     .type = to.type,
                     .bit_length = to.bit_length,
                     .scaling = to.scaling,
                     .reactions = rule.reactions};
    made.timeout = rule.timeout.value_or(made.timeout);
    plan.remote_inputs.push_back(std::move(made));
  }

  // Their numbers are the highest, so that they do not displace those of configured groups.
  void make_remote_groups() {
    for (std::size_t i = 0; i < lines_.size(); ++i) {
      LinePlan& plan = lines_.line(i).plan;
      std::ranges::sort(plan.remote_inputs, {}, &RemoteInput::output);
      std::uint16_t number = 0xFFFF;
      for (RemoteInput& input : plan.remote_inputs) {
        while (std::ranges::find(plan.config.groups, number, &line::OutputGroup::number) !=
               plan.config.groups.end()) {
          --number;
        }
        input.group = number--;
        plan.config.groups.push_back({.number = input.group,
                                      .name = input.source(),
                                      .entries = {input.output},
                                      .forwarded = true});
        plan.source += "+" + input.source() + '>' + std::to_string(input.output) + ' ' +
                       std::to_string(input.timeout.count()) + ' ' +
                       std::to_string(input.reactions);
      }
    }
  }

  void check_local(const ForwardSection& rule) {
    if (rule.timeout) {
      findings_.error(rule.timeout_place,
                      "timeout is for a source in another gateway, GATEWAY/LINE.NODE.OBJECT; in "
                      "this one a late PDO is detected by pdo_deadline of the node");
    }
    const auto is_local = [](const std::string& word) {
      return word == "hold" || word == "zero" || word == "stop";
    };
    if (rule.reaction_words.size() > 1 || !std::ranges::all_of(rule.reaction_words, is_local)) {
      findings_.error(rule.when_lost_place,
                      "when_lost is hold, zero or stop for a source in this gateway");
    }
  }

  void resolve(const ForwardSection& rule) {
    check_local(rule);
    const auto from = lines_.find_line(rule.from.line, rule.from.place);
    const auto to = lines_.find_line(rule.to.line, rule.to.place);
    if (!from || !to) {
      return;
    }
    const auto input = find_input(*from, rule);
    const auto output = find_output(*to, rule);
    if (!input || !output) {
      return;
    }
    if (*from == *to) {
      findings_.error(rule.to.place, "source and target are on the same line \"" + rule.to.line +
                                         "\": forwarding is between lines");
      return;
    }
    if (!feeds_one(*input, *output)) {
      return;
    }
    if (Binding* const made = lines_.join(*input, *output, rule.to.place)) {
      made->forwarded = true;
      made->when_lost = rule.when_lost;
      joined_.push_back({lines_.last_binding(), *input, *output});
    }
  }

  // Returns an object that exists in both lines and shows the value in their images.
  std::optional<od::Address> make_object(const End& input, const End& output) {
    const image::Entry& value = lines_.entry(input, Direction::inputs);
    const auto object = lines_.free_object(value.type, value.bit_length, input.line);
    const std::string name = lines_.name(input.line) + "." + value.name;
    const auto show = [&](const End& end, Direction direction) {
      line::LineConfig& config = lines_.line(end.line).plan.config;
      if (object && has_own_node(config)) {
        config.forwarding.objects.push_back(
            {*object, name, routing::ForwardedObject::Entry{direction, end.entry}});
      }
    };
    show(input, Direction::inputs);
    show(output, Direction::outputs);
    return object;
  }

  std::optional<End> find_input(std::size_t line, const ForwardSection& rule) {
    const std::string& text = rule.from.entry;
    if (const auto found = lines_.find_entry(line, Direction::inputs, text, rule.from.place)) {
      return End{line, *found, rule.from.place};
    }
    if (!lines_.find_entry(line, Direction::outputs, text)) {
      findings_.error(rule.from.place, "line \"" + rule.from.line + "\" has no input \"" + text +
                                           "\"" + lines_.suggestion(line, Direction::inputs, text));
    } else if (!feeder_of(rule.from)) {
      findings_.error(rule.from.place,
                      "\"" + text + "\" is an output; only inputs can be forwarded");
    } else {
      findings_.error(rule.from.place,
                      "\"" + text + "\" is what another rule writes" +
                          (is_in_circle(rule) ? ", and the rules make a circle" : "") +
                          ": forwarded values are not forwarded again");
    }
    return std::nullopt;
  }

  std::optional<End> find_output(std::size_t line, const ForwardSection& rule) {
    const std::string& text = rule.to.entry;
    if (lines_.line(line).plan.config.role == line::Role::observer) {
      findings_.error(rule.to.place,
                      "line \"" + rule.to.line + "\" is an observer, which writes no outputs");
      return std::nullopt;
    }
    if (const auto found = lines_.find_entry(line, Direction::outputs, text, rule.to.place)) {
      return End{line, *found, rule.to.place};
    }
    if (lines_.find_entry(line, Direction::inputs, text)) {
      findings_.error(rule.to.place,
                      "\"" + text + "\" is an input; the target of a rule is an output");
    } else {
      findings_.error(rule.to.place, "line \"" + rule.to.line + "\" has no output \"" + text +
                                         "\"" + lines_.suggestion(line, Direction::outputs, text));
    }
    return std::nullopt;
  }

  // The rule with that target; nullptr if there is none.
  const ForwardSection* feeder_of(const ForwardSection::End& end) {
    const auto found = std::find_if(rules_.begin(), rules_.end(), [&](const ForwardSection& other) {
      return other.to.line == end.line && other.to.entry == end.entry;
    });
    return found == rules_.end() ? nullptr : &*found;
  }

  bool is_in_circle(const ForwardSection& rule) {
    const ForwardSection* feeder = feeder_of(rule.from);
    for (std::size_t i = 0; feeder != nullptr && i < rules_.size(); ++i) {
      if (feeder == &rule) {
        return true;
      }
      feeder = feeder_of(feeder->from);
    }
    return false;
  }

  // CiA 302-7: the forwarding list belongs to the received PDO. One of CANopen FD may have more
  // values than a classical PDO has room for (OWN).
  bool feeds_one(const End& input, const End& output) {
    if (lines_.line(input.line).plan.config.canopen_fd &&
        !lines_.line(output.line).plan.config.canopen_fd) {
      return true;
    }
    const image::Entry& from = lines_.entry(input, Direction::inputs);
    const image::Entry& to = lines_.entry(output, Direction::outputs);
    const std::tuple key(input.line, from.local_pdo, output.line);
    const auto [fed, first] = fed_.try_emplace(key, output);
    const image::Entry& before = lines_.entry(fed->second, Direction::outputs);
    if (before.local_pdo == to.local_pdo) {
      return true;
    }
    findings_.error(output.place, "the PDO that brings \"" + from.name +
                                      "\" feeds the one with \"" + before.name +
                                      "\" already: one received PDO feeds at most "
                                      "one PDO of another line");
    return false;
  }

  Findings& findings_;
  const Plant& plant_;
  const std::vector<ForwardSection>& rules_;
  JoinedLines& lines_;
  std::map<std::tuple<std::size_t, std::uint16_t, std::size_t>, End> fed_;
  std::vector<Joined> joined_;
};

}  // namespace

std::vector<std::string_view> reaction_words(std::uint8_t reactions) {
  std::vector<std::string_view> out;
  for (const auto& [word, bit] : kReactions) {
    if ((reactions & bit) != 0) {
      out.emplace_back(word);
    }
  }
  return out.empty() ? std::vector<std::string_view>{"hold"} : out;
}

std::vector<ForwardSection> read_forwards(Findings& findings, const YAML::Node& node) {
  std::vector<ForwardSection> out;
  if (!node.IsDefined()) {
    return out;
  }
  for (const YAML::Node& element : elements(findings, node, "forward")) {
    ForwardSection rule;
    const bool good = element.IsScalar() ? read_arrow(findings, element, rule)
                                         : read_members(findings, element, rule);
    if (good) {
      out.push_back(std::move(rule));
    }
  }
  return out;
}

void resolve_forwards(Findings& findings, const Plant& plant,
                      const std::vector<ForwardSection>& rules, JoinedLines& lines) {
  ForwardResolver(findings, plant, rules, lines).run();
}

}  // namespace linegate::config

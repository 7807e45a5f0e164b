#include "bridges/console/lookup.h"

#include <algorithm>
#include <charconv>
#include <chrono>
#include <ostream>

#include "bridges/console/discovery.h"
#include "bridges/console/table.h"

namespace linegate::console {
namespace {

// What a gateway publishes arrives sample by sample; this long after the first nothing is missing.
constexpr Duration kSettle = std::chrono::milliseconds(300);
constexpr Duration kPoll = std::chrono::milliseconds(50);

using Clock = std::chrono::steady_clock;

std::string known_lines(const Model& model) {
  std::string out;
  for (const auto& [id, line] : model.lines()) {
    out += (out.empty() ? "" : ", ") + id.line + " (gateway " + id.gateway + ')';
  }
  return out.empty() ? "none" : out;
}

// As each of them is named where the name alone is not enough, see Model::find().
std::string full_names(const std::vector<const Line*>& lines) {
  std::string out;
  for (const Line* line : lines) {
    out += (out.empty() ? "" : " or ") + line->id.gateway + '/' + line->id.line;
  }
  return out;
}

bool matches(const image::Entry& entry, const std::string& text) {
  const std::size_t dot = text.find('.');
  const std::size_t colon = text.find(':');
  if (dot == std::string::npos || colon == std::string::npos || colon < dot) {
    return false;
  }
  const auto node = parse_number(text.substr(0, dot), 127, false);
  const auto index = parse_number(text.substr(dot + 1, colon - dot - 1), 0xFFFF, true);
  const auto sub = parse_number(text.substr(colon + 1), 0xFF, false);
  return node == entry.node && index == entry.index && sub == entry.sub;
}

}  // namespace

Instant steady_now() {
  return Instant(std::chrono::duration_cast<Duration>(Clock::now().time_since_epoch()));
}

Instant utc_now() {
  return Instant(
      std::chrono::duration_cast<Duration>(std::chrono::system_clock::now().time_since_epoch()));
}

void poll(Context& context, Model& model, Duration timeout) {
  model.at(steady_now());
  context.client.poll(timeout, model);
  model.at(steady_now());
  for (const std::string& warning : model.take_warnings()) {
    context.err << warning << '\n';
  }
}

namespace {

bool poll_until(Context& context, Model& model, const std::function<bool()>& condition) {
  const auto end = Clock::now() + context.wait;
  // At least once, however short the wait and busy the machine.
  for (bool looked = false; !condition(); looked = true) {
    if (looked && Clock::now() >= end) {
      return false;
    }
    poll(context, model, kPoll);
  }
  return true;
}

// Of the lines of that name; otherwise says on context.err why none can be meant. certain: no other
// line can have the name.
const Line* the_one(Context& context, const Model& model, const std::string& name, bool certain) {
  const std::vector<const Line*> found = model.find(name);
  if (found.size() > 1) {
    context.err << "more than one line is meant: " << full_names(found) << '\n';
    return nullptr;
  }
  const std::string unsettled = unsettled_text(context, model);
  if (found.empty() || !found.front()->view) {
    context.err << (name.empty() ? "no gateway was heard of"
                                 : "no line '" + name + "'; lines heard of: " + known_lines(model))
                << (unsettled.empty() ? "" : "; " + unsettled) << '\n';
    return nullptr;
  }
  const Line& line = *found.front();
  if (!certain) {
    context.err << "'" << printable(name) << "' may be ambiguous: "
                << (unsettled.empty() ? "discovery has not ended" : unsettled)
                << "; name the line as " << full_names(found) << ", or use a longer --wait\n";
    return nullptr;
  }
  if (Model::has_namesake(*line.view)) {
    context.err << "more than one gateway is called '" << printable(line.id.gateway)
                << "', and a command reaches all: give each a name of its own\n";
    return nullptr;
  }
  return &line;
}

}  // namespace

bool wait_until(Context& context, Model& model, const std::function<bool()>& condition) {
  const auto end = Clock::now() + context.wait;
  if (!poll_until(context, model, condition)) {
    return false;
  }
  const auto settled = std::min(end, Clock::now() + kSettle);
  while (Clock::now() < settled) {
    poll(context, model, kPoll);
  }
  return true;
}

bool wait_until_settled(Context& context, Model& model, const std::function<bool()>& condition) {
  return poll_until(context, model, [&] { return is_settled(context, model) && condition(); });
}

int completeness(Context& context, const Model& model) {
  const std::string missing = unsettled_text(context, model);
  if (missing.empty()) {
    return kDone;
  }
  context.err << "incomplete: " << missing << '\n';
  return kIncomplete;
}

const Line* find_line(Context& context, Model& model, const std::string& line) {
  const auto received = [&] {
    const auto found = model.find(line);
    return !found.empty() &&
           std::ranges::all_of(found, [](const Line* one) { return one->view.has_value(); });
  };
  const bool full_name = line.find('/') != std::string::npos;
  const bool certain = full_name ? poll_until(context, model, received)
                                 : wait_until_settled(context, model, received);
  return the_one(context, model, line, certain);
}

bool knows_nodes(const Line& line) {
  return std::ranges::count_if(line.nodes, [](const auto& node) {
           return node.second.state.configured;
         }) >= line.view->state.nodes_configured;
}

bool know_nodes(Context& context, Model& model, const Line& line) {
  return wait_until(context, model, [&] { return knows_nodes(line); });
}

std::optional<std::uint64_t> parse_number(const std::string& text, std::uint64_t limit, bool hex) {
  const bool prefixed = text.starts_with("0x") || text.starts_with("0X");
  const char* const begin = text.data() + (prefixed ? 2 : 0);
  const char* const end = text.data() + text.size();
  std::uint64_t value = 0;
  const auto [rest, error] = std::from_chars(begin, end, value, prefixed || hex ? 16 : 10);
  if (begin == end || error != std::errc{} || rest != end || value > limit) {
    return std::nullopt;
  }
  return value;
}

std::optional<NodeRef> parse_node(const std::string& text) {
  const std::size_t colon = text.rfind(':');
  NodeRef out;
  const std::string node = colon == std::string::npos ? text : text.substr(colon + 1);
  out.line = colon == std::string::npos ? "" : text.substr(0, colon);
  out.own = node == "own";
  out.all = node == "all";
  if (out.own || out.all) {
    return out;
  }
  const auto id = parse_number(node, 127, false);
  if (!id || *id == 0) {
    return std::nullopt;
  }
  out.node = static_cast<std::uint8_t>(*id);
  return out;
}

std::optional<NodeRef> line_or_node(Context& context, const std::string& what) {
  if (what.find(':') == std::string::npos) {
    return NodeRef{.line = what, .all = true};
  }
  const auto ref = parse_node(what);
  if (!ref || ref->own) {
    context.err << "'" << printable(what) << "' is not LINE or LINE:NODE, with a node-ID 1..127\n";
    return std::nullopt;
  }
  return ref;
}

std::optional<std::uint32_t> find_entry(Context& context, const image::Layout& layout,
                                        const std::string& entry) {
  std::string names;
  for (std::uint32_t i = 0; i < layout.entries.size(); ++i) {
    if (layout.entries[i].name == entry || matches(layout.entries[i], entry)) {
      return i;
    }
    names += "\n  " + layout.entries[i].name;
  }
  if (const auto number = parse_number(entry, 0xFFFF'FFFF, false);
      number && *number < layout.entries.size()) {
    return static_cast<std::uint32_t>(*number);
  }
  context.err << "no output entry '" << entry << "'; there are:" << names << '\n';
  return std::nullopt;
}

}  // namespace linegate::console

#include "bridges/console/lookup.h"

#include <algorithm>
#include <charconv>
#include <chrono>
#include <ostream>

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

bool wait_until(Context& context, Model& model, const std::function<bool()>& condition) {
  const auto end = Clock::now() + context.wait;
  // At least once, however short the wait and busy the machine.
  for (bool looked = false; !condition(); looked = true) {
    if (looked && Clock::now() >= end) {
      return false;
    }
    poll(context, model, kPoll);
  }
  const auto settled = std::min(end, Clock::now() + kSettle);
  while (Clock::now() < settled) {
    poll(context, model, kPoll);
  }
  return true;
}

const Line* find_line(Context& context, Model& model, const std::string& line) {
  const auto known = [&] {
    const auto found = model.find(line);
    return !found.empty() && found.front()->view.has_value();
  };
  if (!wait_until(context, model, known)) {
    context.err << (line.empty() ? "no gateway was heard of"
                                 : "no line '" + line + "'; lines heard of: " + known_lines(model))
                << '\n';
    return nullptr;
  }
  const std::vector<const Line*> found = model.find(line);
  if (found.size() > 1) {
    context.err << "more than one line is meant: " << full_names(found) << '\n';
    return nullptr;
  }
  return found.front();
}

bool know_nodes(Context& context, Model& model, const Line& line) {
  return wait_until(context, model, [&] {
    return std::ranges::count_if(line.nodes, [](const auto& node) {
             return node.second.state.configured;
           }) >= line.view->state.nodes_configured;
  });
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

// SPDX-License-Identifier: Apache-2.0
#include "bridges/console/lookup.h"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <chrono>
#include <optional>
#include <ostream>

#include "bridges/console/discovery.h"
#include "bridges/console/table.h"
#include "bridges/console/value_text.h"
#include "stack/od/description.h"

namespace linegate::console {
namespace {

// A gateway publishes sample by sample; this long after the first one all have arrived.
constexpr Duration kSettle = std::chrono::milliseconds(300);
constexpr Duration kPoll = std::chrono::milliseconds(50);

using Clock = std::chrono::steady_clock;

std::string known_lines(const Model& model) {
  std::string out;
  for (const auto& [id, line] : model.lines()) {
    out +=
        (out.empty() ? "" : ", ") + printable(id.line) + " (gateway " + printable(id.gateway) + ')';
  }
  return out.empty() ? "none" : out;
}

// The names that distinguish the lines where a plain name is ambiguous, see Model::find().
std::string full_names(const std::vector<const Line*>& lines) {
  std::string out;
  for (const Line* line : lines) {
    out +=
        (out.empty() ? "" : " or ") + printable(line->id.gateway) + '/' + printable(line->id.line);
  }
  return out;
}

// node: a name, which is the beginning of the entry's name, or a node-ID.
bool is_of_node(const image::Entry& entry, const std::string& node) {
  return entry.name.starts_with(node + '.') || parse_number(node, 127, false) == entry.node;
}

bool matches(const image::Entry& entry, const std::string& text) {
  const std::size_t dot = text.find('.');
  if (dot == std::string::npos) {
    return false;
  }
  const auto object = od::parse_address(text.substr(dot + 1));
  return object && object->index == entry.index && object->sub == entry.sub &&
         is_of_node(entry, text.substr(0, dot));
}

std::string described(const image::Layout& layout, std::uint32_t entry) {
  const image::Entry& place = layout.entries[entry];
  return std::to_string(entry) + ": " + printable(place.name) + ", " +
         od::to_text({place.index, place.sub}) + " of node " + std::to_string(place.node) +
         ", its " + image::pdo_text(place.remote_pdo);
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
  for (const std::string& warning : model.pop_warnings()) {
    context.err << warning << '\n';
  }
}

std::string no_gateway_text(const Context& context) {
  const DdsSettings& dds = context.dds;
  const bool secured = !dds.security.empty();
  return "no gateway was found (DDS domain " + std::to_string(dds.domain) + ", " +
         (secured ? "identity " + printable(dds.security) : "without security") +
         (dds.profile.empty() ? "" : ", profile " + printable(dds.profile)) +
         "): check that linegated runs, with this domain and " +
         (secured ? "an identity of the same authority" : "without `security`") +
         " in `dds:` of its plant.yaml; `linegate doctor` with the same options finds the cause";
}

std::string no_line_text(const Context& context, const Model& model, const std::string& name,
                         const std::string& also) {
  const bool none = model.lines().empty() && model.gateways().empty();
  const std::string unsettled = unsettled_text(context, model);
  return (none           ? no_gateway_text(context)
          : name.empty() ? "no line was received"
                         : "no line '" + printable(name) + "'" + also +
                               "; lines found: " + known_lines(model)) +
         (unsettled.empty() ? "" : "; " + unsettled);
}

namespace {

bool poll_until(Context& context, Model& model, const std::function<bool()>& condition,
                Duration most) {
  const auto end = Clock::now() + most;
  // At least once, however short the wait is.
  for (bool looked = false; !condition(); looked = true) {
    if (looked && Clock::now() >= end) {
      return false;
    }
    poll(context, model, kPoll);
  }
  return true;
}
bool poll_until(Context& context, Model& model, const std::function<bool()>& condition) {
  return poll_until(context, model, condition, context.wait);
}

// The only line with that name; otherwise reports the reason on context.err. certain: no line that
// was not received can have the name.
const Line* the_one(Context& context, const Model& model, const std::string& name, bool certain) {
  const std::vector<const Line*> found = model.find(name);
  if (found.size() > 1) {
    context.err << "the name matches more than one line: " << full_names(found) << '\n';
    return nullptr;
  }
  if (found.empty() || !found.front()->view) {
    context.err << no_line_text(context, model, name) << '\n';
    return nullptr;
  }
  const Line& line = *found.front();
  if (!certain) {
    const std::string unsettled = unsettled_text(context, model);
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

bool wait_for_samples(Context& context, Model& model, const std::function<bool()>& condition) {
  return poll_until(context, model, condition, std::min<Duration>(context.wait, kSettle));
}

bool wait_until_settled(Context& context, Model& model, const std::function<bool()>& condition) {
  return poll_until(context, model, [&] { return condition() && is_settled(context, model); });
}

bool is_removed(const Model& model, const Line& line) {
  const auto gateway = model.gateways().find(line.id.gateway);
  return !line.view && gateway != model.gateways().end() &&
         std::none_of(gateway->second.lines.begin(), gateway->second.lines.end(),
                      [&](const auto& present) { return present.first == line.id.line; });
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
  const Lookup result = look_up(context, model, line, [&] { return is_received(model, line); });
  return looked_up(context, model, line, result);
}

bool is_received(const Model& model, const std::string& name) {
  const auto found = model.find(name);
  return !found.empty() &&
         std::ranges::all_of(found, [](const Line* one) { return one->view.has_value(); });
}

Lookup look_up(Context& context, Model& model, const std::string& name,
               const std::function<bool()>& condition) {
  const std::size_t slash = name.find('/');
  if (slash == std::string::npos) {
    return wait_until_settled(context, model, condition) ? Lookup::found : Lookup::timed_out;
  }
  const std::string gateway = name.substr(0, slash);
  std::optional<Clock::time_point> since;  // all lines of the gateway are received
  bool found = false;
  const bool ended = poll_until(context, model, [&] {
    found = condition();
    if (found || !model.find(name).empty() || !has_all_lines(context, model, gateway)) {
      since.reset();
      return found;
    }
    const auto now = Clock::now();
    since = since.value_or(now);
    return now - *since >= context.quiet;
  });
  return found ? Lookup::found : ended ? Lookup::absent : Lookup::timed_out;
}

const Line* looked_up(Context& context, const Model& model, const std::string& name,
                      Lookup result) {
  if (result != Lookup::absent) {
    return the_one(context, model, name, result == Lookup::found);
  }
  context.err << absent_text(model, name) << '\n';
  return nullptr;
}

std::string absent_text(const Model& model, const std::string& name, const std::string& also) {
  const std::size_t slash = name.find('/');
  const std::string gateway = name.substr(0, slash);
  std::string lines;
  for (const auto& [id, line] : model.lines()) {
    if (id.gateway == gateway && !line.gone && line.view) {
      lines += (lines.empty() ? "" : ", ") + printable(id.line);
    }
  }
  return printable(gateway) + " has no line '" + printable(name.substr(slash + 1)) + "'" + also +
         "; its lines: " + lines;
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

bool is_plain_name(const std::string& text) {
  return !text.empty() && std::ranges::all_of(text, [](unsigned char c) {
    return std::isalnum(c) != 0 || c == '-' || c == '_';
  });
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
  const bool number = !node.empty() && node[0] >= '0' && node[0] <= '9';
  const auto id = parse_number(node, 127, false);
  if (id && *id != 0) {
    out.node = static_cast<std::uint8_t>(*id);
  } else if (number || colon == std::string::npos || !is_plain_name(node)) {
    return std::nullopt;
  } else {
    out.name = node;
  }
  return out;
}

bool resolve_node(Context& context, Model& model, const Line& line, NodeRef& ref) {
  if (ref.name.empty()) {
    return true;
  }
  (void)know_nodes(context, model, line);
  for (const auto& [id, node] : line.nodes) {
    if (node.name == ref.name) {
      ref.node = id;
      return true;
    }
  }
  report_no_node(context, line, ref.name);
  return false;
}

void report_no_node(Context& context, const Line& line, const std::string& node) {
  std::string names;
  for (const auto& [id, known] : line.nodes) {
    names += known.name.empty() ? ""
                                : (names.empty() ? "" : ", ") + printable(known.name) + " (" +
                                      std::to_string(id) + ')';
  }
  context.err << "no node '" << printable(node) << "' on " << printable(line.id.line)
              << "; there are: " << (names.empty() ? "none with a name" : names) << '\n';
}

std::optional<NodeRef> line_or_node(Context& context, const std::string& what, OwnNode own) {
  if (what.find(':') == std::string::npos) {
    return NodeRef{.line = what, .all = true};
  }
  const auto ref = parse_node(what);
  if (!ref || (ref->own && own == OwnNode::refused)) {
    context.err << "'" << printable(what) << "' is not LINE or LINE:NODE, with a node-ID 1..127"
                << (own == OwnNode::permitted ? ", a name or own\n" : " or a name\n");
    return std::nullopt;
  }
  return ref;
}

std::optional<od::Address> parse_object(Context& context, const std::string& index,
                                        const std::string& sub) {
  const auto address = od::parse_address(sub.empty() ? index : index + ':' + sub);
  if (!address) {
    context.err << "'" << printable(index + (sub.empty() ? "" : ' ' + sub))
                << "' is not an object: INDEX:SUB or INDEX SUB, hexadecimal, 0..FFFF and 0..FF\n";
  }
  return address;
}

std::optional<ObjectWords> split_object(const std::vector<std::string>& words, std::size_t least,
                                        std::size_t most) {
  if (words.empty()) {
    return std::nullopt;
  }
  const bool whole = words[0].find(':') != std::string::npos;
  const bool room = words.size() >= 2 + least && words.size() > 1;
  const bool has_sub = !whole && room && od::parse_sub(words[1]).has_value();
  const std::size_t behind = words.size() - (has_sub ? 2 : 1);
  if (behind < least || behind > most) {
    return std::nullopt;
  }
  return ObjectWords{words[0],
                     has_sub ? words[1] : "",
                     {words.end() - static_cast<std::ptrdiff_t>(behind), words.end()}};
}

std::string why_ambiguous(const std::vector<std::string>& words) {
  if (words.size() != 3 || words[0].find(':') != std::string::npos || !type_from_name(words[1]) ||
      !od::parse_sub(words[1])) {
    return {};
  }
  const auto read_as = [&](const std::string& object) {
    return "'" + printable(object + ' ' + words[2]) + "'";
  };
  return "'" + printable(words[1]) + "' is a sub-index and a data type: write " +
         read_as(words[0] + ':' + words[1]) + " or " + read_as(words[0] + ":00 " + words[1]);
}

std::optional<std::uint32_t> find_entry(Context& context, const image::Layout& layout,
                                        const std::string& entry) {
  std::vector<std::uint32_t> named;
  std::vector<std::uint32_t> matching;
  for (std::uint32_t i = 0; i < layout.entries.size(); ++i) {
    if (layout.entries[i].name == entry) {
      named.push_back(i);
    }
    if (matches(layout.entries[i], entry)) {
      matching.push_back(i);
    }
  }
  const std::vector<std::uint32_t>& found = named.empty() ? matching : named;
  if (found.size() == 1) {
    return found.front();
  }
  if (const auto number = parse_number(entry, 0xFFFF'FFFF, false);
      found.empty() && number && *number < layout.entries.size()) {
    return static_cast<std::uint32_t>(*number);
  }
  if (!found.empty()) {
    context.err << "'" << printable(entry) << "' is ambiguous; give the number of one:";
    for (const std::uint32_t one : found) {
      context.err << "\n  " << described(layout, one);
    }
    context.err << '\n';
    return std::nullopt;
  }
  context.err << "no output entry '" << printable(entry) << "'; there are:";
  for (const image::Entry& one : layout.entries) {
    context.err << "\n  " << printable(one.name);
  }
  context.err << '\n';
  return std::nullopt;
}

}  // namespace linegate::console

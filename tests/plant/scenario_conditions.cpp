// SPDX-License-Identifier: Apache-2.0
// The conditions of `expect`.
#include <algorithm>
#include <array>

#include "stack/base/byte_order.h"
#include "stack/diagnosis/network_state.h"
#include "stack/od/dictionary.h"

#include "tests/plant/event_words.h"
#include "tests/plant/scenario_run.h"

namespace linegate::plant {

using image::Direction;

Scenario::Shown Scenario::shown(line::Line& line, Direction direction, const std::string& text) {
  const std::size_t dot = text.find('.');
  const auto node = to_number(text.substr(0, dot));
  const od::Address address = parse_address(text.substr(dot + 1));
  const image::Layout& layout = line.layout(direction);
  for (std::size_t i = 0; i < layout.entries.size(); ++i) {
    const image::Entry& entry = layout.entries[i];
    if (entry.node != node || od::Address{entry.index, entry.sub} != address) {
      continue;
    }
    image::Snapshot snapshot;
    line.snapshot(direction, snapshot, world_.now(), false);
    Shown out{.valid = snapshot.is_valid(i), .known = snapshot.is_known(i)};
    snapshot.bytes.resize(snapshot.bytes.size() + 8);
    const std::uint64_t word =
        load_le<std::uint64_t>(snapshot.bytes.data() + entry.bit_offset / 8) >>
        (entry.bit_offset % 8);
    out.value = entry.bit_length >= 64 ? word : word & ((std::uint64_t{1} << entry.bit_length) - 1);
    return out;
  }
  throw BadStatement("no entry " + text + " of the " + std::string(image::name(direction)));
}

namespace {

// Values and validity, of inputs and outputs.
bool same_images(LineSeat& seat, Instant now) {
  return std::ranges::all_of(
      std::array{Direction::inputs, Direction::outputs}, [&](auto direction) {
        image::Snapshot managed;
        image::Snapshot observed;
        seat.line->snapshot(direction, managed, now, false);
        seat.observer->snapshot(direction, observed, now, false);
        return managed.layout_id == observed.layout_id && managed.bytes == observed.bytes &&
               managed.valid == observed.valid;
      });
}

}  // namespace

// expect observer same | node N STATE | heard EVENT-NAME node=N
std::function<bool()> Scenario::observer_condition(Words& words) {
  if (words.accept("same")) {
    return [this] { return same_images(seat(), world_.now()); };
  }
  if (words.accept("node")) {
    const std::uint8_t id = words.node();
    return [this, id, state = words.take()] {
      const line::NodeState node = seat().observer->node_state(id);
      return line::name(node.presence) == state || nmt::name(node.state) == state;
    };
  }
  words.expect("heard");
  return event_condition(words, &LineSeat::observed);
}

void Scenario::expect(Words& words) {
  ++expectations_;
  const bool never = words.accept("no");
  const std::function<bool()> holds = condition(words);
  Instant until = world_.now();
  if (words.accept("within")) {
    until += words.duration();
  }
  bool held = holds();
  while (!held && world_.failure().empty() && world_.step(until)) {
    held = holds();
  }
  held = held || holds();
  if (held == never && world_.failure().empty()) {
    throw BadStatement(never ? "it happened" : "it did not happen");
  }
}

std::function<bool()> Scenario::condition(Words& words) {
  const std::string what = words.peek();
  if (words.accept("node")) {
    const std::uint8_t id = words.node();
    const std::string state = words.take();
    return [this, id, state] {
      const line::NodeState node = seat().line->node_state(id);
      return line::name(node.presence) == state || nmt::name(node.state) == state;
    };
  }
  if (words.accept("manager")) {
    return
        [this, state = words.take()] { return line::name(seat().line->state().manager) == state; };
  }
  if (words.accept("network")) {
    return [this, state = words.take()] {
      const std::uint8_t value = seat().line->state().network;
      return diagnosis::name_of_network_state(value) == state ||
             (state.starts_with("0x") && to_number(state) == value);
    };
  }
  if (words.accept("own")) {
    return
        [this, state = words.take()] { return nmt::name(seat().line->state().own_state) == state; };
  }
  if (words.accept("input")) {
    return image_condition(words, *seat().line, Direction::inputs);
  }
  if (words.accept("output")) {
    return image_condition(words, *seat().line, Direction::outputs);
  }
  if (words.accept("ours")) {
    return ours_condition(words);
  }
  if (words.accept("routing")) {
    return routing_condition(words);
  }
  if (words.accept("boot")) {
    return boot_condition(words);
  }
  if (words.accept("device")) {
    const std::uint8_t id = words.node();
    const od::Address address = words.address();
    words.expect("=");
    return [this, id, address, value = words.number()] {
      DeviceSeat* device = seat().find(id);
      return device != nullptr && device->device->dictionary().number(address) == value;
    };
  }
  if (words.accept("frame")) {
    const auto id = static_cast<std::uint32_t>(words.number());
    const bool any = words.peek() == "within" || words.done();
    const std::vector<std::byte> data = any ? std::vector<std::byte>{} : words.hex();
    return [this, id, any, data, from = frame_cursor_] {
      return std::any_of(seat().frames.begin() + static_cast<long>(from), seat().frames.end(),
                         [&](const can::Frame& f) {
                           return f.id == id && (any || std::ranges::equal(f.bytes(), data));
                         });
    };
  }
  if (words.accept("reply")) {
    return reply_condition(words);
  }
  if (words.accept("observer")) {
    return observer_condition(words);
  }
  return event_condition(words, &LineSeat::events);
}

// A value is only returned for a valid entry.
std::function<bool()> Scenario::image_condition(Words& words, line::Line& line,
                                                Direction direction) {
  const auto look = [this, &line, direction, name = words.take()] {
    return shown(line, direction, name);
  };
  if (words.accept("invalid")) {
    return [look] { return !look().valid; };
  }
  if (words.accept("valid")) {
    return [look] { return look().valid; };
  }
  if (words.accept("known")) {
    return [look] { return look().known; };
  }
  if (words.accept("unknown")) {
    return [look] { return !look().known; };
  }
  words.expect("=");
  return [look, value = words.number()] { return look().valid && look().value == value; };
}

// expect ours input ... | output ... | node N STATE | heard EVENT-NAME node=N
std::function<bool()> Scenario::ours_condition(Words& words) {
  line::Line& line = ours();
  if (words.accept("input")) {
    return image_condition(words, line, Direction::inputs);
  }
  if (words.accept("output")) {
    return image_condition(words, line, Direction::outputs);
  }
  if (words.accept("node")) {
    const std::uint8_t id = words.node();
    return
        [&line, id, state = words.take()] { return nmt::name(line.node_state(id).state) == state; };
  }
  words.expect("heard");
  return event_condition(words, &LineSeat::ours_events);
}

// RESULT = HEX | pattern SIZE | by-sdo | by-pdo NUMBER [update-time | values ENTRY | operational |
// trigger | turn | bus] | pdos NUMBER | boot NODE LETTER | boot NODE booted
line::ReplyData Scenario::reply_data(Words& words) {
  using line::PdoWait;
  constexpr std::pair<std::string_view, PdoWait> kWaits[] = {{"update-time", PdoWait::update_time},
                                                             {"operational", PdoWait::operational},
                                                             {"trigger", PdoWait::trigger},
                                                             {"turn", PdoWait::turn},
                                                             {"bus", PdoWait::bus}};
  if (words.accept("by-sdo")) {
    return line::WrittenBySdo{};
  }
  if (words.accept("by-pdo")) {
    line::WrittenByPdo way{.pdo = static_cast<std::uint16_t>(words.number())};
    for (const auto& [word, wait] : kWaits) {
      way.wait = words.accept(word) ? wait : way.wait;
    }
    if (words.accept("values")) {
      way.wait = PdoWait::values;
      way.missing = {static_cast<std::uint32_t>(words.number())};
    }
    return way;
  }
  if (words.accept("pdos")) {
    return line::TriggeredPdos{static_cast<std::uint16_t>(words.number())};
  }
  if (words.accept("boot")) {
    manager::BootOutcome outcome{.node = words.node()};
    const std::string letter = words.take();
    outcome.letter = letter == "booted" ? manager::kBooted : letter.front();
    return std::vector{outcome};
  }
  std::vector<std::byte> bytes = words.accept("pattern") ? pattern(words.number()) : words.hex();
  return bytes.empty() ? line::ReplyData{} : line::ReplyData{std::move(bytes)};
}

// expect reply NAME ok [RESULT] | abort CODE | refused
std::function<bool()> Scenario::reply_condition(Words& words) {
  const std::string name = words.take();
  const std::string how = words.take();
  if (!tags_.contains(name)) {
    throw BadStatement("there is no command '" + name + "'");
  }
  const auto find = [this, name]() -> const line::Reply* {
    const auto it = seat().replies.find(tags_.at(name));
    return it == seat().replies.end() ? nullptr : &it->second;
  };
  if (how == "ok") {
    const bool any = words.peek() == "within" || words.done();
    const line::ReplyData data = any ? line::ReplyData{} : reply_data(words);
    return [find, any, data] {
      const line::Reply* reply = find();
      return reply != nullptr && reply->ok() && (any || reply->data == data);
    };
  }
  if (how == "abort" || how == "refused") {
    const Domain domain = how == "abort" ? Domain::sdo : Domain::command;
    return [find, domain, code = words.number()] {
      const line::Reply* reply = find();
      return reply != nullptr && reply->error == Error{domain, static_cast<std::uint32_t>(code)};
    };
  }
  if (how == "any") {
    return [find] { return find() != nullptr; };
  }
  throw BadStatement("a reply is ok, abort CODE, refused CODE or any");
}

// expect routing COUNTER = N
std::function<bool()> Scenario::routing_condition(Words& words) {
  using routing::Counters;
  constexpr std::pair<std::string_view, std::uint64_t Counters::*> kTotals[] = {
      {"opened", &Counters::opened},        {"finished", &Counters::finished},
      {"aborted", &Counters::aborted},      {"timed-out", &Counters::timed_out},
      {"refused", &Counters::refused},      {"not-permitted", &Counters::not_permitted},
      {"unexpected", &Counters::unexpected}};
  const std::string which = words.take();
  words.expect("=");
  const std::uint64_t wanted = words.number();
  if (which == "open" || which == "channels") {
    const auto member = which == "open" ? &Counters::open : &Counters::channels;
    return [this, member, wanted] { return seat().line->state().routing.*member == wanted; };
  }
  const auto* it = std::ranges::find(kTotals, which, [](const auto& each) { return each.first; });
  if (it == std::end(kTotals)) {
    throw BadStatement("routing counts no '" + which + "'");
  }
  const auto member = it->second;
  return [this, member, wanted] { return seat().line->state().routing.*member == wanted; };
}

// expect EVENT-NAME [node=N] [MEMBER=N]...
std::function<bool()> Scenario::event_condition(Words& words, std::vector<Event> LineSeat::*told) {
  const std::string kind = words.take();
  std::optional<EventKind> wanted;
  for (std::size_t i = 0; i < kEventKinds; ++i) {
    if (name(static_cast<EventKind>(i)) == kind) {
      wanted = static_cast<EventKind>(i);
    }
  }
  if (!wanted) {
    throw BadStatement("unknown event '" + kind + "'");
  }
  std::optional<std::uint64_t> node;
  std::vector<std::pair<std::string, std::uint64_t>> members;
  while (words.peek().find('=') != std::string::npos) {
    const std::string pair = words.take();
    const std::size_t equals = pair.find('=');
    const std::uint64_t number = to_number(pair.substr(equals + 1));
    const std::string key = pair.substr(0, equals);
    if (key == "node") {
      node = number;
    } else if (member_of(empty_event_data(*wanted), key)) {
      members.emplace_back(key, number);
    } else {
      throw BadStatement("the event " + kind + " has no '" + key + "'");
    }
  }
  const std::size_t from = told == &LineSeat::events     ? event_cursor_
                           : told == &LineSeat::observed ? observed_cursor_
                                                         : ours_cursor_;
  return [this, told, from, wanted, node, members] {
    const std::vector<Event>& events = seat().*told;
    return std::any_of(events.begin() + static_cast<long>(from), events.end(),
                       [&](const Event& event) {
                         return event.kind() == *wanted && (!node || event.node == *node) &&
                                std::ranges::all_of(members, [&](const auto& member) {
                                  return member_of(event.data, member.first) == member.second;
                                });
                       });
  };
}

}  // namespace linegate::plant

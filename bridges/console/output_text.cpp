// SPDX-License-Identifier: Apache-2.0
#include "bridges/console/output_text.h"

#include <array>
#include <string_view>

#include "bridges/console/table.h"
#include "bridges/console/tables.h"
#include "stack/base/assert.h"
#include "stack/line/command.h"

namespace linegate::console {
namespace {

constexpr std::size_t kMostNames = 3;  // entries named in one sentence
constexpr std::string_view kUnknownWay =
    "accepted; the answer has an unknown reason, so it may not be sent yet";
constexpr std::string_view kTurn = "its turn on the bus (SYNC, inhibit time)";

std::string list_of(const std::vector<std::string>& names) {
  std::string out;
  for (std::size_t i = 0; i < names.size() && i < kMostNames; ++i) {
    out += (i == 0 ? "" : ", ") + names[i];
  }
  if (names.size() > kMostNames) {
    out += " and " + std::to_string(names.size() - kMostNames) + " more";
  }
  return out;
}

std::string name_in(const image::Layout* outputs, std::uint32_t entry) {
  return outputs != nullptr && entry < outputs->entries.size()
             ? printable(outputs->entries[entry].name)
             : "entry " + std::to_string(entry);
}

// The entries of the PDO that were never written.
std::vector<std::string> missing_in_pdo(const Area& outputs, std::uint16_t local_pdo) {
  std::vector<std::string> out;
  for (std::uint32_t i = 0; i < outputs.layout->entries.size(); ++i) {
    if (outputs.layout->entries[i].local_pdo == local_pdo && !outputs.known(i)) {
      out.push_back(name_in(&*outputs.layout, i));
    }
  }
  return out;
}

std::string node_text(const Line& line, std::uint8_t id) {
  const auto known = line.nodes.find(id);
  if (known == line.nodes.end()) {
    return {};
  }
  const line::NodeState& state = known->second.state;
  const std::string node = "node " + std::to_string(id);
  if (state.presence != manager::Presence::present) {
    return node + ", which is " + std::string(manager::name(state.presence));
  }
  return state.state == nmt::State::operational
             ? ""
             : node + ", which is " + std::string(nmt::name(state.state));
}

// Why the gateway sends nothing to a node that is shown as Operational.
std::string held_back_text(const Line& line, std::uint8_t id) {
  constexpr char kOtherPdos = 'J';  // boot status, CiA 302-2
  const auto known = line.nodes.find(id);
  const bool other_pdos = known != line.nodes.end() && known->second.state.boot == kOtherPdos;
  return "node " + std::to_string(id) +
         (other_pdos ? ", whose PDOs are not those of the image (boot status J)"
                     : ", which is not confirmed as operational yet");
}

bool is_device(const Line& line) {
  return line.view && line.view->state.role == line::Role::device;
}

// An object of the own node (own_objects): no PDO is held back for it.
bool is_of_own_node(const image::Entry& place) {
  return place.local_pdo == 0 && place.remote_pdo == 0;
}

// The reason that the gateway reports for an entry whose PDO has all values and whose node is
// Operational. The gateway reports none for an entry of no group, as one that follows an input, and
// for those after the first 64 of a group. Other reasons contradict the states that were received:
// they are older or newer.
std::string reported_wait(const Line& line, std::size_t entry, std::uint8_t node) {
  for (const auto& [number, view] : line.groups) {
    for (const line::OutputState::Wait& wait : view.state.waits) {
      if (wait.entry != entry) {
        continue;
      }
      switch (wait.reason) {
        case line::OutputWait::bus:
          return "waits for the bus: no acknowledge";
        case line::OutputWait::trigger:
          return "waits for a trigger of its PDO";
        case line::OutputWait::update_time:
          return "waits for the update time of its PDO";
        case line::OutputWait::turn:
          return "waits for " + std::string(kTurn);
        case line::OutputWait::node:
          return "waits for " + held_back_text(line, node);
        case line::OutputWait::own_node:
          if (is_device(line)) {
            return "waits for node " + std::to_string(node) + " to be operational";
          }
          break;
        case line::OutputWait::value:
        case line::OutputWait::values:
          break;
      }
    }
  }
  return "not sent, reason not reported";
}

}  // namespace

bool names_entries(const line::ReplyData& data) {
  const auto* const way = std::get_if<line::WrittenByPdo>(&data);
  return way != nullptr && !way->missing.empty();
}

bool is_held_back(const line::ReplyData& data) {
  if (!line::bytes_of(data).empty()) {
    return true;
  }
  const auto* const way = std::get_if<line::WrittenByPdo>(&data);
  return way != nullptr &&
         (way->wait == line::PdoWait::values || way->wait == line::PdoWait::operational ||
          way->wait == line::PdoWait::turn || way->wait == line::PdoWait::bus);
}

std::string way_text(const line::ReplyData& data, const image::Layout* outputs) {
  constexpr std::array<std::string_view, line::kPdoWaits> kWaits{
      "",        "update time", "values that were never written", "own node operational",
      "trigger", kTurn,         "the bus: no acknowledge"};
  const auto* const way = std::get_if<line::WrittenByPdo>(&data);
  if (!line::bytes_of(data).empty()) {
    return std::string(kUnknownWay);
  }
  if (way == nullptr) {
    return std::holds_alternative<line::WrittenBySdo>(data) ? "by SDO" : "";
  }
  std::string out = "by PDO " + std::to_string(way->pdo);
  std::vector<std::string> names;
  for (const std::uint32_t entry : way->missing) {
    names.push_back(name_in(outputs, entry));
  }
  if (!names.empty()) {
    return out + ", which waits for: values that were never written: " + list_of(names);
  }
  const std::string_view words = kWaits[static_cast<std::size_t>(way->wait)];
  return words.empty() ? out + ", sent" : out + ", which waits for: " + std::string(words);
}

std::string output_state(const Line& line, std::size_t entry) {
  const Area& outputs = line.areas[static_cast<std::size_t>(image::Direction::outputs)];
  LINEGATE_ASSERT(outputs.layout.has_value() && entry < outputs.layout->entries.size(),
                  "the layout was received and has the entry");
  const image::Entry& place = outputs.layout->entries[entry];
  if (outputs.valid(entry)) {
    const bool may_be_read = is_of_own_node(place) || (is_device(line) && place.remote_pdo == 0);
    return may_be_read ? "written" : "sent";
  }
  if (line.view && line.view->state.role == line::Role::observer) {
    return "not heard since its node's start";
  }
  if (!outputs.known(entry)) {
    return "never written";
  }
  if (is_device(line)) {  // of several devices each has its state, and no PDO is held back
    const std::string device = node_text(line, place.node);
    return device.empty() ? reported_wait(line, entry, place.node) : "waits for " + device;
  }
  const std::vector<std::string> missing =
      is_of_own_node(place) ? std::vector<std::string>() : missing_in_pdo(outputs, place.local_pdo);
  if (!missing.empty()) {
    return "waits for values that were never written: " + list_of(missing);
  }
  if (line.view && line.view->state.own_state != nmt::State::operational) {
    return "waits for own node, which is " + std::string(nmt::name(line.view->state.own_state));
  }
  const std::string node = node_text(line, place.node);
  if (!node.empty()) {
    return "waits for " + node;
  }
  return reported_wait(line, entry, place.node);
}

std::string group_text(const OutputStateView& view) {
  const line::OutputState& state = view.state;
  std::string out = "group " + std::to_string(state.group) +
                    (state.name.empty() ? "" : " (" + printable(state.name) + ')') + ": ";
  if (state.applied == 0) {
    out += "no OutputWrite was applied";
  } else {
    out += "written by " + (state.owner.empty() ? "an unnamed client" : printable(state.owner)) +
           ", " + std::to_string(state.applied) + " times, arming number " +
           std::to_string(state.arming);
  }
  if (state.arming_wanted) {
    out +=
        "; another arming number is needed: the watchdog has fired, or another NMT master was "
        "active";
  } else if (state.deadline != kNever) {
    out += "; the watchdog fires in " + duration_text(state.deadline - view.time);
  }
  if (state.refused != 0) {
    out += "; " + std::to_string(state.refused) + " refused, the last" +
           (state.refused_client.empty() ? "" : " of " + printable(state.refused_client)) + ": " +
           std::string(line::describe(state.refusal));
  }
  if (state.waiting != 0) {
    out += "; " + std::to_string(state.waiting) + " entries wait";
  }
  return out;
}

std::vector<std::string> group_texts(const Line& line) {
  std::vector<std::string> out;
  for (const auto& [number, view] : line.groups) {
    out.push_back(group_text(view));
  }
  return out;
}

}  // namespace linegate::console

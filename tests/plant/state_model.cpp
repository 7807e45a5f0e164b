// SPDX-License-Identifier: Apache-2.0
#include "tests/plant/state_model.h"

#include <algorithm>
#include <utility>

#include "stack/can/cob_id.h"
#include "stack/line/build.h"
#include "stack/nmt/node_control.h"

namespace linegate::plant {
namespace {

using manager::Presence;

// Time after which a boot process has detected that a node does not answer, plus its reset time.
constexpr Duration kAsked = std::chrono::seconds(4);
// The same for a node that is not configured.
constexpr Duration kUnlisted = std::chrono::seconds(10);

bool is_state(std::byte value) {
  constexpr std::array kStates{0x00, 0x04, 0x05, 0x7F};
  return std::ranges::any_of(kStates, [value](int each) { return value == std::byte(each); });
}

}  // namespace

StateModel::StateModel(const line::Line& line) : acts_(line.config().role == line::Role::manager) {
  for (const line::NodeConfig& config : line.config().nodes) {
    Node& node = nodes_[config.id];
    node.configured = true;
    const Duration heartbeat = line::consumer_time(config);
    node.beats = heartbeat > Duration::zero();
    node.guarded = !node.beats && config.guard_time > Duration::zero();
    const Duration control = node.beats ? heartbeat : config.guard_time * config.life_time_factor;
    if (control > Duration::zero()) {
      node.silence = control + config.reset_time + kAsked;
    }
  }
}

void StateModel::before_receive(const can::Frame& frame) {
  const std::uint8_t id = frame.id & can::kMaxNodeId;
  const std::uint32_t service = frame.id - id;
  Node& node = nodes_[id];
  if (frame.extended() || frame.remote()) {
    return;
  }
  if (service == can::kSdoResponseBase) {
    node.received = frame.time;
  } else if (service == can::kErrorControlBase && frame.length == 1 &&
             is_state(frame.data[0] & std::byte{0x7F})) {
    const bool answer = node.beats && !is_state(frame.data[0]);
    const bool was_asked = std::exchange(node.asked, false);
    if (answer && !was_asked) {
      return;  // from a second device: a remote frame has one response
    }
    node.received = frame.time;
    node.answer =
        answer ? static_cast<nmt::State>(frame.data[0] & std::byte{0x7F}) : nmt::State::unknown;
    if (!answer) {
      node.booted = frame.data[0] == std::byte{0};
      node.state = node.booted ? nmt::State::pre_operational
                               : static_cast<nmt::State>(frame.data[0] & std::byte{0x7F});
    }
    node.obeyed = nmt::State::unknown;
    node.obeyed_then = nmt::State::unknown;
    node.requested = nmt::State::unknown;
    if (frame.data[0] != std::byte{0}) {
      if (node.heartbeat != Instant{}) {
        node.longest = std::max(node.longest, frame.time - node.heartbeat);
      }
      node.heartbeat = frame.time;
    }
  }
}

void StateModel::commanded(const line::Line& line, const line::Command& command) {
  const auto* nmt = std::get_if<line::NmtRequest>(&command.request);
  if (nmt == nullptr || nmt->command == nmt::Command::start) {
    return;
  }
  for (std::uint8_t id = can::kMinNodeId; id <= can::kMaxNodeId; ++id) {
    if ((nmt->node == 0 || nmt->node == id) && !line.node_state(id).heartbeat_monitored) {
      nodes_[id].requested = nmt::state_after(nmt->command);
    }
  }
}

void StateModel::sends(const can::Frame& frame) {
  ++sent_;
  const std::uint8_t asked = frame.id & can::kMaxNodeId;
  if (frame.remote() && !frame.extended() && frame.id - asked == can::kErrorControlBase) {
    nodes_[asked].asked = true;
  }
  const auto control = frame.id == can::kNmtId ? nmt::decode_node_control(frame) : std::nullopt;
  if (control) {
    submitted_.push_back({.control = *control, .number = sent_});
  }
  for (std::uint8_t id = can::kMinNodeId; control && id <= can::kMaxNodeId; ++id) {
    if (control->addresses(id)) {
      nodes_[id].booted |= nmt::is_reset(control->command);
      nodes_[id].starts = control->command == nmt::Command::start;
    }
  }
}

void StateModel::ended(const can::Frame& frame, bool by_line, sim::Fate fate) {
  const auto control = frame.id == can::kNmtId ? nmt::decode_node_control(frame) : std::nullopt;
  if (!control) {
    return;
  }
  const auto is_it = [&control](const Submitted& each) {
    return !each.ended && each.control.command == control->command &&
           each.control.node == control->node;
  };
  const auto own = std::ranges::find_if(submitted_, is_it);
  std::uint64_t number = 0;
  if (by_line && own != submitted_.end()) {
    number = own->number;
    own->ended = fate != sim::Fate::doubled;
  }
  commands_.push_back({.control = *control, .number = number, .reached = fate != sim::Fate::lost});
}

void StateModel::flushed() {
  for (Node& node : nodes_) {
    node.starts = false;
    node.requested = nmt::State::unknown;
  }
}

void StateModel::look_at(const line::Line& line,
                         const std::function<nmt::State(std::uint8_t)>& real,
                         std::uint64_t acknowledged) {
  std::erase_if(submitted_,
                [acknowledged](const Submitted& each) { return each.number <= acknowledged; });
  const auto after = [&real](const Command& command, std::uint8_t id) {
    const nmt::State is = command.reached ? real(id) : nmt::State::unknown;
    return is != nmt::State::unknown ? is : nmt::state_after(command.control.command);
  };
  for (Command& command : std::exchange(commands_, {})) {
    for (std::uint8_t id = 0; command.then.size() < nodes_.size(); ++id) {
      command.then.push_back(command.control.addresses(id) ? after(command, id)
                                                           : nmt::State::unknown);
    }
    if (command.number > acknowledged) {
      commands_.push_back(std::move(command));
      continue;
    }
    for (std::uint8_t id = can::kMinNodeId; id <= can::kMaxNodeId; ++id) {
      if (!command.control.addresses(id)) {
        continue;
      }
      Node& node = nodes_[id];
      node.starts &= command.number == 0 || command.control.command != nmt::Command::start;
      const bool requested = node.requested == nmt::state_after(command.control.command);
      if (requested) {
        node.requested = nmt::State::unknown;
      }
      if (requested || !line.node_state(id).heartbeat_monitored) {
        node.obeyed = after(command, id);
        node.obeyed_then = command.then[id];
      }
    }
  }
}

std::string StateModel::compare(const line::NodeState& said, Instant now) const {
  const Node& node = nodes_[said.node];
  const std::string who = "node " + std::to_string(said.node) + ' ';
  if (said.presence != Presence::present) {
    return said.state == nmt::State::unknown
               ? std::string()
               : who + "is " + std::string(line::name(said.presence)) + " and shows " +
                     std::string(nmt::name(said.state));
  }
  const bool by_command = said.cause == manager::StateCause::command;
  const bool unheard = node.booted || !said.heartbeat_monitored;
  const bool assumed =
      by_command &&
      (said.state == node.obeyed || said.state == node.obeyed_then ||
       said.state == node.requested ||
       (unheard && (said.state != nmt::State::operational || node.starts || stopped_)));
  if (!node.guarded && !assumed && said.state != nmt::State::unknown && said.state != node.state &&
      said.state != node.answer) {
    return who + "shows " + std::string(nmt::name(said.state)) + ", its newest message said " +
           std::string(nmt::name(node.state));
  }
  const Duration unwatched = std::max(kUnlisted, 3 * node.longest);
  const Duration allowed = !node.configured             ? unwatched
                           : node.silence == Duration{} ? Duration{}
                           : said.heartbeat_monitored   ? node.silence
                                                        : node.silence + unwatched;
  if (allowed > Duration::zero() && now - node.received > allowed) {
    return who + "is shown as present, and silent for too long";
  }
  return {};
}

std::string StateModel::compare(const line::Line& line, Instant now) const {
  for (const line::NodeConfig& config : line.config().nodes) {
    if (std::string text = acts_ ? compare(line.node_state(config.id), now) : std::string();
        !text.empty()) {
      return text;
    }
  }
  return {};
}

std::string StateModel::compare_all(const line::Line& line, Instant now) const {
  for (std::uint8_t id = can::kMinNodeId; id <= can::kMaxNodeId && acts_; ++id) {
    if (id == line.config().node_id) {
      continue;
    }
    if (std::string text = compare(line.node_state(id), now); !text.empty()) {
      return text;
    }
  }
  return {};
}

}  // namespace linegate::plant

// SPDX-License-Identifier: Apache-2.0
#include "tests/plant/oracles.h"

#include <algorithm>
#include <array>
#include <bitset>
#include <tuple>
#include <vector>

#include "stack/od/objects.h"

#include "tests/plant/words.h"

namespace linegate::plant {
namespace {

std::string check_event_numbers(const std::vector<Event>& events) {
  std::uint64_t next = 1;
  for (const Event& event : events) {
    if (const auto* const lost = event.get<event::EventsLost>()) {
      if (lost->first != next) {
        return "the range of events-lost does not begin at " + std::to_string(next);
      }
      next = lost->last + 1;
      continue;
    }
    if (event.number != next) {
      return "event " + std::to_string(event.number) + " follows " + std::to_string(next - 1);
    }
    ++next;
  }
  return {};
}

std::string check_counters(LineSeat& seat) {
  const line::Counters counters = seat.line->state().counters;
  const std::uint64_t sent = seat.bus.sent(seat.end);
  if (counters.frames_sent < sent) {
    return "the line counts " + std::to_string(counters.frames_sent) + " frames sent, the bus " +
           std::to_string(sent);
  }
  if (counters.frames_received + sent > seat.bus.frames()) {
    return "the line has more frames than were on the bus";
  }
  if (counters.events != seat.events.size() + counters.events_lost && counters.events_lost == 0) {
    return "events emitted and events taken differ";
  }
  return {};
}

// CiA 301 7.2.7.1, with the scheme node::ErrorScheme::number.
std::string check_error_resets(const std::vector<Event>& events) {
  for (const Event& event : events) {
    const auto* const emcy = event.get<event::EmcySent>();
    if (emcy != nullptr && emcy->code == 0 && emcy->error_register != 0) {
      return "an error reset was sent with error register " + std::to_string(emcy->error_register);
    }
  }
  return {};
}

// Only the object of `domain` has such a length.
std::string check_values(const LineSeat& seat) {
  constexpr std::size_t kLong = 40;
  for (const auto& [tag, reply] : seat.replies) {
    if (reply.bytes().size() >= kLong && !seat.reports.contains(tag) &&
        reply.bytes() != pattern(reply.bytes().size())) {
      return "the value that command " + std::to_string(tag) + " read is not as it was written";
    }
  }
  return {};
}

// Until the line has corrected such a device, its mapping is indeed another one; and the observer
// may have lost a frame of the correction.
bool has_other_mapping(const DeviceSeat& seat) {
  return std::ranges::any_of(seat.device->options().defaults, [](const auto& value) {
    return od::objects::is_pdo_mapping(value.first.index);
  });
}

// A node that is not booted may be written: the observer follows the SDO transfer, the line
// corrects the PDO in the next boot.
bool has_switched_off_rpdo(const DeviceSeat& seat) {
  return std::ranges::any_of(std::array{0x1400, 0x1401}, [&](int index) {
    const auto cob_id = seat.device->dictionary().number({static_cast<std::uint16_t>(index), 1});
    return cob_id && (*cob_id & can::CobId::kInvalidBit) != 0;
  });
}

using Nodes = std::bitset<can::kMaxNodeId + 1>;

Nodes with_other_mapping(const LineSeat& seat) {
  Nodes out;
  for (const DeviceSeat& device : seat.devices) {
    out.set(device.device->options().node_id, has_other_mapping(device) || device.was_off);
  }
  return out;
}

// Whether both have the same entries in the same order, without those of these nodes, which may
// have moved the others.
bool is_same_without(const Nodes& nodes, const image::Layout& a, const image::Layout& b) {
  const auto without = [&](std::vector<image::Entry> entries) {
    std::erase_if(entries, [&](const image::Entry& entry) { return nodes[entry.node]; });
    return entries;
  };
  const auto what = [](const image::Entry& entry) {
    return std::tuple(entry.node, entry.index, entry.sub, entry.remote_pdo, entry.bit_length,
                      entry.type);
  };
  return std::ranges::equal(without(a.entries), without(b.entries), {}, what, what);
}

std::string check_observer(const LineSeat& seat) {
  if (seat.bus.sent(seat.observer_end) != 0 || seat.observer->state().counters.frames_sent != 0) {
    return "the observer has sent something";
  }
  Nodes others = with_other_mapping(seat);
  others.set(seat.line->config().node_id, !seat.line->config().own_objects.empty());
  for (const auto direction : {image::Direction::inputs, image::Direction::outputs}) {
    const image::Layout& observed = seat.observer->layout(direction);
    const image::Layout& ours = seat.line->layout(direction);
    if (observed.id != ours.id && (others.none() || !is_same_without(others, observed, ours))) {
      return "the observer has another layout of the " + std::string(image::name(direction));
    }
  }
  return check_event_numbers(seat.observed);
}

// A node that the observer does not show as present has no state from before its disappearance.
std::string check_observed_states(const LineSeat& seat) {
  for (std::uint8_t id = can::kMinNodeId; id <= can::kMaxNodeId; ++id) {
    const line::NodeState said = seat.observer->node_state(id);
    if (said.presence != manager::Presence::present && said.state != nmt::State::unknown) {
      return "observer: node " + std::to_string(id) + " is " +
             std::string(line::name(said.presence)) + " and shows " +
             std::string(nmt::name(said.state));
    }
  }
  return {};
}

nmt::State real_state(LineSeat& seat, std::uint8_t node) {
  if (const DeviceSeat* device = seat.find(node)) {
    return device->device->node().state();
  }
  return seat.ours != nullptr ? seat.ours->node_state(node).state : nmt::State::unknown;
}

std::string check_states(LineSeat& seat) {
  for (const line::NodeConfig& node : seat.line->config().nodes) {
    const line::NodeState said = seat.line->node_state(node.id);
    const nmt::State real = real_state(seat, node.id);
    if (said.heartbeat_monitored && said.presence == manager::Presence::present &&
        said.state != real) {
      return "node " + std::to_string(node.id) + " is " + std::string(nmt::name(real)) +
             ", the line says " + std::string(nmt::name(said.state));
    }
  }
  return {};
}

}  // namespace

std::string check_always(LineSeat& seat, Instant now) {
  for (DeviceSeat& device : seat.devices) {
    device.was_off = device.was_off || has_switched_off_rpdo(device);
  }
  if (std::string text = check_event_numbers(seat.events); !text.empty()) {
    return text;
  }
  if (std::string text = check_observer(seat); !text.empty()) {
    return "observer: " + text;
  }
  if (std::string text = check_event_numbers(seat.ours_events); !text.empty()) {
    return "our devices: " + text;
  }
  for (const auto* events : {&seat.events, &seat.ours_events}) {
    if (std::string text = check_error_resets(*events); !text.empty()) {
      return text;
    }
  }
  if (std::string text = check_counters(seat); !text.empty()) {
    return text;
  }
  if (std::string text = check_values(seat); !text.empty()) {
    return text;
  }
  for (const DeviceSeat& device : seat.devices) {
    if (std::string text = device.model ? device.model->compare(*device.device) : std::string();
        !text.empty()) {
      return text;
    }
  }
  if (seat.duplicate_replies != 0) {
    return "a command got two replies";
  }
  if (std::string text = seat.states->compare_all(*seat.line, now); !text.empty()) {
    return text;
  }
  if (std::string text = check_observed_states(seat); !text.empty()) {
    return text;
  }
  return seat.model->compare(*seat.line, now);
}

std::string check_settled(LineSeat& seat, std::uint64_t commands, Instant now) {
  if (seat.replies.size() != commands) {
    return std::to_string(commands) + " commands, " + std::to_string(seat.replies.size()) +
           " replies";
  }
  if (seat.answers_of_ours && seat.answers_of_ours->any()) {
    return "a command to our devices is not answered";
  }
  if (std::string text = seat.answers_of_ours ? seat.answers_of_ours->check_rest(now) : "";
      !text.empty()) {
    return "our devices: " + text;
  }
  if (std::string text = seat.own_outputs->compare(now, true); !text.empty()) {
    return "own outputs: " + text;
  }
  return check_states(seat);
}

}  // namespace linegate::plant

// SPDX-License-Identifier: Apache-2.0
#include "gateway/publish/peer_emcys.h"

#include <algorithm>
#include <utility>

namespace linegate::gateway {

using routing::GatewayLine;

void PeerEmcys::set_lines(const std::vector<GatewayLine>& lines) {
  std::map<GatewayLine, Line> known = std::exchange(lines_, {});
  for (const GatewayLine& line : lines) {
    lines_[line] = std::move(known[line]);
  }
}

// A state that DDS repeats for late subscribers says nothing about the present.
void PeerEmcys::take_state(const GatewayLine& name, std::uint64_t incarnation, std::int64_t time,
                           std::uint16_t network, Instant now) {
  const auto line = lines_.find(name);
  if (line == lines_.end()) {
    return;
  }
  Line& known = line->second;
  if (known.incarnation != incarnation) {
    known.followed = now;
  } else if (known.time == time) {
    return;
  }
  known.incarnation = incarnation;
  known.time = time;
  known.received = now;
  known.network = network;
}

void PeerEmcys::take_event(const GatewayLine& name, std::uint64_t incarnation,
                           const PeerEvent& event, Instant now) {
  const auto line = lines_.find(name);
  if (line == lines_.end() || !count_number(name, line->second, event) || !event.emcy) {
    return;
  }
  Held held{.incarnation = incarnation,
            .time = event.time,
            .received = now,
            .node = event.node,
            .routed = event.routed,
            .emcy = *event.emcy};
  if (held.routed) {
    std::deque<Held>& before = line->second.held;
    const auto carrier = std::ranges::find_if(before, [&](const Held& each) {
      return !each.routed && each.node == held.node && each.emcy.code == held.emcy.code &&
             each.emcy.error_register == held.emcy.error_register;
    });
    if (carrier != before.end()) {
      before.erase(carrier);
    }
    ++held.emcy.hops;
  }
  hold(name, line->second, std::move(held));
}

// Returns false if the event was seen before.
bool PeerEmcys::count_number(const GatewayLine& name, Line& line, const PeerEvent& event) {
  if (line.stream == event.stream && event.number <= line.number) {
    return false;
  }
  const bool is_next = line.stream != event.stream || event.number == line.number + 1;
  if (!is_next) {
    sink_.take_loss(name, line.network, event.number - line.number - 1);
  }
  line.stream = event.stream;
  line.number = event.number;
  return true;
}

// The oldest one gives way: it is that which is too old first.
void PeerEmcys::hold(const GatewayLine& name, Line& line, Held held) {
  if (line.held.size() >= kMostHeld) {
    line.held.pop_front();
    sink_.take_loss(name, line.network, 1);
  }
  line.held.push_back(std::move(held));
}

Duration PeerEmcys::age_of(const Line& line, const Held& held, Instant now) {
  return Duration{line.time - held.time} + (now - line.received);
}

void PeerEmcys::advance(const Publisher& publisher, Instant now) {
  for (auto& [name, line] : lines_) {
    const auto present = line.held.empty() ? std::nullopt : publisher(name);
    std::deque<Held> later;
    for (Held& each : std::exchange(line.held, {})) {
      const bool is_known = present == each.incarnation && line.incarnation == each.incarnation;
      const Duration since = now - each.received;
      if (since < kForRouted) {
        later.push_back(std::move(each));
      } else if (is_known) {
        pass_on(name, line, each, now);
      } else if (since < kOldest) {
        later.push_back(std::move(each));
      } else {
        sink_.take_loss(name, line.network, 1);
      }
    }
    line.held = std::move(later);
  }
}

void PeerEmcys::pass_on(const GatewayLine& name, Line& line, const Held& held, Instant now) {
  const Duration age = age_of(line, held, now);
  if (age > kOldest) {
    if (age < now - line.followed) {
      sink_.take_loss(name, line.network, 1);
    }
    return;
  }
  routing::ForwardedEmcy emcy = held.emcy;
  emcy.network = emcy.network == 0 ? line.network : emcy.network;
  sink_.take_emcy(name, emcy);
}

// What has waited for kForRouted waits for a sample, or until it is too old.
Instant PeerEmcys::next_wake(Instant now) const {
  Instant out = kNever;
  for (const auto& [name, line] : lines_) {
    for (const Held& each : line.held) {
      const Instant routed = each.received + kForRouted;
      out = std::min(out, routed > now ? routed : std::max(each.received + kOldest, now));
    }
  }
  return out;
}

}  // namespace linegate::gateway

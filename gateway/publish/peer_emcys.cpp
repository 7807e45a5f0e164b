// SPDX-License-Identifier: Apache-2.0
#include "gateway/publish/peer_emcys.h"

#include <algorithm>
#include <array>
#include <utility>

namespace linegate::gateway {

using routing::GatewayLine;
namespace {

// Times of samples are foreign: any two of them.
Duration difference(std::int64_t later, std::int64_t earlier) {
  std::int64_t out = 0;
  if (__builtin_sub_overflow(later, earlier, &out)) {
    return later > earlier ? Duration::max() : Duration::min();
  }
  return Duration{out};
}

// added is not negative.
Duration saturated_sum(Duration to, Duration added) {
  return to > Duration::max() - added ? Duration::max() : to + added;
}

}  // namespace

void PeerEmcys::set_lines(const std::vector<GatewayLine>& lines) {
  std::map<GatewayLine, Line> known = std::exchange(lines_, {});
  for (const GatewayLine& line : lines) {
    lines_[line] = std::move(known[line]);
    lines_[line].limit.share_among(lines.size());
  }
}

// A state that DDS repeats for late subscribers says nothing about the present.
void PeerEmcys::take_state(const GatewayLine& name, std::uint64_t incarnation, std::int64_t time,
                           std::uint16_t network, Instant now) {
  const auto line = lines_.find(name);
  if (line == lines_.end() || incarnation == 0) {
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
  for (Early& each : std::exchange(known.early, {})) {
    if (each.incarnation == incarnation) {
      accept(name, known, each.event, each.received, now);
    } else {
      known.early.push_back(std::move(each));
    }
  }
}

// An event without a number, a stream or an incarnation is no part of a sequence.

void PeerEmcys::take_event(const GatewayLine& name, std::uint64_t incarnation,
                           const PeerEvent& event, Instant now) {
  const auto found = lines_.find(name);
  if (found == lines_.end() || incarnation == 0 || event.stream == 0 || event.number == 0) {
    return;
  }
  Line& line = found->second;
  if (incarnation == line.incarnation) {
    accept(name, line, event, now, now);
    return;
  }
  if (line.early.size() >= kMostHeld) {
    line.early.pop_front();  // it was before that incarnation was followed
  }
  line.early.push_back({.incarnation = incarnation, .received = now, .event = event});
}

void PeerEmcys::accept(const GatewayLine& name, Line& line, const PeerEvent& event,
                       Instant received, Instant now) {
  if (!count_number(name, line, event) || !event.emcy) {
    return;
  }
  Held held{.incarnation = line.incarnation,
            .time = event.time,
            .received = received,
            .node = event.node,
            .routed = event.routed,
            .emcy = *event.emcy};
  if (held.routed) {
    std::deque<Held>& before = line.held;
    const auto carrier = std::ranges::find_if(before, [&](const Held& each) {
      return !each.routed && each.node == held.node && each.emcy.code == held.emcy.code &&
             each.emcy.error_register == held.emcy.error_register;
    });
    if (carrier != before.end()) {
      before.erase(carrier);
    }
    ++held.emcy.hops;
  }
  hold(name, line, std::move(held), now);
}

// Returns false if the event was seen before. A gap between incarnations is no loss
// (idl/README.md).
bool PeerEmcys::count_number(const GatewayLine& name, Line& line, const PeerEvent& event) {
  const auto known = std::ranges::find(line.numbered, line.incarnation, &Numbered::incarnation);
  if (known == line.numbered.end()) {
    if (line.numbered.size() >= kMostNumbered) {
      line.numbered.pop_front();
    }
    line.numbered.push_back({line.incarnation, event.stream, event.number});
    return true;
  }
  if (known->stream == event.stream && event.number <= known->number) {
    return false;
  }
  if (known->stream == event.stream && event.number != known->number + 1) {
    const std::uint64_t left_out = event.number - known->number - 1;
    sink_.take_loss(name, line.network, std::min(left_out, kMostLostAtOnce));
  }
  known->stream = event.stream;
  known->number = event.number;
  return true;
}

void PeerEmcys::hold(const GatewayLine& name, Line& line, Held held, Instant now) {
  if (line.held.size() >= kMostHeld) {
    const auto gives_way = surplus(line.held);
    take_loss_of(name, line, *gives_way, now);
    line.held.erase(gives_way);
  }
  line.held.push_back(std::move(held));
}

// The oldest one of the sender that has most of them: it is that which is too old first, and a node
// does not displace the EMCYs of others, whatever sources it names.
std::deque<PeerEmcys::Held>::iterator PeerEmcys::surplus(std::deque<Held>& held) {
  std::array<std::size_t, 256> counts{};
  for (const Held& each : held) {
    ++counts[each.node];
  }
  return std::ranges::max_element(held, {}, [&](const Held& each) { return counts[each.node]; });
}

Duration PeerEmcys::age_of(const Line& line, const Held& held, Instant now) {
  return saturated_sum(difference(line.time, held.time), now - line.received);
}

// Of an incarnation that has ended meanwhile, the age is not known.
void PeerEmcys::take_loss_of(const GatewayLine& name, const Line& line, const Held& held,
                             Instant now) {
  if (line.incarnation != held.incarnation || age_of(line, held, now) < now - line.followed) {
    sink_.take_loss(name, line.network, 1);
  }
}

// Those whose incarnation published no state in time.
void PeerEmcys::end_early(const GatewayLine& name, Line& line, Instant now) {
  while (!line.early.empty() && now - line.early.front().received >= kOldest) {
    if (line.incarnation != 0 && line.early.front().event.emcy) {
      sink_.take_loss(name, line.network, 1);
    }
    line.early.pop_front();
  }
}

void PeerEmcys::advance(const Publisher& publisher, Instant now) {
  for (auto& [name, line] : lines_) {
    end_early(name, line, now);
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
        take_loss_of(name, line, each, now);
      }
    }
    line.held = std::move(later);
  }
}

void PeerEmcys::pass_on(const GatewayLine& name, Line& line, const Held& held, Instant now) {
  const Duration age = age_of(line, held, now);
  if (age > kOldest || age < -kOldest) {
    take_loss_of(name, line, held, now);
    return;
  }
  routing::ForwardedEmcy emcy = held.emcy;
  emcy.network = emcy.network == 0 ? line.network : emcy.network;
  if (!sink_.is_wanted(name, emcy)) {
    return;
  }
  if (line.limit.admit(held.routed ? held.node : std::uint8_t{0}, emcy.network, emcy.node, now)) {
    sink_.take_emcy(name, emcy);
  } else {
    sink_.take_excess(name, emcy);
  }
}

// What has waited for kForRouted waits for a sample, or until it is too old.
Instant PeerEmcys::next_wake(Instant now) const {
  Instant out = kNever;
  for (const auto& [name, line] : lines_) {
    if (!line.early.empty()) {
      out = std::min(out, std::max(line.early.front().received + kOldest, now));
    }
    for (const Held& each : line.held) {
      const Instant routed = each.received + kForRouted;
      out = std::min(out, routed > now ? routed : std::max(each.received + kOldest, now));
    }
  }
  return out;
}

}  // namespace linegate::gateway

// SPDX-License-Identifier: Apache-2.0
#include "stack/base/repeat_limit.h"

#include <algorithm>
#include <limits>
#include <span>
#include <utility>
#include <variant>

#include "stack/base/assert.h"

namespace linegate {
namespace {

void note_held(Event& event, std::uint32_t held) {
  std::visit(
      [held](auto& data) {
        if constexpr (requires { data.suppressed; }) {
          using Count = decltype(data.suppressed);
          constexpr std::uint32_t kMost = std::numeric_limits<Count>::max();
          data.suppressed = static_cast<Count>(std::min(held, kMost));
        }
      },
      event.data);
}

// What the events of a series have in common, besides their node.
struct Series {
  std::uint32_t reason = 0;
  std::uint32_t subject = 0;
};

constexpr std::uint32_t object_key(std::uint16_t index, std::uint8_t sub) {
  return std::uint32_t{index} << 8U | sub;
}

// The lower 24 bits of the number of a client, and what it did.
constexpr std::uint32_t of_client(std::uint32_t client, std::uint8_t what) {
  return client << 8U | what;
}

struct SeriesOf {
  Series operator()(const event::MalformedFrame& frame) const {
    return {.reason = frame.identifier};
  }
  Series operator()(const event::BusError& error) const { return {.reason = error.errors}; }
  Series operator()(const event::OutputRefused& refused) const {
    return {of_client(refused.client, static_cast<std::uint8_t>(refused.refusal)), refused.group};
  }
  Series operator()(const event::CommandRefused& refused) const {
    return {of_client(refused.client, static_cast<std::uint8_t>(refused.refusal)),
            static_cast<std::uint32_t>(refused.command)};
  }
  Series operator()(const event::CommandAccepted& accepted) const {
    return {of_client(accepted.client, static_cast<std::uint8_t>(accepted.command)),
            object_key(accepted.index, accepted.sub)};
  }
  Series operator()(const event::OutputOwner& owner) const { return {.subject = owner.group}; }
  Series operator()(const event::SdoTransfer& transfer) const {
    return {transfer.download ? 1U : 0U, object_key(transfer.index, transfer.sub)};
  }
  Series operator()(const event::SdoAbort& abort) const {
    return {static_cast<std::uint32_t>(abort.abort), object_key(abort.index, abort.sub)};
  }
  Series operator()(const event::ObjectWritten& written) const {
    return {.subject = object_key(written.index, written.sub)};
  }
  Series operator()(const event::RoutingUnanswered& request) const {
    return {.reason = std::uint32_t{request.target} << 8U | request.target_node,
            .subject = object_key(request.index, request.sub)};
  }
  Series operator()(const event::SrdoState& srdo) const { return {.subject = srdo.number}; }
  template <class Other>
  Series operator()(const Other& /*other*/) const {
    LINEGATE_ASSERT(false, "events of this kind are not limited");
    return {};
  }
};

std::uint32_t saturated_sum(std::uint32_t a, std::uint32_t b) {
  constexpr std::uint32_t kMost = std::numeric_limits<std::uint32_t>::max();
  return b > kMost - a ? kMost : a + b;
}

}  // namespace

bool RepeatLimit::admit(Event& event) {
  Place* const found = place_of(event);
  if (found == nullptr) {
    return true;
  }
  Place& place = *found;
  const bool old = place.is_old(event.time);
  if (!old && (place.held != 0 || place.at_once >= at_once_)) {
    place.held = saturated_sum(place.held, 1);
    place.last = event;
    next_ = earlier(next_, place.due());
    return false;
  }
  place.used = true;
  place.at_once = old ? 1 : place.at_once + 1;
  place.passed = old ? event.time : place.passed;
  note_held(event, std::exchange(place.held, 0));
  find_next();
  return true;
}

std::optional<Event> RepeatLimit::pop_due(Instant now) {
  if (next_ > now) {
    return std::nullopt;
  }
  Place& place = *std::ranges::min_element(places_, {}, &Place::due);
  LINEGATE_ASSERT(place.held != 0, "an event was held back where one is due");
  Event event = place.last;
  event.time = place.due();
  note_held(event, std::exchange(place.held, 0) - 1);
  place.passed = event.time;
  place.at_once = 1;
  find_next();
  return event;
}

void RepeatLimit::find_next() {
  next_ = std::ranges::min_element(places_, {}, &Place::due)->due();
}

RepeatLimit::Key RepeatLimit::key_of(const Event& event) {
  const Series series = std::visit(SeriesOf{}, event.data);
  return {.node = event.node, .reason = series.reason, .subject = series.subject};
}

RepeatLimit::Place* RepeatLimit::place_of(const Event& event) {
  const std::span<Place> own = std::span(places_).first(places_.size() - 1);
  const Key key = key_of(event);
  const auto known =
      std::ranges::find_if(own, [&](const Place& place) { return place.used && place.key == key; });
  if (known != own.end()) {
    return &*known;
  }
  Place* free = nullptr;
  for (Place& place : own) {
    const bool may_go = shares_ || place.held == 0;
    if (may_go && place.is_old(event.time) && (free == nullptr || place.held < free->held)) {
      free = &place;
    }
  }
  Place& shared = places_.back();
  if (free == nullptr) {
    return shares_ ? &shared : nullptr;
  }
  // The series that these counts belong to may never repeat, so this event reports them.
  *free = {.key = key, .held = saturated_sum(free->held, std::exchange(shared.held, 0))};
  return free;
}

}  // namespace linegate

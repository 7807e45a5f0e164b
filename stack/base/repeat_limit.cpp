// SPDX-License-Identifier: Apache-2.0
#include "stack/base/repeat_limit.h"

#include <algorithm>
#include <limits>
#include <span>
#include <utility>

#include "stack/base/assert.h"
#include "stack/base/byte_order.h"

namespace linegate {
namespace {

constexpr std::uint8_t kCountOffset = 8;

void note_held(Event& event, std::uint32_t held) {
  if (event.kind == EventKind::sdo_transfer) {  // its data may be full
    event.code |= std::min<std::uint32_t>(held, 0xFFFF) << 16U;
  } else if (event.kind == EventKind::object_written) {
    event.code = held;
  } else if (held != 0) {
    store_le(event.data.data() + kCountOffset, held);
    event.length = kCountOffset + sizeof held;
  }
}

std::uint32_t subject_of(const Event& event) {
  switch (event.kind) {
    case EventKind::output_refused:
    case EventKind::command_refused:
      return event.value;
    case EventKind::sdo_transfer:
    case EventKind::sdo_abort:
    case EventKind::object_written:
      return load_le<std::uint32_t>(event.data.data()) & 0xFF'FFFFU;  // index and sub-index
    default:
      return 0;
  }
}

std::uint32_t saturated_sum(std::uint32_t a, std::uint32_t b) {
  constexpr std::uint32_t kMost = std::numeric_limits<std::uint32_t>::max();
  return b > kMost - a ? kMost : a + b;
}

}  // namespace

bool RepeatLimit::admit(Event& event) {
  LINEGATE_ASSERT(event.length <= kCountOffset || event.kind == EventKind::sdo_transfer ||
                      event.kind == EventKind::object_written,
                  "the data leaves room for the number of events that were held back");
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

std::optional<Event> RepeatLimit::take_due(Instant now) {
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
  return {.node = event.node, .code = event.code, .subject = subject_of(event)};
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

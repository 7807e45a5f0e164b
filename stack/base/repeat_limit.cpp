#include "stack/base/repeat_limit.h"

#include <algorithm>
#include <limits>
#include <span>
#include <utility>

#include "stack/base/byte_order.h"

namespace linegate {
namespace {

constexpr std::uint8_t kCountOffset = 8;

}  // namespace

bool RepeatLimit::admit(Event& event) {
  Place& place = place_of(event);
  if (!place.is_old(event.time)) {
    place.held += place.held == std::numeric_limits<std::uint32_t>::max() ? 0U : 1U;
    return false;
  }
  place.used = true;
  place.told = event.time;
  if (const std::uint32_t held = std::exchange(place.held, 0); held != 0) {
    store_le(event.data.data() + kCountOffset, held);
    event.length = kCountOffset + sizeof held;
  }
  return true;
}

RepeatLimit::Place& RepeatLimit::place_of(const Event& event) {
  const std::span<Place> own = std::span(places_).first(kPlaces);
  const auto known = std::ranges::find_if(own, [&](const Place& place) {
    return place.used && place.kind == event.kind && place.node == event.node &&
           place.code == event.code;
  });
  if (known != own.end()) {
    return *known;
  }
  const auto free =
      std::ranges::find_if(own, [&](const Place& place) { return place.is_old(event.time); });
  if (free == own.end()) {
    return places_.back();
  }
  *free = {.kind = event.kind, .node = event.node, .code = event.code};
  return *free;
}

}  // namespace linegate

// Holds back malformed_frame, which repeats as often as somebody sends frames.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "stack/base/event.h"
#include "stack/base/time.h"

namespace linegate {

// Of events with the same node and code the first is told at once, and then at most one a second.
// Time is that of the events. Memory is fixed: when kPlaces different ones were told within a
// second, all others share one more place; and a new one takes a place that nobody needed for a
// second, best one that held nothing back.
class RepeatLimit {
 public:
  static constexpr std::size_t kPlaces = 16;
  static constexpr Duration kInterval = std::chrono::seconds(1);

  // False: hold it back. If some were held back since, the next event that is told says so: data
  // from byte 8 is their number (4, LE), and length is 12. They were like it, or of the shared
  // place, or of the one whose place it took. Precondition: length <= 8.
  bool admit(Event& event);

 private:
  struct Place {
    std::uint8_t node = 0;
    bool used = false;
    std::uint32_t code = 0;
    std::uint32_t held = 0;
    Instant told{};

    bool is_old(Instant now) const { return !used || now - told >= kInterval; }
  };

  Place& place_of(const Event& event);

  std::array<Place, kPlaces + 1> places_{};  // the last is shared
};

}  // namespace linegate

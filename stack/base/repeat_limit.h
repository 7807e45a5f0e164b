// SPDX-License-Identifier: Apache-2.0
// Suppresses repeated events that a remote peer can cause at any rate, by frames or by refused
// requests: malformed_frame, bus_error, output_refused, command_refused, command_accepted,
// output_owner, object_written, and the SDO events of an observer.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "stack/base/event.h"
#include "stack/base/time.h"

namespace linegate {

// Limits each series of events to one event a second, after the first. Events belong to one series
// if they have the same node and, by their kind: identifier of the frame; bus errors; refusal,
// client and group; refusal, client and kind of command; client, kind of command and object; group;
// object and direction; object and abort code; written object. Time is the time of the events.
// Memory is fixed: when as many series as there are places had an event within a second, all other
// series share one more place. A new series takes a place that was unused for a second, preferably
// one without suppressed events.
class RepeatLimit {
 public:
  static constexpr std::size_t kPlaces = 16;
  static constexpr Duration kInterval = std::chrono::seconds(1);

  explicit RepeatLimit(std::size_t places = kPlaces) : places_(places + 1) {}
  // A limit that never suppresses the newest event of a series: at_once events pass in each second,
  // and a series without a place is not limited.
  static RepeatLimit that_keeps_newest(std::size_t places, std::uint32_t at_once) {
    RepeatLimit out(places);
    out.at_once_ = at_once;
    out.shares_ = false;
    return out;
  }

  // Returns false if the event is to be suppressed. `suppressed` of the next event that passes is
  // the number of suppressed ones: of its series, of the shared place, or of the series whose place
  // it took. Precondition: the event is of one of the kinds above.
  bool admit(Event& event);

  // The last suppressed event of a series whose second is over by `now`, if no other event has
  // reported it. It has the number of other suppressed events, as above; its time is the end of the
  // second. Returns nothing if there is none (left).
  std::optional<Event> pop_due(Instant now);
  // When to call pop_due(); kNever if no event is suppressed.
  Instant next_wake() const { return next_; }

 private:
  // Equal for the events of one series.
  struct Key {
    std::uint8_t node = 0;
    std::uint32_t reason = 0;
    std::uint32_t subject = 0;

    bool operator==(const Key&) const = default;
  };
  struct Place {
    Key key{};
    bool used = false;
    std::uint32_t at_once = 0;  // events passed since `passed`
    std::uint32_t held = 0;
    Instant passed{};
    Event last{};  // valid if held != 0

    Instant due() const { return held == 0 ? kNever : passed + kInterval; }
    bool is_old(Instant now) const { return !used || now - passed >= kInterval; }
  };

  static Key key_of(const Event& event);
  // nullptr: the event is not limited.
  Place* place_of(const Event& event);
  void find_next();

  std::vector<Place> places_;  // the last one is shared
  std::uint32_t at_once_ = 1;
  bool shares_ = true;
  Instant next_ = kNever;
};

}  // namespace linegate

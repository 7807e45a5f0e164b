// SPDX-License-Identifier: Apache-2.0
// Holds back events that repeat as often as somebody sends frames or asks for what is refused:
// malformed_frame, bus_error, output_refused, command_refused, object_written, and what an observer
// hears of SDOs.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "stack/base/event.h"
#include "stack/base/time.h"

namespace linegate {

// Of events with the same node and code, of a refusal the same value (group or kind of command), of
// an SDO or a written object the same object, the first passes at once, and then at most one a
// second. Time is that of the events. Memory is fixed: when as many different ones as there are
// places passed within a second, all others share one more place; and a new one takes a place
// that nobody needed for a second, best one that held nothing back.
class RepeatLimit {
 public:
  static constexpr std::size_t kPlaces = 16;
  static constexpr Duration kInterval = std::chrono::seconds(1);

  explicit RepeatLimit(std::size_t places = kPlaces) : places_(places + 1) {}
  // The newest of each series always passes: so many in each second at once, and for what has no
  // place there is no limit.
  static RepeatLimit that_keeps_newest(std::size_t places, std::uint32_t at_once) {
    RepeatLimit out(places);
    out.at_once_ = at_once;
    out.shares_ = false;
    return out;
  }

  // False: hold it back. If some were held back since, the next event that passes says so: data
  // from byte 8 is their number (4, LE), and length is 12; of sdo_transfer bits 16-31 of the code
  // are (65535: or more), of object_written the code is. They were like it, or of the shared place,
  // or of the one whose place it took. Precondition: length <= 8, but of these two.
  bool admit(Event& event);

  // The last of those held back, once the second is over and no other event has counted them. It
  // says how many others there were, as above; its time is that at which the second was over.
  // Nothing if there is none (any more) at `now`.
  std::optional<Event> take_due(Instant now);
  // When take_due() is wanted; kNever if nothing is held back.
  Instant next_wake() const { return next_; }

 private:
  // What is the same of events that are alike.
  struct Key {
    std::uint8_t node = 0;
    std::uint32_t code = 0;
    std::uint32_t subject = 0;

    bool operator==(const Key&) const = default;
  };
  struct Place {
    Key key{};
    bool used = false;
    std::uint32_t at_once = 0;  // passed since `passed`
    std::uint32_t held = 0;
    Instant passed{};
    Event last{};  // if held != 0

    Instant due() const { return held == 0 ? kNever : passed + kInterval; }
    bool is_old(Instant now) const { return !used || now - passed >= kInterval; }
  };

  static Key key_of(const Event& event);
  // nullptr: there is no limit.
  Place* place_of(const Event& event);
  void find_next();

  std::vector<Place> places_;  // the last is shared
  std::uint32_t at_once_ = 1;
  bool shares_ = true;
  Instant next_ = kNever;
};

}  // namespace linegate

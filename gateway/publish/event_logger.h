// SPDX-License-Identifier: Apache-2.0
// Writes events to the log, and limits the rate of each kind, so that a storm of one kind does not
// hide the others.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>

#include "gateway/publish/rate_limit.h"
#include "stack/base/event.h"

namespace linegate::gateway {

// One for each line. Each kind of event has its own RateLimit; the number of suppressed events is
// written with the next event of that kind. Heartbeats that are lost because the line's interface
// is down are combined into one sentence.
class EventLogger {
 public:
  // Losses within this time are combined.
  static constexpr Duration kJoined = std::chrono::seconds(2);

  // Returns true if an event of that kind may be written now, and sets left_out to the number of
  // suppressed events before it.
  bool admit(EventKind kind, Instant now, std::uint64_t& left_out);

  // Returns true if the event is a consequence of an interface that is down: it is combined with
  // others, see pop_joined().
  bool join(const Event& event, Instant now);
  // The sentence about the combined events, once kJoined has passed or the interface is usable
  // again; empty if there is none.
  std::string pop_joined(Instant now);

  void write(std::string_view line, const Event& event, std::string_view text, Instant now);
  // Writes combined events that are due.
  void advance(std::string_view line, Instant now);

 private:
  std::array<RateLimit, kEventKinds> limits_{};
  std::string down_;  // why nothing can be received; empty while the interface is usable
  std::string nodes_;
  std::string reason_;  // of the losses of nodes_
  std::uint64_t first_ = 0;
  std::uint64_t last_ = 0;
  Instant due_ = kNever;
};

}  // namespace linegate::gateway

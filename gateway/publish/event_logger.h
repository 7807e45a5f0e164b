// SPDX-License-Identifier: Apache-2.0
// Writes events to the log, so that a storm of one kind does not bury the rest.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>

#include "gateway/publish/rate_limit.h"
#include "stack/base/event.h"

namespace linegate::gateway {

// For one line; each kind of event has a RateLimit of its own, and how many were left out is said
// when the next one is written. The heartbeats that are lost because the line's interface is down
// are one sentence.
class EventLogger {
 public:
  // The losses of this time are joined.
  static constexpr Duration kJoined = std::chrono::seconds(2);

  // True if an event of that kind may be written now; left_out becomes how many before it were not.
  bool admit(EventKind kind, Instant now, std::uint64_t& left_out);

  // True if the event is a consequence of an interface that is down: it is written with others, see
  // take_joined().
  bool join(const Event& event, Instant now);
  // The sentence about the events that were joined, once their time is over or the interface is
  // usable again; empty if there is none.
  std::string take_joined(Instant now);

  void write(std::string_view line, const Event& event, std::string_view text, Instant now);
  // Writes what has been joined.
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

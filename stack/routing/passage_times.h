// SPDX-License-Identifier: Apache-2.0
// The times of a connection whose client is served by a ValueServer: of the request under way, of
// the next frame of the client, and of the messages that restart the time-outs of the client
// meanwhile. Private to the egresses.
#pragma once

#include <algorithm>
#include <chrono>

#include "stack/base/time.h"
#include "stack/routing/config.h"
#include "stack/routing/value_server.h"

namespace linegate::routing {

// The time within which a connection expects its next frame.
inline Duration client_frame_timeout(const Config& config, Duration sdo_timeout) {
  return config.frame_timeout > Duration::zero() ? config.frame_timeout : 2 * sdo_timeout;
}

// Between two messages that restart the time-outs of the client. most: for clients whose time-outs
// may be shorter than frame_timeout.
inline Duration restart_period(Duration frame_timeout, Duration most) {
  constexpr int kRestartsInTimeout = 4;
  constexpr Duration kLeast = std::chrono::milliseconds(1);
  return std::clamp<Duration>(frame_timeout / kRestartsInTimeout, kLeast, most);
}

struct PassageTimes {
  Instant deadline = kNever;    // of the request under way, or for the next frame of the client
  Instant restart_at = kNever;  // of the time-outs of the client

  void begin_request(Instant until, Instant first_restart) {
    deadline = until;
    restart_at = first_restart;
  }
  // next_frame: when the client must have sent its next frame.
  void end_request(Instant next_frame) {
    deadline = next_frame;
    restart_at = kNever;
  }
  Instant wake(const ValueServer& server) const {
    return earlier(earlier(deadline, restart_at), server.next_wake());
  }
};

// Runs what is due of each open passage, which has `times` and `server`, and returns when to call
// it again. Egress has keep_waiting(passage), pump(passage) and expire(passage) for that.
template <class Passages, class Egress>
Instant advance_passages(const Passages& passages, Egress& egress, Instant now) {
  Instant wake = kNever;
  for (const auto& each : passages) {
    auto& passage = *each;
    if (!passage.is_open) {
      continue;
    }
    if (now >= passage.times.restart_at) {
      egress.keep_waiting(passage);
    }
    if (now >= passage.server.next_wake()) {
      passage.server.advance(now);
      egress.pump(passage);
    }
    if (passage.is_open && now >= passage.times.deadline) {
      egress.expire(passage);
    }
    if (passage.is_open) {
      wake = earlier(wake, passage.times.wake(passage.server));
    }
  }
  return wake;
}

}  // namespace linegate::routing

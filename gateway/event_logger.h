// Writes events to the log, so that a storm of one kind does not bury the rest.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

#include "gateway/rate_limit.h"
#include "stack/base/event.h"

namespace linegate::gateway {

// For one line; each kind of event has a RateLimit of its own, and how many were left out is said
// when the next one is written.
class EventLogger {
 public:
  // True if an event of that kind may be written now; left_out becomes how many before it were not.
  bool admit(EventKind kind, Instant now, std::uint64_t& left_out);

  void write(std::string_view line, const Event& event, std::string_view text, Instant now);

 private:
  std::array<RateLimit, kEventKinds> limits_{};
};

}  // namespace linegate::gateway

// Writes events to the log, so that a storm of one kind does not bury the rest.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

#include "stack/base/event.h"

namespace linegate::gateway {

// For one line. Each kind of event may be written kBurst times at once and kPerSecond in the long
// run; how many were left out is said when the next one is written.
class EventLogger {
 public:
  static constexpr double kBurst = 20;
  static constexpr double kPerSecond = 5;

  // True if an event of that kind may be written now; left_out becomes how many before it were not.
  bool admit(EventKind kind, Instant now, std::uint64_t& left_out);

  void write(std::string_view line, const Event& event, std::string_view text, Instant now);

 private:
  struct Bucket {
    double tokens = kBurst;
    Instant filled{};
    std::uint64_t left_out = 0;
  };
  std::array<Bucket, kEventKinds> buckets_{};
};

}  // namespace linegate::gateway

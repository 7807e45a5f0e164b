// SPDX-License-Identifier: Apache-2.0
// Limits how often a line reports that requests were refused: clients that write without end would
// fill its event log.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "stack/base/event.h"
#include "stack/base/time.h"

namespace linegate::gateway {

// Of one line. Each reason is reported once a second, and at most kReasons of them in any second.
class NoticeLimit {
 public:
  static constexpr std::size_t kReasons = 32;
  static constexpr Duration kPeriod = std::chrono::seconds(1);

  // True if it may be reported now. False for a reason that was reported less than kPeriod ago; one
  // beyond kReasons others is suppressed and counted.
  bool admit(EventKind kind, std::uint32_t code, std::uint32_t value, Instant now);

  // How many were suppressed since the last call that gave any, once per kPeriod; else 0.
  std::uint64_t pop_suppressed(Instant now);
  // Without regard to the period.
  std::uint64_t pop_suppressed();

 private:
  struct Reported {
    EventKind kind{};
    std::uint32_t code = 0;
    std::uint32_t value = 0;
    Instant until{};  // the place is free then
  };

  std::array<Reported, kReasons> reported_{};
  std::uint64_t suppressed_ = 0;
  Instant suppressed_due_{};
};

}  // namespace linegate::gateway

// SPDX-License-Identifier: Apache-2.0
// Limits how often a line reports refused requests: clients that write continuously would fill its
// event log.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "stack/base/event.h"
#include "stack/base/time.h"

namespace linegate::gateway {

// One for each line. A reason is what the event reports. Each reason is reported at most once a
// second, and at most kReasons reasons within a second, kOfOneClient of them of the same client.
class NoticeLimit {
 public:
  static constexpr std::size_t kReasons = 32;
  static constexpr std::size_t kOfOneClient = 8;
  static constexpr Duration kPeriod = std::chrono::seconds(1);

  // Returns true if it may be reported now. Returns false for a reason that was reported less than
  // kPeriod ago; a reason beyond these numbers is suppressed and counted.
  bool admit(const EventData& what, Instant now);

  // Number of suppressed reports since the last call that returned any, once per kPeriod; else 0.
  std::uint64_t pop_suppressed(Instant now);
  // The same, independent of the period.
  std::uint64_t pop_suppressed();

 private:
  struct Reported {
    EventData what{};
    Instant until{};  // time at which the place becomes free
  };

  std::array<Reported, kReasons> reported_{};
  std::uint64_t suppressed_ = 0;
  Instant suppressed_due_{};
};

}  // namespace linegate::gateway

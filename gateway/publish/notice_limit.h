// SPDX-License-Identifier: Apache-2.0
// How often a line is told that requests of others were refused: as often as strangers write, they
// would fill its event log.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "stack/base/event.h"
#include "stack/base/time.h"

namespace linegate::gateway {

// Of one line. Each reason is told once a second, and no more than kReasons of them in any second.
class NoticeLimit {
 public:
  static constexpr std::size_t kReasons = 32;
  static constexpr Duration kPeriod = std::chrono::seconds(1);

  // True if it may be told now. A reason that was told less than kPeriod ago is not told again; one
  // that finds kReasons others told is held back, and counted.
  bool admit(EventKind kind, std::uint32_t code, std::uint32_t value, Instant now);

  // How many were held back since they were told last, once per kPeriod; 0 if that is not over.
  std::uint64_t take_held(Instant now);
  // All of them, now.
  std::uint64_t take_held();

 private:
  struct Told {
    EventKind kind{};
    std::uint32_t code = 0;
    std::uint32_t value = 0;
    Instant until{};  // the place is free then
  };

  std::array<Told, kReasons> told_{};
  std::uint64_t held_ = 0;
  Instant held_due_{};
};

}  // namespace linegate::gateway

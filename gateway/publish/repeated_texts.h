// SPDX-License-Identifier: Apache-2.0
// Joins equal messages that follow each other for long, as a peer without access can cause them.
#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "stack/base/diagnostic.h"
#include "stack/base/time.h"

namespace linegate::gateway {

// Each message may be written once in kPeriod; equal ones within it are counted. Memory is fixed:
// when kPlaces messages were written within kPeriod, further ones are not limited.
class RepeatedTexts {
 public:
  static constexpr std::size_t kPlaces = 16;
  static constexpr Duration kPeriod = std::chrono::minutes(1);
  static constexpr std::size_t kLongest = 1024;  // bytes; longer messages are not limited

  struct Joined {
    Severity severity{};
    std::string text;
    std::uint64_t suppressed = 0;
  };

  // Returns whether the message may be written now. Call pop_due() before, until it returns
  // nothing.
  bool admit(Severity severity, std::string_view text, Instant now);

  // A message with suppressed ones whose period is over; a further one begins a new period. Returns
  // nothing if there is none (left).
  std::optional<Joined> pop_due(Instant now);

 private:
  struct Place {
    Joined written;
    Instant until{};  // the place is free from then on
  };

  std::array<Place, kPlaces> places_{};
};

}  // namespace linegate::gateway

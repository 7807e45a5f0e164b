// SPDX-License-Identifier: Apache-2.0
// Controls the reports of single routed connections: whether a client requested them, and how many
// are reported. A service tool opens thousands a second, which would crowd out all other events.
#pragma once

#include <algorithm>
#include <cstdint>
#include <utility>

#include "stack/base/time.h"

namespace linegate::routing {

class Trace {
 public:
  static constexpr std::uint32_t kMostASecond = 50;  // reported connections
  static constexpr std::uint16_t kLongest = 3600;    // seconds; longest duration of one request

  // A client requests reports until `end`. Of several requests the latest end applies.
  void ask(Instant end) { end_ = std::max(end_, end); }
  // Whether a connection that opens now is reported.
  bool admit(Instant now) {
    if (now >= end_) {
      return false;
    }
    if (now >= second_ + std::chrono::seconds(1)) {
      second_ = now;
      reported_ = 0;
    }
    const bool admitted = reported_ < kMostASecond;
    ++(admitted ? reported_ : withheld_);
    return admitted;
  }
  // Number of connections that were not reported since the last call.
  std::uint32_t pop_withheld() { return std::exchange(withheld_, 0U); }

 private:
  Instant end_{};
  Instant second_{};
  std::uint32_t reported_ = 0;
  std::uint32_t withheld_ = 0;
};

}  // namespace linegate::routing

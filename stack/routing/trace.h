// SPDX-License-Identifier: Apache-2.0
// Who wants to hear of single routed transfers, and how many of them are told: a service tool does
// thousands a second, which would drown everything else that happens.
#pragma once

#include <algorithm>
#include <cstdint>
#include <utility>

#include "stack/base/time.h"

namespace linegate::routing {

class Trace {
 public:
  static constexpr std::uint32_t kMostASecond = 50;  // connections
  static constexpr std::uint16_t kLongest = 3600;    // seconds that one request is good for

  // Somebody listens until `end`. Of several the latest end counts.
  void ask(Instant end) { end_ = std::max(end_, end); }
  // Whether a connection that opens now is told of.
  bool admit(Instant now) {
    if (now >= end_) {
      return false;
    }
    if (now >= second_ + std::chrono::seconds(1)) {
      second_ = now;
      told_ = 0;
    }
    const bool admitted = told_ < kMostASecond;
    ++(admitted ? told_ : withheld_);
    return admitted;
  }
  // Those that were not told of since it was asked last.
  std::uint32_t take_withheld() { return std::exchange(withheld_, 0U); }

 private:
  Instant end_{};
  Instant second_{};
  std::uint32_t told_ = 0;
  std::uint32_t withheld_ = 0;
};

}  // namespace linegate::routing

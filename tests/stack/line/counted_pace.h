// SPDX-License-Identifier: Apache-2.0
// Counts the frames that commands of clients cause, and permits a number of them.
#pragma once

#include <cstdint>
#include <map>

#include "stack/sdo/pace.h"

namespace linegate::line {

class CountedPace final : public sdo::Pace {
 public:
  bool permits(std::uint32_t /*client*/, bool /*awaited*/) const override { return left > 0; }
  void count(std::uint32_t client, const can::Header& /*frame*/) override {
    --left;
    ++counted[client];
  }

  int left = 0;
  std::map<std::uint32_t, int> counted;  // by client
};

// A base of a fixture, because it outlives the line.
struct WithPace {
  CountedPace pace_;
};

}  // namespace linegate::line

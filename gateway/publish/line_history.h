// SPDX-License-Identifier: Apache-2.0
// Makes event numbers and counters of a line continuous for subscribers when the line is recreated,
// because the incarnation remains the same.
#pragma once

#include "stack/base/event.h"
#include "stack/line/state.h"

namespace linegate::gateway {

class LineHistory {
 public:
  // Adds the numbers and counters of all earlier lines with this name.
  void correct(Event& event);
  void correct(line::LineState& state);

  // The numbers up to this one are in use by earlier runs of the gateway. Call it before the first
  // restart().
  void begin_after(std::uint64_t number);
  // Call it when the line is recreated.
  void restart();

 private:
  std::uint64_t first_event_ = 0;  // number of the last event of earlier lines
  std::uint64_t last_event_ = 0;
  line::Counters before_;  // sum over all earlier lines
  line::Counters now_;     // sum including the present line
  routing::Counters routed_before_;
  routing::Counters routed_now_;
};

}  // namespace linegate::gateway

// SPDX-License-Identifier: Apache-2.0
// What subscribers have been told of a line, over all its restarts: numbers and counters go on
// where the last one left them, because the incarnation is the same.
#pragma once

#include "stack/base/event.h"
#include "stack/line/state.h"

namespace linegate::gateway {

class LineHistory {
 public:
  // The line that is published now has the numbers of its own life: gives it those of its name.
  void correct(Event& event);
  void correct(line::LineState& state);

  // The line is made anew.
  void restart();

 private:
  std::uint64_t first_event_ = 0;  // number of the last event before this life
  std::uint64_t last_event_ = 0;
  line::Counters before_;  // of all lives before this one
  line::Counters now_;     // with those of this one
  routing::Counters routed_before_;
  routing::Counters routed_now_;
};

}  // namespace linegate::gateway

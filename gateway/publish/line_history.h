// SPDX-License-Identifier: Apache-2.0
// Numbers and counters of a line as subscribers see them: they continue after the line was made
// anew, because the incarnation is the same.
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

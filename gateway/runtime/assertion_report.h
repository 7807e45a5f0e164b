// SPDX-License-Identifier: Apache-2.0
// The report of a violated assertion (stack/base/assert.h): the condition, its place in the source,
// and the name and the last events of the line that the thread runs.
#pragma once

#include <cstddef>
#include <utility>

#include "stack/line/line.h"

namespace linegate::gateway {

// From now on a violated assertion is printed to standard error before the process aborts. Uses
// only write() and never allocates, because the heap may be damaged.
void report_assertions();

// While an instance exists, the thread that created it runs that line. Instances nest: a line may
// pass values to another line of the same executor.
class RunningLine {
 public:
  static constexpr std::size_t kEvents = 16;  // number of printed events

  // line must outlive it.
  explicit RunningLine(const line::Line& line) : before_(running_) { running_ = &line; }
  ~RunningLine() { running_ = before_; }
  RunningLine(const RunningLine&) = delete;
  RunningLine& operator=(const RunningLine&) = delete;

  // Returns the line that this thread runs, and forgets it; nullptr: none.
  static const line::Line* forget() { return std::exchange(running_, nullptr); }

 private:
  static constinit inline thread_local const line::Line* running_ = nullptr;

  const line::Line* before_;
};

}  // namespace linegate::gateway

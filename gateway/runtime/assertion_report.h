// SPDX-License-Identifier: Apache-2.0
// What the process prints when an assertion is violated (stack/base/assert.h): what must hold,
// where that stands, and of the line that the thread runs its name and its last events.
#pragma once

#include <cstddef>

#include "stack/line/line.h"

namespace linegate::gateway {

// From now on a violated assertion is printed to standard error before the process aborts. Prints
// with write() alone and allocates nothing: the heap may be what is damaged.
void report_assertions();

// As long as one exists, the thread that made it runs that line. They nest: a line that hands
// values to another one of the same executor.
class RunningLine {
 public:
  static constexpr std::size_t kEvents = 16;  // that are printed

  // line must outlive it.
  explicit RunningLine(const line::Line& line);
  ~RunningLine();
  RunningLine(const RunningLine&) = delete;
  RunningLine& operator=(const RunningLine&) = delete;

 private:
  const line::Line* before_;
};

}  // namespace linegate::gateway

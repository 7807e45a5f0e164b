// SPDX-License-Identifier: Apache-2.0
// Which processors the threads of a measurement run on: the same for all contestants. Where the
// scheduler puts a thread by itself decides whether a wake-up crosses processors, which costs more
// than all that is measured.
#pragma once

#include <array>
#include <string>
#include <vector>

namespace linegate::bench {

struct Placement {
  std::string name;
  unsigned measuring = 0;                // of the thread that sends, reads and takes the time
  std::array<unsigned, 2> forwarding{};  // of the threads that are measured
  std::vector<unsigned> others;          // of all other threads
};

// All threads on one processor; then, if the process may use more, the measuring thread on one and
// the measured threads on the others.
std::vector<Placement> placements();

// From now on, the calling thread and those that it starts.
void run_on(const std::vector<unsigned>& processors);

}  // namespace linegate::bench

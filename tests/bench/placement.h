// SPDX-License-Identifier: Apache-2.0
// The processors on which the threads of a measurement run, the same for all contestants. If the
// scheduler places the threads, its choice determines whether a wake-up crosses processors, which
// costs more than everything that is measured.
#pragma once

#include <array>
#include <string>
#include <vector>

namespace linegate::bench {

struct Placement {
  std::string name;
  unsigned measuring = 0;                // for the thread that sends, reads and takes the time
  std::array<unsigned, 2> forwarding{};  // for the threads that are measured
  std::vector<unsigned> others;          // for all other threads
};

// Returns placements: all threads on one processor; and, if the process may use more, the measuring
// thread on one and the measured threads on the others.
std::vector<Placement> placements();

// Restricts the calling thread, and the threads that it starts from now on, to these processors.
void run_on(const std::vector<unsigned>& processors);

}  // namespace linegate::bench

// SPDX-License-Identifier: Apache-2.0
#include "tests/bench/placement.h"

#include <cstddef>

#include <sched.h>

#include "tests/bench/measure.h"

namespace linegate::bench {
namespace {

std::vector<unsigned> permitted_processors() {
  cpu_set_t set;
  require(sched_getaffinity(0, sizeof set, &set) == 0, "the permitted processors cannot be read");
  std::vector<unsigned> out;
  for (unsigned processor = 0; processor < CPU_SETSIZE; ++processor) {
    if (CPU_ISSET(processor, &set)) {
      out.push_back(processor);
    }
  }
  return out;
}

}  // namespace

std::vector<Placement> placements() {
  const std::vector<unsigned> all = permitted_processors();
  const unsigned last = all.back();
  std::vector<Placement> out{
      {.name = "one processor", .measuring = last, .forwarding = {last, last}, .others = {last}}};
  if (all.size() > 1) {
    out.push_back({.name = "several processors",
                   .measuring = all[0],
                   .forwarding = {all[1], all[all.size() > 2 ? 2 : 1]},
                   .others = all});
  }
  return out;
}

void run_on(const std::vector<unsigned>& processors) {
  cpu_set_t set;
  CPU_ZERO(&set);
  for (const unsigned processor : processors) {
    CPU_SET(processor, &set);
  }
  require(sched_setaffinity(0, sizeof set, &set) == 0,
          "a thread cannot be restricted to processors");
}

}  // namespace linegate::bench

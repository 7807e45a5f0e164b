// SPDX-License-Identifier: Apache-2.0
#include <cstdio>
#include <string>

#include <gtest/gtest.h>

#include "tests/plant/environment.h"
#include "tests/plant/generator.h"
#include "tests/plant/lss_generator.h"
#include "tests/plant/scenario.h"

namespace linegate::plant {
namespace {

// LINEGATE_PLANT_SEED and LINEGATE_PLANT_COUNT select other plants, as for the other random plants.
TEST(RandomLssPlants, NoNodeIdIsGivenThatAnotherDeviceUses) {
  constexpr unsigned long kFirstSeed = 20260201;
  constexpr unsigned long kPlants = 120;
  const auto [first, count] = seeds_of_run(kFirstSeed, kPlants);
  const bool shrinks = from_environment("LINEGATE_PLANT_SHRINK", 1) != 0;
  std::printf("random LSS plants: %lu from seed %lu on\n", count, first);
  for (unsigned long seed = first; seed < first + count; ++seed) {
    const std::string text = generate_lss(seed);
    const Outcome outcome = run_scenario("LSS seed " + std::to_string(seed), text, seed);
    ASSERT_TRUE(outcome.ok()) << outcome.failure << "\nlast events:\n"
                              << outcome.history << "\nscenario:\n"
                              << (shrinks ? shrink(text, seed) : text);
  }
}

}  // namespace
}  // namespace linegate::plant

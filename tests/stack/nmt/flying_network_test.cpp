// SPDX-License-Identifier: Apache-2.0
#include "flying_network.h"

#include <cstdio>

#include <gtest/gtest.h>

#include "tests/plant/environment.h"

namespace linegate::nmt {
namespace {

// LINEGATE_PLANT_SEED and LINEGATE_PLANT_COUNT select other networks, as for the random plants.
TEST(RandomFlyingMasters, EachPartOfTheBusHasExactlyOneMasterInTheEnd) {
  const auto [first, count] = plant::seeds_of_run(20260301, 200);
  std::printf("random flying masters: %lu from seed %lu on\n", count, first);
  double latest = 0;  // of the bound
  for (unsigned long seed = first; seed < first + count; ++seed) {
    FlyingNetwork network(seed);
    ASSERT_EQ(network.run(), "") << "seed " << seed;
    latest = std::max(latest, static_cast<double>(network.settled().count()) /
                                  static_cast<double>(network.bound().count()));
  }
  std::printf("settled after at most %.0f %% of the bound\n", 100 * latest);
}

}  // namespace
}  // namespace linegate::nmt

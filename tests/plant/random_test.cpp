// SPDX-License-Identifier: Apache-2.0
#include <cstdio>
#include <string>

#include <gtest/gtest.h>

#include "tests/plant/environment.h"
#include "tests/plant/generator.h"
#include "tests/plant/scenario.h"

namespace linegate::plant {
namespace {

constexpr unsigned long kFirstSeed = 20260101;
constexpr unsigned kPlants = 240;
constexpr unsigned kParts = 4;  // number of parts that may run at the same time
constexpr unsigned kFdPlants = 40;

class PartOfRandomPlants : public testing::TestWithParam<unsigned> {};

// have_own_outputs: a third of these plants; a model without comparisons cannot fail.
void run_plants(unsigned long first, unsigned long count, bool have_own_outputs) {
  constexpr unsigned long kEnough = 15;
  std::printf("random plants: %lu from seed %lu on\n", count, first);
  const bool shrinks = from_environment("LINEGATE_PLANT_SHRINK", 1) != 0;
  unsigned long frames = 0;
  unsigned long steps = 0;
  Outcome sum;
  for (unsigned long seed = first; seed < first + count; ++seed) {
    const std::string text = generate(seed);
    const Outcome outcome = run_scenario("seed " + std::to_string(seed), text, seed);
    frames += outcome.frames;
    steps += outcome.steps;
    sum.outputs += outcome.outputs;
    sum.own_outputs += outcome.own_outputs;
    sum.own_writes += outcome.own_writes;
    ASSERT_TRUE(outcome.ok()) << outcome.failure << "\nlast events:\n"
                              << outcome.history << "\nscenario:\n"
                              << (shrinks ? shrink(text, seed) : text);
  }
  std::printf(
      "random plants: %lu plants, %lu frames, %lu steps, compared %lu outputs, %lu own "
      "outputs, %lu own writes\n",
      count, frames, steps, sum.outputs, sum.own_outputs, sum.own_writes);
  EXPECT_GE(frames, count * 100);
  if (count >= kEnough) {
    EXPECT_GE(sum.outputs, count * 100);
    EXPECT_EQ(sum.own_outputs > count * 10, have_own_outputs);
    EXPECT_EQ(sum.own_writes > 0, have_own_outputs);
  }
}

// LINEGATE_PLANT_SEED and LINEGATE_PLANT_COUNT select other plants: a failure is repeated with its
// seed and a count of 1, also of a plant of CANopen FD. With LINEGATE_PLANT_SHRINK=0 a failing
// plant is not shrunken.
TEST_P(PartOfRandomPlants, HoldsEveryOracleAndComesToRest) {
  const Seeds all = seeds_of_run(kFirstSeed, kPlants);
  const unsigned long begin = all.count * GetParam() / kParts;
  const unsigned long count = all.count * (GetParam() + 1) / kParts - begin;
  run_plants(all.first + begin, count, true);
}

INSTANTIATE_TEST_SUITE_P(Random, PartOfRandomPlants, testing::Range(0U, kParts));

// LINEGATE_PLANT_FD_COUNT is their number.
TEST(RandomPlants, OfCanopenFdHoldEveryOracleAndComeToRest) {
  const unsigned long usual = kIsSanitized ? kFdPlants / 4 : kFdPlants;
  run_plants(kFirstFdSeed, from_environment("LINEGATE_PLANT_FD_COUNT", usual), false);
}

TEST(RandomPlants, TheSameSeedIsTheSamePlantFrameByFrame) {
  for (const unsigned long seed : {kFirstSeed, kFirstFdSeed}) {
    const std::string text = generate(seed);
    EXPECT_EQ(text, generate(seed));
    EXPECT_EQ(run_scenario("a", text, seed).frames, run_scenario("b", text, seed).frames);
  }
}

TEST(RandomPlants, AFailureIsShrunkToWhatItNeeds) {
  const std::string text =
      "line x\ndevice 1 encoder\ndevice 2 drive\nat 3s\nat 4s node 1 dies\nat 4500ms sdo read a 2 "
      "1018:1\n"
      "expect node 1 missing within 1s\nexpect node 1 pre-operational within 100ms\n";
  ASSERT_FALSE(run_scenario("x", text, 1).ok());
  const std::string shrunken = shrink(text, 1);
  EXPECT_EQ(shrunken.find("sdo"), std::string::npos) << shrunken;
  EXPECT_EQ(shrunken.find("drive"), std::string::npos) << shrunken;
  EXPECT_FALSE(run_scenario("x", shrunken, 1).ok());
}

TEST(RandomPlants, AnExpectationOfADeviceIsNotShrunkToItsAbsence) {
  const std::string text =
      "line x\ndevice 1 encoder\nat 3s node 1 dies\nat 3s node 1 unplugged\nat 4s node 1 returns\n"
      "at 4s node 1 plugged\nat 6s nmt stop 1\nat 7s\nexpect node 1 operational within 1s\n";
  const std::string shrunken = shrink(text, 1);
  EXPECT_NE(shrunken.find("nmt stop"), std::string::npos) << shrunken;
  EXPECT_EQ(shrunken.find("dies"), std::string::npos) << shrunken;
  EXPECT_EQ(shrunken.find("unplugged"), std::string::npos) << shrunken;
}

}  // namespace
}  // namespace linegate::plant

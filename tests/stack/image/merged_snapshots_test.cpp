// SPDX-License-Identifier: Apache-2.0
#include "stack/image/merged_snapshots.h"

#include <chrono>
#include <cstdint>
#include <map>
#include <random>
#include <vector>

#include <gtest/gtest.h>

namespace linegate::image {
namespace {

PdoMark mark(std::uint16_t pdo, std::uint32_t count, int microseconds) {
  return {
      .local_pdo = pdo, .count = count, .time = Instant{std::chrono::microseconds(microseconds)}};
}

TEST(AddMarks, CountsAddUpAndTimesAreTheNewest) {
  std::vector<PdoMark> marks{mark(1, 2, 10), mark(4, 1, 11)};
  std::vector<PdoMark> scratch;
  add_marks(marks, {mark(4, 5, 20), mark(9, 1, 21)}, scratch);
  ASSERT_EQ(marks.size(), 3U);
  EXPECT_EQ(marks[0].count, 2U);
  EXPECT_EQ(marks[1].count, 6U);
  EXPECT_EQ(marks[1].time, Instant{std::chrono::microseconds(20)});
  EXPECT_EQ(marks[2].local_pdo, 9);
}

// Against a map by PDO.
TEST(AddMarks, AnySeriesIsTheSumOfItsSnapshotsInTheOrderOfThePdos) {
  const std::uint64_t seed = std::random_device()();
  SCOPED_TRACE(seed);
  std::mt19937_64 random(seed);
  std::vector<PdoMark> marks;
  std::vector<PdoMark> scratch;
  std::map<std::uint16_t, PdoMark> expected;
  for (int time = 0; time < 1000; ++time) {
    std::vector<PdoMark> newer;
    for (std::uint16_t pdo = 1; pdo <= 20; ++pdo) {
      if (random() % 4 == 0) {
        newer.push_back(mark(pdo, 1 + static_cast<std::uint32_t>(random() % 3), time));
        PdoMark& sum = expected[pdo];
        sum = mark(pdo, sum.count + newer.back().count, time);
      }
    }
    add_marks(marks, newer, scratch);
    ASSERT_EQ(marks.size(), expected.size());
    auto each = marks.begin();
    for (const auto& [pdo, sum] : expected) {
      ASSERT_EQ(each->local_pdo, pdo);
      ASSERT_EQ(each->count, sum.count);
      ASSERT_EQ((each++)->time, sum.time);
    }
  }
}

TEST(LastPublished, TheFirstAndEachChangeOfAValueOrAMarkAreNews) {
  Snapshot snapshot{.valid = {0}, .known = {0}};
  const std::vector<std::uint64_t> none{0};
  LastPublished last;
  EXPECT_TRUE(last.differs(snapshot, none)) << "nothing was seen before";
  last.set(snapshot);
  EXPECT_FALSE(last.differs(snapshot, none));
  EXPECT_TRUE(last.differs(snapshot, {4}));
  snapshot.valid = {1};
  EXPECT_TRUE(last.differs(snapshot, none));
  last.set(snapshot);
  EXPECT_FALSE(last.differs(snapshot, none));
  snapshot.known = {1};
  EXPECT_TRUE(last.differs(snapshot, none));
}

}  // namespace
}  // namespace linegate::image

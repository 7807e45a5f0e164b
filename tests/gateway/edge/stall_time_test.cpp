// SPDX-License-Identifier: Apache-2.0
#include "gateway/edge/stall_time.h"

#include <chrono>
#include <filesystem>
#include <fstream>
#include <string>

#include <gtest/gtest.h>
#include <unistd.h>

namespace linegate::gateway {
namespace {

using namespace std::chrono_literals;
namespace folders = std::filesystem;

class StallTimeTest : public testing::Test {
 protected:
  StallTimeTest() { use(7, 0ms, 0ms), use(8, 0ms, 0ms); }
  ~StallTimeTest() override { folders::remove_all(tasks_); }

  // Since the start of the thread.
  void use(int thread, Duration running, Duration waiting) const {
    const std::string folder = tasks_ + "/" + std::to_string(thread);
    folders::create_directories(folder);
    std::ofstream(folder + "/schedstat") << running.count() << ' ' << waiting.count() << " 7\n";
  }

  const std::string tasks_ = testing::TempDir() + "stall_time_" + std::to_string(getpid());
  StallTime stalls_{tasks_};
  Instant begin_{1h};
};

TEST_F(StallTimeTest, AThreadThatIsBlockedCountsWhole) {
  EXPECT_EQ(stalls_.count(7, 10ms, begin_ + 10ms), 10ms);
  EXPECT_EQ(stalls_.count(7, 110ms, begin_ + 110ms), 110ms);
  EXPECT_EQ(stalls_.count(7, 2s, begin_ + 2s), 2s);
}

TEST_F(StallTimeTest, WaitsForAProcessorDoNotCountOfAThreadThatSleeps) {
  stalls_.count(7, 60ms, begin_ + 60ms);
  use(8, 0ms, 900ms);
  EXPECT_EQ(stalls_.count(7, 1060ms, begin_ + 1060ms), 160ms);
}

TEST_F(StallTimeTest, AThreadThatRunsAllTheTimeLoops) {
  stalls_.count(7, 60ms, begin_ + 60ms);
  use(7, 700ms, 300ms);
  use(8, 0ms, 900ms);
  EXPECT_EQ(stalls_.count(7, 1060ms, begin_ + 1060ms), 1s);
}

// Several threads wait for the same lock on an overloaded machine.
TEST_F(StallTimeTest, ForTheNextThreadTheWaitsSinceItsBeginDoNotCountEither) {
  stalls_.count(7, 100ms, begin_ + 100ms);
  use(8, 0ms, 500ms);
  stalls_.count(7, 700ms, begin_ + 700ms);
  use(8, 0ms, 1300ms);
  EXPECT_EQ(stalls_.count(8, 1400ms, begin_ + 1500ms), 100ms) << "thread 7 has gone on";
}

TEST_F(StallTimeTest, WaitsBeforeItsBeginDoNotMatter) {
  stalls_.count(7, 100ms, begin_ + 100ms);
  use(8, 0ms, 5s);
  stalls_.count(7, 700ms, begin_ + 700ms);
  stalls_.count(7, 800ms, begin_ + 800ms);
  EXPECT_EQ(stalls_.count(8, 700ms, begin_ + 1400ms), 700ms);
}

TEST_F(StallTimeTest, AfterAPauseEachStallIsANewOne) {
  stalls_.count(7, 100ms, begin_ + 100ms);
  use(8, 0ms, 5s);
  stalls_.count(7, 0ms, begin_ + 200ms);
  EXPECT_EQ(stalls_.count(7, 500ms, begin_ + 700ms), 500ms);
}

TEST_F(StallTimeTest, AStallThatDoesNotEndIsCountedFromItsBegin) {
  for (int i = 1; i <= 1000; ++i) {
    ASSERT_EQ(stalls_.count(7, i * 100ms, begin_ + i * 100ms), i * 100ms);
  }
  use(8, 0ms, 60s);
  EXPECT_EQ(stalls_.count(7, 101s, begin_ + 101s), 41s);
}

}  // namespace
}  // namespace linegate::gateway

// SPDX-License-Identifier: Apache-2.0
#include "gateway/edge/run_delay.h"

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

class RunDelayTest : public testing::Test {
 protected:
  RunDelayTest() { folders::create_directories(tasks_); }
  ~RunDelayTest() override { folders::remove_all(tasks_); }

  // running, waiting: in ns
  void set(const std::string& thread, long running, long waiting) const {
    folders::create_directories(tasks_ + "/" + thread);
    std::ofstream(tasks_ + "/" + thread + "/schedstat") << running << ' ' << waiting << " 7\n";
  }

  const std::string tasks_ = testing::TempDir() + "run_delay_" + std::to_string(getpid());
  RunDelay delay_{tasks_};
};

TEST_F(RunDelayTest, IsThatOfTheThreadThatWaitedLongest) {
  set("11", 1'000, 5'000'000);
  set("12", 9'000'000, 0);
  delay_.begin();
  EXPECT_EQ(delay_.longest(), 0ns);
  set("11", 1'000, 5'000'300);
  set("12", 9'900'000, 200);
  EXPECT_EQ(delay_.longest(), 300ns);
}

TEST_F(RunDelayTest, ThreadsThatStartedLaterOrEndedDoNotCount) {
  set("11", 0, 5'000);
  delay_.begin();
  set("13", 0, 400);
  folders::remove_all(tasks_ + "/11");
  EXPECT_EQ(delay_.longest(), 0ns);
}

TEST_F(RunDelayTest, IsZeroIfTheKernelDoesNotReportIt) {
  folders::create_directories(tasks_ + "/11");
  delay_.begin();
  EXPECT_EQ(delay_.longest(), 0ns);
}

}  // namespace
}  // namespace linegate::gateway

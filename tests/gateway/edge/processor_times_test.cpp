// SPDX-License-Identifier: Apache-2.0
#include "gateway/edge/processor_times.h"

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

class ProcessorTimesTest : public testing::Test {
 protected:
  ProcessorTimesTest() { folders::create_directories(tasks_); }
  ~ProcessorTimesTest() override { folders::remove_all(tasks_); }

  // running, waiting: in ns
  void set(const std::string& thread, long running, long waiting) const {
    folders::create_directories(tasks_ + "/" + thread);
    std::ofstream(tasks_ + "/" + thread + "/schedstat") << running << ' ' << waiting << " 7\n";
  }

  const std::string tasks_ = testing::TempDir() + "processor_times_" + std::to_string(getpid());
  ProcessorTimes times_{tasks_};
};

TEST_F(ProcessorTimesTest, HasTheRunningTimeOfAThreadAndTheWaitingTimeOfAll) {
  set("11", 1'000, 5'000'000);
  set("12", 9'000'000, 0);
  const auto before = times_.read();
  EXPECT_EQ(use_between(before, times_.read(), 12).waiting_of_all, 0ns);
  set("11", 1'000, 5'000'300);
  set("12", 9'900'000, 200);
  const auto after = times_.read();
  EXPECT_EQ(use_between(before, after, 12).waiting, 200ns);
  EXPECT_EQ(use_between(before, after, 12).waiting_of_all, 500ns);
  EXPECT_EQ(use_between(before, after, 12).running, 900'000ns);
  EXPECT_EQ(use_between(before, after, 11).running, 0ns);
  EXPECT_EQ(use_between(before, after, 14).running, 0ns);
}

TEST_F(ProcessorTimesTest, ThreadsThatStartedLaterOrEndedDoNotCount) {
  set("11", 0, 5'000);
  const auto before = times_.read();
  set("13", 0, 400);
  folders::remove_all(tasks_ + "/11");
  EXPECT_EQ(use_between(before, times_.read(), 11).waiting_of_all, 0ns);
}

TEST_F(ProcessorTimesTest, IsZeroIfTheKernelDoesNotReportIt) {
  folders::create_directories(tasks_ + "/11");
  EXPECT_TRUE(times_.read().empty());
}

}  // namespace
}  // namespace linegate::gateway

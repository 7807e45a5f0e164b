// SPDX-License-Identifier: Apache-2.0
// After a stop signal a program ends in time, whatever its threads do.
#include "gateway/runtime/signals.h"

#include <chrono>
#include <csignal>
#include <thread>

#include <gtest/gtest.h>
#include <unistd.h>

#include "gateway/runtime/exit_code.h"

namespace linegate::gateway {
namespace {

using namespace std::chrono_literals;

[[noreturn]] void never_end() {
  for (;;) {
    std::this_thread::sleep_for(1s);
  }
}

class LimitEndTest : public testing::Test {
 protected:
  void SetUp() override { GTEST_FLAG_SET(death_test_style, "threadsafe"); }

  static void begin(Duration limit = 1s) {
    block_stop_signals();
    limit_end(limit);
  }
};

// Like a main() that waits for a thread of a library.
TEST_F(LimitEndTest, EndsAProgramThatTookTheSignalAndDoesNotEnd) {
  EXPECT_EXIT(
      {
        begin();
        ::kill(::getpid(), SIGTERM);
        wait_for_stop_signal();
        never_end();
      },
      testing::ExitedWithCode(kExitForced), "did not end within 1000 ms after the stop signal");
}

TEST_F(LimitEndTest, EndsAProgramThatDoesNotTakeTheSignal) {
  EXPECT_EXIT(
      {
        begin();
        ::kill(::getpid(), SIGINT);
        never_end();
      },
      testing::ExitedWithCode(kExitForced), "the process ends without it");
}

TEST_F(LimitEndTest, EndsAProgramThatCaughtTheSignalAndDoesNotEnd) {
  EXPECT_EXIT(
      {
        catch_stop_signals();
        ::kill(::getpid(), SIGTERM);
        never_end();
      },
      testing::ExitedWithCode(kExitForced), "the process ends without it");
}

// Like the end of a participant that waits for a thread of a library.
TEST_F(LimitEndTest, EndsAProgramInAScopeWithoutEnd) {
  EXPECT_EXIT(
      {
        const TimeToEnd limit(1s);
        never_end();
      },
      testing::ExitedWithCode(kExitForced), "the process ends without it");
}

TEST_F(LimitEndTest, LeavesAProgramAloneAfterTheScope) {
  EXPECT_EXIT(
      {
        { const TimeToEnd limit(1s); }
        std::this_thread::sleep_for(1'500ms);
        ::_exit(0);
      },
      testing::ExitedWithCode(0), "");
}

TEST_F(LimitEndTest, LeavesAProgramAloneThatEndsInTime) {
  EXPECT_EXIT(
      {
        begin(60s);
        ::kill(::getpid(), SIGTERM);
        const auto received = wait_for_signal(10s);
        std::_Exit(received && received->number == SIGTERM ? 0 : 1);
      },
      testing::ExitedWithCode(0), "");
}

// An event of the gateway names who requested a reload.
TEST(WaitForSignal, NamesTheProcessThatSentIt) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  EXPECT_EXIT(
      {
        block_reload_signal();
        const pid_t sender = ::fork();
        if (sender == 0) {
          ::kill(::getppid(), SIGHUP);
          std::_Exit(0);
        }
        const auto received = wait_for_signal(10s);
        const bool known = received && received->number == SIGHUP && received->sender &&
                           received->sender->process == sender &&
                           received->sender->user == ::getuid();
        std::_Exit(known ? 0 : 1);
      },
      testing::ExitedWithCode(0), "");
}

TEST_F(LimitEndTest, LeavesAProgramAloneThatGetsNoSignal) {
  EXPECT_EXIT(
      {
        begin();
        std::this_thread::sleep_for(2s);
        std::_Exit(0);
      },
      testing::ExitedWithCode(0), "");
}

}  // namespace
}  // namespace linegate::gateway

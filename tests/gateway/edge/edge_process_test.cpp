// SPDX-License-Identifier: Apache-2.0
#include "gateway/edge/edge_process.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <functional>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>
#include <sys/resource.h>

#include "gateway/edge/edge_end.h"

#include "tests/dds/sanitizers.h"

namespace linegate::gateway {
namespace {

using namespace std::chrono_literals;

TEST(RestartPauses, DoubleWhileAProcessDiesSoonAndEndWhenOneRanForLong) {
  RestartPauses pauses(10s);
  EXPECT_EQ(pauses.after(9s), 0s);
  EXPECT_EQ(pauses.after(1s), 250ms);
  EXPECT_EQ(pauses.after(1s), 500ms);
  for (int i = 0; i < 20; ++i) {
    pauses.after(0s);
  }
  EXPECT_EQ(pauses.after(0s), 30s);
  EXPECT_EQ(pauses.after(10s), 0s);
  EXPECT_EQ(pauses.after(0s), 250ms);
}

class ProgressLimitTest : public testing::Test {
 protected:
  ProgressLimitTest() { limit_.begin(now_); }

  // Looks every 200 ms while `time` passes; returns the last result.
  bool pass(Duration time, std::array<std::uint64_t, 2> counters) {
    bool good = true;
    for (; time > Duration::zero() && good; time -= 200ms) {
      now_ += 200ms;
      good = limit_.look(counters, now_);
    }
    return good;
  }
  // Both counters change each time after that interval. Returns the last result.
  bool step(Duration interval, int times) {
    bool good = true;
    for (; times > 0 && good; --times) {
      good = pass(interval, {step_, step_});
      ++step_;
    }
    return good;
  }
  // How long the process hangs until that is found.
  Duration hang() {
    const Instant begin = now_;
    while (pass(200ms, {step_, step_})) {
    }
    return now_ - begin;
  }

  Instant now_{Duration{1s}};
  std::uint64_t step_ = 1;
  ProgressLimit limit_;
};

TEST_F(ProgressLimitTest, EachCounterMustChange) {
  EXPECT_TRUE(pass(200ms, {1, 1}));
  EXPECT_TRUE(pass(200ms, {2, 2}));
  EXPECT_FALSE(pass(2s, {3, 2}));
}

TEST_F(ProgressLimitTest, AHangIsFoundWithin2Seconds) {
  EXPECT_TRUE(pass(200ms, {1, 1}));
  EXPECT_TRUE(pass(1'400ms, {1, 1}));
  EXPECT_FALSE(pass(200ms, {1, 1}));
}

// Slower and slower, as on a machine where others take the processors.
TEST_F(ProgressLimitTest, AProcessThatBecomesSlowerDoesNotHang) {
  for (const Duration interval : {400ms, 1'000ms, 2'800ms, 6'000ms}) {
    EXPECT_TRUE(step(interval, 5)) << interval.count();
  }
  EXPECT_GE(hang(), 8s);
}

TEST_F(ProgressLimitTest, TheLimitOfASlowProcessIsBounded) {
  EXPECT_TRUE(step(1'000ms, 3) && step(3'600ms, 3) && step(9'600ms, 3));
  EXPECT_LE(hang(), ProgressLimit::kLongestToContinue + 200ms);
}

TEST_F(ProgressLimitTest, AfterSlownessAHangIsFoundWithin2SecondsAgain) {
  EXPECT_TRUE(step(1'000ms, 5));
  EXPECT_TRUE(step(200ms, 200));
  EXPECT_LE(hang(), 2s);
}

TEST_F(ProgressLimitTest, TheNextProcessOfASlowMachineHasItsLimit) {
  EXPECT_TRUE(step(1'000ms, 5));
  limit_.begin(now_);
  EXPECT_TRUE(pass(200ms, {1, 1}));
  EXPECT_TRUE(pass(2'400ms, {1, 1}));
}

TEST_F(ProgressLimitTest, TheStartMayTakeLonger) {
  EXPECT_TRUE(pass(14s, {0, 0}));
  EXPECT_FALSE(pass(2s, {0, 0}));
}

TEST_F(ProgressLimitTest, TheStartAfterOneThatFailedMayTakeTwiceAsLong) {
  EXPECT_FALSE(pass(20s, {0, 0}));
  limit_.begin(now_);
  EXPECT_TRUE(pass(29s, {0, 0}));
  EXPECT_FALSE(pass(2s, {0, 0}));
  for (int i = 0; i < 5; ++i) {
    limit_.begin(now_);
    EXPECT_FALSE(pass(61s, {0, 0}));
  }
  limit_.begin(now_);
  EXPECT_TRUE(pass(59s, {0, 0}));
  EXPECT_TRUE(pass(200ms, {1, 1}));
  limit_.begin(now_);
  EXPECT_FALSE(pass(16s, {0, 0}));
}

TEST_F(ProgressLimitTest, AProcessThatDiesAtItsStartDoesNotExtendIt) {
  EXPECT_TRUE(pass(1s, {0, 0}));
  limit_.begin(now_);
  EXPECT_FALSE(pass(16s, {0, 0}));
}

TEST_F(ProgressLimitTest, ADelayOfThisProcessIsNotOneOfTheOther) {
  EXPECT_TRUE(pass(200ms, {1, 1}));
  now_ += 1h;
  EXPECT_TRUE(limit_.look(std::array<std::uint64_t, 2>{1, 1}, now_));
}

// Any program may be in the place of the process: here the shell.
class EdgeProcessTest : public testing::Test {
 protected:
  // memory: EdgeProcess::Options::memory
  std::unique_ptr<EdgeProcess> run(const std::string& script, std::size_t memory = 0) {
    const auto note = [this](Severity, std::string_view text) {
      const std::lock_guard lock(mutex_);
      lines_.emplace_back(text);
    };
    return std::make_unique<EdgeProcess>(
        EdgeProcess::Options{.program = "/bin/sh",
                             .arguments = {"sh", "-c", script},
                             .name = "test",
                             .memory = memory,
                             .ended =
                                 [this](const auto& end) {
                                   const std::lock_guard lock(mutex_);
                                   ends_.push_back(end);
                                 },
                             .changed =
                                 [this](auto condition, Instant start_due) {
                                   const std::lock_guard lock(mutex_);
                                   conditions_.push_back({condition, start_due});
                                 },
                             .log = note,
                             .output = note});
  }
  bool logged(const std::string& text) {
    for (int i = 0; i < 1'000; ++i) {
      {
        const std::lock_guard lock(mutex_);
        for (const std::string& line : lines_) {
          if (line.find(text) != std::string::npos) {
            return true;
          }
        }
      }
      std::this_thread::sleep_for(10ms);
    }
    return false;
  }

  static bool eventually(const std::function<bool()>& condition) {
    for (int i = 0; i < 1'000 && !condition(); ++i) {
      std::this_thread::sleep_for(10ms);
    }
    return condition();
  }

  // The first one, which was reported before its line appeared in the log, or is reported soon.
  EdgeProcess::Options::End first_end() {
    eventually([&] {
      const std::lock_guard lock(mutex_);
      return !ends_.empty();
    });
    const std::lock_guard lock(mutex_);
    return ends_.empty() ? EdgeProcess::Options::End{} : ends_.front();
  }

  std::mutex mutex_;
  std::vector<std::string> lines_;
  std::vector<EdgeProcess::Options::End> ends_;
  std::vector<std::pair<EdgeProcess::Options::Condition, Instant>> conditions_;
};

TEST_F(EdgeProcessTest, ReportsTheEndOfAProcessAndStartsAnother) {
  const auto process = run("exit 7");
  EXPECT_TRUE(logged("ended with exit code 7; it is started again"));
  EXPECT_TRUE(logged("it is started again in 250 ms"));
  EXPECT_EQ(first_end().cause, event::ProcessEnd::exited);
  EXPECT_EQ(first_end().detail, 7U);
  EXPECT_EQ(first_end().words, "ended with exit code 7");
}

// The limit of its data would be reached much later: the shell has none.
TEST_F(EdgeProcessTest, AProcessThatUsesTooMuchMemoryIsReplaced) {
  const auto process =
      run("text=$(head -c 40000000 /dev/zero | tr '\\0' x); sleep 60; echo $text", 20'000'000);
  EXPECT_TRUE(logged("MB of memory, more than the permitted 20 MB; it is started again"));
  EXPECT_EQ(first_end().cause, event::ProcessEnd::memory);
}

TEST_F(EdgeProcessTest, AProcessWithinItsMemoryRuns) {
  const auto process = run("echo ready; sleep 60", 20'000'000);
  ASSERT_TRUE(logged("ready"));
  std::this_thread::sleep_for(500ms);  // several looks
  EXPECT_EQ(process->number(), 1U);
}

TEST_F(EdgeProcessTest, ReportsASignalInWords) {
  const auto process = run("kill -ABRT $$");
  EXPECT_TRUE(logged("was ended by signal 6 (Aborted)"));
  EXPECT_EQ(first_end().cause, event::ProcessEnd::signal);
  EXPECT_EQ(first_end().detail, 6U);
}

TEST_F(EdgeProcessTest, ReportsThatTheMemoryWasUsedUp) {
  const auto process = run("exit " + std::to_string(kExitOutOfMemory));
  EXPECT_TRUE(logged("ended because it had used up its memory"));
  EXPECT_EQ(first_end().cause, event::ProcessEnd::memory);
}

TEST_F(EdgeProcessTest, ReportsAProcessThatDoesNotRespond) {
  const auto process =
      run("printf '\\001' | dd bs=1 seek=384 conv=notrunc of=/proc/self/fd/3 2>/dev/null;"
          "printf '\\001' | dd bs=1 seek=448 conv=notrunc of=/proc/self/fd/3 2>/dev/null;"
          "exec sleep 1000");
  EXPECT_TRUE(logged("was ended: it did not respond; it is started again"));
  EXPECT_EQ(first_end().cause, event::ProcessEnd::no_response);
}

// Octets 384 and 448 are the counters of its progress (shared_rings.cpp).
TEST_F(EdgeProcessTest, ReportsEachConditionOnce) {
  using enum EdgeProcess::Options::Condition;
  const auto process =
      run("sleep 1; printf '\\001' | dd bs=1 seek=384 conv=notrunc of=/proc/self/fd/3 2>/dev/null;"
          "printf '\\001' | dd bs=1 seek=448 conv=notrunc of=/proc/self/fd/3 2>/dev/null;"
          "exec sleep 1000");
  const std::vector wanted{starting, working, hangs, waits, starting};
  ASSERT_TRUE(eventually([&] {
    const std::lock_guard lock(mutex_);
    return conditions_.size() >= wanted.size();
  }));
  const std::lock_guard lock(mutex_);
  for (std::size_t i = 0; i < wanted.size(); ++i) {
    EXPECT_EQ(conditions_[i].first, wanted[i]) << i;
  }
}

TEST_F(EdgeProcessTest, ReportsWhenItStartsTheProcess) {
  using enum EdgeProcess::Options::Condition;
  const auto process = run("exit 7");  // paused for 250 ms after its second end
  ASSERT_TRUE(eventually([&] {
    const std::lock_guard lock(mutex_);
    return conditions_.size() >= 5;
  }));
  const std::lock_guard lock(mutex_);
  EXPECT_EQ(conditions_[3].first, waits);
  EXPECT_GT(conditions_[3].second, conditions_[1].second + 200ms);
  EXPECT_EQ(conditions_[4].first, starting);
}

TEST_F(EdgeProcessTest, PassesItsOutputToTheLog) {
  const auto process = run("echo first; echo '<4>second' >&2; printf third; exit 0");
  EXPECT_TRUE(logged("first"));
  EXPECT_TRUE(logged("second"));
  EXPECT_TRUE(logged("third"));
}

TEST_F(EdgeProcessTest, RejectsAProcess) {
  const auto process = run("sleep 1000");
  process->reject(process->number(), "it lies");
  EXPECT_TRUE(logged("was ended: it lies; it is started again"));
  EXPECT_EQ(first_end().cause, event::ProcessEnd::malformed);
}

#ifndef LINEGATE_TESTS_ARE_SANITIZED  // the sanitizers open descriptors themselves
TEST_F(EdgeProcessTest, ARefusalOfTheSystemIsReportedAndTriedAgain) {
  const auto process = run("exec sleep 1000");
  rlimit before{};
  ASSERT_EQ(getrlimit(RLIMIT_NOFILE, &before), 0);
  const rlimit no_more{3, before.rlim_max};  // no descriptor can be opened
  ASSERT_EQ(setrlimit(RLIMIT_NOFILE, &no_more), 0);
  process->reject(process->number(), "it lies");
  const bool reported = logged("the test process cannot be started: ");
  ASSERT_EQ(setrlimit(RLIMIT_NOFILE, &before), 0);
  EXPECT_TRUE(reported);
  EXPECT_TRUE(eventually([&] { return process->number() > 1; }));
  const std::lock_guard lock(mutex_);
  EXPECT_TRUE(std::any_of(ends_.begin(), ends_.end(), [](const auto& end) {
    return end.cause == event::ProcessEnd::not_started && end.detail == EMFILE;
  }));
}
#endif

// Bytes for the memory of the process: one message of one octet in the ring to the gateway.
TEST_F(EdgeProcessTest, ReceivesNothingMoreFromARejectedProcess) {
  // Offset 192 is the tail of the second ring, 4096 + 8 MiB its first octet (shared_rings.cpp).
  const auto process =
      run("put() { printf \"$2\" | dd bs=1 seek=$1 conv=notrunc of=/proc/self/fd/3 2>/dev/null; };"
          "put 8392704 '\\001\\000\\000\\000x'; put 8392712 '\\001\\000\\000\\000y';"
          "put 192 '\\020'; echo written; exec sleep 1000");
  ASSERT_TRUE(logged("written"));
  std::vector<std::byte> received;
  EXPECT_EQ(process->receive(received), 1U);
  EXPECT_EQ(received, std::vector<std::byte>{std::byte{'x'}});
  process->reject(1, "it lies");
  EXPECT_EQ(process->receive(received), 0U);
}

TEST_F(EdgeProcessTest, NeverWaitsForAProcessThatReadsNothing) {
  const auto process = run("exec sleep 1000");
  const std::vector<std::byte> message(100'000);
  int sent = 0;
  while (process->send(process->number(), message)) {
    ++sent;
  }
  EXPECT_GT(sent, 10);
  EXPECT_EQ(process->positions(process->number()).done, 0U);
  EXPECT_FALSE(process->send(process->number() + 1, message));
  std::vector<std::byte> received;
  EXPECT_EQ(process->receive(received), 0U);
}

TEST_F(EdgeProcessTest, ReplacesAProcessThatDamagesTheMemory) {
  // Writes over all of the memory; descriptor 3 is the memory, see edge_end.h.
  const auto process = run("head -c 4096 /dev/zero | tr '\\0' '\\377' >&3; exec sleep 1000");
  std::vector<std::byte> received;
  bool reported = false;
  for (int i = 0; i < 1'000 && !reported; ++i) {
    process->receive(received);
    process->wait(10ms);
    const std::lock_guard lock(mutex_);
    for (const std::string& line : lines_) {
      reported = reported || line.find("damaged the memory") != std::string::npos;
    }
  }
  EXPECT_TRUE(reported);
}

TEST_F(EdgeProcessTest, ReplacesAProcessThatSignalsWithoutMessages) {
  const auto process = run("exec yes >&4");  // descriptor 4 is the socket, see edge_end.h
  const auto replaced = [&] {
    process->wait(10ms);
    const std::lock_guard lock(mutex_);
    return std::any_of(lines_.begin(), lines_.end(), [](const std::string& line) {
      return line.find("it signalled without messages; it is started again") != std::string::npos;
    });
  };
  bool reported = false;
  for (int i = 0; i < 10'000 && !reported; ++i) {
    reported = replaced();
  }
  EXPECT_TRUE(reported);
}

TEST_F(EdgeProcessTest, AProcessThatEndsWhenItIsAskedIsReplacedAtOnce) {
  const auto process = run("echo runs; sleep 1");
  ASSERT_TRUE(logged("runs"));
  process->replace(1, "a new list");
  EXPECT_TRUE(logged("is replaced: a new list"));
  EXPECT_TRUE(eventually([&] { return process->number() == 2; }));
  const std::lock_guard lock(mutex_);
  EXPECT_FALSE(std::any_of(lines_.begin(), lines_.end(), [](const std::string& line) {
    return line.find("it is started again") != std::string::npos;
  }));
}

TEST_F(EdgeProcessTest, AProcessThatDoesNotEndIsKilled) {
  const auto process = run("exec sleep 1000");
  process->replace(process->number(), "a new list");
  EXPECT_TRUE(logged("was ended: it did not end when it was asked to; it is started again"));
  EXPECT_TRUE(eventually([&] { return process->number() == 2; }));
}

TEST_F(EdgeProcessTest, AProgramThatDoesNotExistIsAnError) {
  EXPECT_THROW(EdgeProcess({.program = "/nonexistent",
                            .arguments = {"x"},
                            .log = [](Severity, std::string_view) {},
                            .output = [](Severity, std::string_view) {}}),
               std::system_error);
}

}  // namespace
}  // namespace linegate::gateway

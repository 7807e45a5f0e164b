// SPDX-License-Identifier: Apache-2.0
#include "gateway/publish/process_ends.h"

#include <variant>

#include <gtest/gtest.h>

namespace linegate::gateway {
namespace {

using namespace std::chrono_literals;
using event::DdsProcessEnded;
using event::ProcessEnd;

class ProcessEndsTest : public testing::Test {
 protected:
  ProcessEnds ends_{event::DdsProcess::endpoints};
  Instant now_{1h};
};

TEST_F(ProcessEndsTest, TheFirstOneIsReportedAtOnce) {
  EXPECT_FALSE(ends_.pop(now_));
  ends_.note(ProcessEnd::signal, 9, 0ms, "was ended by signal 9 (Killed)", now_);
  const auto notice = ends_.pop(now_);
  ASSERT_TRUE(notice);
  EXPECT_EQ(std::get<DdsProcessEnded>(notice->event), (DdsProcessEnded{ProcessEnd::signal, 9, 1}));
  EXPECT_EQ(notice->text, "the DDS process was ended by signal 9 (Killed); it is started again");
  EXPECT_FALSE(ends_.pop(now_ + 1h));
}

TEST_F(ProcessEndsTest, TheEventNamesTheProcessOfTheRoutes) {
  ProcessEnds ends(event::DdsProcess::routes);
  ends.note(ProcessEnd::signal, 9, 0ms, "was ended by signal 9 (Killed)", now_);
  const auto notice = ends.pop(now_);
  ASSERT_TRUE(notice);
  EXPECT_EQ(std::get<DdsProcessEnded>(notice->event),
            (DdsProcessEnded{ProcessEnd::signal, 9, 1, 0, event::DdsProcess::routes}));
  EXPECT_EQ(notice->text,
            "the DDS routes process was ended by signal 9 (Killed); it is started again");
}

TEST_F(ProcessEndsTest, TheConditionIsInWordsUnlessItWorks) {
  using Condition = ProcessEnds::Condition;
  EXPECT_EQ(ends_.condition(now_), "") << "there may be no process";
  ends_.set_condition(Condition::starting, {});
  EXPECT_EQ(ends_.condition(now_), "DDS process is starting");
  ends_.set_condition(Condition::working, {});
  EXPECT_EQ(ends_.condition(now_), "");
  ends_.set_condition(Condition::hangs, {});
  EXPECT_EQ(ends_.condition(now_), "DDS process hangs, it is started again");
  ends_.set_condition(Condition::waits, now_ + 3500ms);
  EXPECT_EQ(ends_.condition(now_), "DDS process not running, started again in 4 s");
  EXPECT_EQ(ends_.condition(now_ + 1s), "DDS process not running, started again in 3 s");
  EXPECT_EQ(ends_.condition(now_ + 1h), "DDS process not running, started again in 0 s");

  ProcessEnds routes(event::DdsProcess::routes);
  routes.set_condition(Condition::waits, now_ + 2s);
  EXPECT_EQ(routes.condition(now_), "DDS routes process not running, started again in 2 s");
}

TEST_F(ProcessEndsTest, LaterOnesAreJoinedForAMinute) {
  ends_.note(ProcessEnd::exited, 1, 0ms, "ended with exit code 1", now_);
  ASSERT_TRUE(ends_.pop(now_));
  ends_.note(ProcessEnd::exited, 1, 0ms, "ended with exit code 1", now_ + 10s);
  ends_.note(ProcessEnd::exited, 1, 250ms, "ended with exit code 1", now_ + 11s);
  ends_.note(ProcessEnd::no_response, 0, 500ms, "was ended: it did not respond", now_ + 41s);
  EXPECT_FALSE(ends_.pop(now_ + ProcessEnds::kPeriod - 1ns));
  const auto notice = ends_.pop(now_ + ProcessEnds::kPeriod);
  ASSERT_TRUE(notice);
  EXPECT_EQ(std::get<DdsProcessEnded>(notice->event),
            (DdsProcessEnded{ProcessEnd::no_response, 0, 3, 500}));
  EXPECT_EQ(notice->text,
            "the DDS process was ended: it did not respond, 19 s ago; it was started again after "
            "500 ms; 3 ends since the last report: exit 2, no response 1");
}

TEST_F(ProcessEndsTest, OneThatWaitedAndPausesIsStillToStart) {
  ends_.note(ProcessEnd::signal, 9, 0ms, "was ended by signal 9 (Killed)", now_);
  ASSERT_TRUE(ends_.pop(now_));
  ends_.note(ProcessEnd::signal, 9, 8s, "was ended by signal 9 (Killed)",
             now_ + ProcessEnds::kPeriod - 3s);
  EXPECT_FALSE(ends_.pop(now_ + ProcessEnds::kPeriod - 1s));
  const auto notice = ends_.pop(now_ + ProcessEnds::kPeriod);
  ASSERT_TRUE(notice);
  EXPECT_EQ(notice->text,
            "the DDS process was ended by signal 9 (Killed), 3 s ago; it is started again in 8000 "
            "ms");
}

TEST_F(ProcessEndsTest, OneAfterAMinuteIsReportedAtOnce) {
  ends_.note(ProcessEnd::memory, 71, 0ms, "ended because it had used up its memory", now_);
  ASSERT_TRUE(ends_.pop(now_));
  ends_.note(ProcessEnd::memory, 71, 0ms, "ended because it had used up its memory", now_);
  const auto notice = ends_.pop(now_ + ProcessEnds::kPeriod);
  ASSERT_TRUE(notice);
  EXPECT_EQ(std::get<DdsProcessEnded>(notice->event).ends, 1U);
}

}  // namespace
}  // namespace linegate::gateway

// SPDX-License-Identifier: Apache-2.0
#include "gateway/runtime/assertion_report.h"

#include "stack/base/assert.h"

#include "tests/gateway/runtime/line_runner_fixture.h"

namespace linegate::gateway {
namespace {

using AssertionReportDeathTest = LineRunnerTest;

TEST_F(AssertionReportDeathTest, NamesTheLineThatTheThreadRunsAndItsLastEvents) {
  channel_->on_write = [] { LINEGATE_ASSERT(false, "the channel violates one"); };
  EXPECT_DEATH(
      {
        report_assertions();
        make_ready();  // the line starts and writes its first frame
      },
      "^assertion violated: the channel violates one \\(false\\), [^\n]*_test.cpp:[0-9]+\n"
      "on the line a, last events:\n"
      "(  event [0-9]+ [^\n]*\n)*"
      "  event [0-9]+ line-started, node 0, role 0, at [0-9]+ ms\n");
}

TEST_F(AssertionReportDeathTest, OutsideOfALineTheAssertionIsAlone) {
  make_ready();
  EXPECT_DEATH(
      {
        report_assertions();
        LINEGATE_ASSERT(false, "nobody runs a line");
      },
      "^assertion violated: nobody runs a line [^\n]*\n$");
}

TEST_F(AssertionReportDeathTest, LinesNest) {
  const auto other = make_line(plan());
  EXPECT_DEATH(
      {
        report_assertions();
        const RunningLine outer(runner_->line());
        { const RunningLine inner(*other); }
        LINEGATE_ASSERT(false, "the outer line runs");
      },
      "on the line a, last events:\n$");
}

}  // namespace
}  // namespace linegate::gateway

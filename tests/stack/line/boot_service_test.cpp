// SPDX-License-Identifier: Apache-2.0
#include "stack/line/boot_service.h"

#include <gtest/gtest.h>

#include "stack/manager/state.h"

#include "tests/stack/line/service_fixture.h"

namespace linegate::line {
namespace {

struct BootServiceTest : testing::Test {
  void execute(std::uint8_t node, Duration timeout = {}) {
    service.execute({.tag = ++tag, .timeout = timeout, .request = Boot{.node = node}}, parts.now);
  }

  ManagerParts parts;
  RecordingHost host;
  BootService service{host, parts.manager, kOwnNode};
  std::uint64_t tag = 0;
};

TEST_F(BootServiceTest, IsRefusedWhereItMakesNoSense) {
  execute(kOwnNode);
  EXPECT_EQ(host.answer(tag), to_error(Refusal::bad_request));
  execute(128);
  EXPECT_EQ(host.answer(tag), to_error(Refusal::bad_request));
  host.set_usable(false);
  execute(5);
  EXPECT_EQ(host.answer(tag), to_error(Refusal::line_down));
  host.set_manages(false);
  execute(5);
  EXPECT_EQ(host.answer(tag), to_error(Refusal::wrong_role));
  EXPECT_EQ(service.next_wake(), kNever);
}

TEST_F(BootServiceTest, ANodeThatIsNotListedIsReportedAtOnce) {
  execute(99);
  EXPECT_EQ(host.answer(tag), Error{});
  const std::vector expected{manager::BootOutcome{.node = 99, .letter = 'A'}};
  EXPECT_EQ(host.data(tag), ReplyData{expected});
}

TEST_F(BootServiceTest, ACommandEndsAtItsOwnTime) {
  execute(5, seconds(2));
  execute(0, seconds(3));
  EXPECT_EQ(service.next_wake(), parts.now + seconds(2));
  service.advance(parts.now + seconds(2) - Duration(1));
  EXPECT_FALSE(host.answer(1));
  service.advance(parts.now + seconds(2));
  EXPECT_EQ(host.answer(1), to_error(Refusal::timed_out));
  EXPECT_FALSE(host.answer(2));
  EXPECT_EQ(service.next_wake(), parts.now + seconds(3));
}

TEST_F(BootServiceTest, EndAnswersAllCommandsUnderWayOnce) {
  execute(5);
  execute(0);
  EXPECT_EQ(service.next_wake(), kNever);
  service.end(Refusal::cancelled, parts.now);
  EXPECT_EQ(host.answer(1), to_error(Refusal::cancelled));
  EXPECT_EQ(host.answer(2), to_error(Refusal::cancelled));
  service.end(Refusal::cancelled, parts.now);
  service.advance(parts.now + seconds(60));
}

// A client that repeats the command faster than the node boots must not use up memory.
TEST_F(BootServiceTest, ABoundedNumberOfCommandsIsUnderWay) {
  for (std::size_t i = 0; i < BootService::kMost; ++i) {
    execute(5);
    ASSERT_FALSE(host.answer(tag)) << i;
  }
  execute(5);
  EXPECT_EQ(host.answer(tag), to_error(Refusal::busy));
  service.end(Refusal::cancelled, parts.now);
}

}  // namespace
}  // namespace linegate::line

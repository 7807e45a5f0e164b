// SPDX-License-Identifier: Apache-2.0
#include "stack/line/pdo_request_service.h"

#include <gtest/gtest.h>

#include "tests/stack/line/service_fixture.h"

namespace linegate::line {
namespace {

struct PdoRequestServiceTest : testing::Test {
  void execute(std::uint8_t of_node, std::uint16_t number, Duration timeout = {}) {
    service.execute({.tag = ++tag,
                     .timeout = timeout,
                     .request = PdoRequest{.node = of_node, .number = number}},
                    parts.now);
  }
  // TPDO 1 of node 5 is received.
  void receive(Instant at) {
    can::Frame frame = can::make_frame(0x185, {1, 2, 3, 4, 5, 6});
    frame.time = at;
    parts.node->receive(std::span(&frame, 1));
  }

  NodeParts parts{config_with_axis()};
  RecordingHost host;
  ManagerParts managed{false};
  NoFlyingMaster flying{host, parts, managed.manager};
  PdoRequestService service{host,       *parts.node,    parts.image,
                            parts.plan, flying.service, milliseconds(500)};
  std::uint64_t tag = 0;
};

TEST_F(PdoRequestServiceTest, IsRefusedWhereItMakesNoSense) {
  execute(0, 99);
  EXPECT_EQ(host.answer(tag), to_error(Refusal::unknown_entry));
  execute(6, 1);
  EXPECT_EQ(host.answer(tag), to_error(Refusal::unknown_entry));
  host.set_usable(false);
  execute(5, 1);
  EXPECT_EQ(host.answer(tag), to_error(Refusal::line_down));
  host.set_usable(true);
  parts.node->command(nmt::Command::enter_pre_operational, parts.now);
  execute(5, 1);
  EXPECT_EQ(host.answer(tag), to_error(Refusal::wrong_state));
  EXPECT_FALSE(service.active());
}

TEST_F(PdoRequestServiceTest, IsAnsweredByAPdoThatIsReceivedAfterIt) {
  receive(parts.now - milliseconds(1));
  execute(5, 1);
  execute(0, 1);
  ASSERT_TRUE(service.active());
  service.advance(parts.now);
  EXPECT_FALSE(host.answer(1)) << "an earlier PDO does not answer it";
  receive(parts.now + milliseconds(3));
  service.advance(parts.now + milliseconds(3));
  EXPECT_EQ(host.answer(1), Error{});
  EXPECT_EQ(host.answer(2), Error{});
  EXPECT_FALSE(service.active());
}

TEST_F(PdoRequestServiceTest, TimesOutAfterTheTimeOfTheCommandOrOfTheLine) {
  execute(5, 1);
  execute(5, 1, milliseconds(20));
  EXPECT_EQ(service.next_wake(), parts.now + milliseconds(20));
  service.advance(parts.now + milliseconds(20));
  EXPECT_EQ(host.answer(2), to_error(Refusal::timed_out));
  EXPECT_EQ(service.next_wake(), parts.now + milliseconds(500));
  service.advance(parts.now + milliseconds(500));
  EXPECT_EQ(host.answer(1), to_error(Refusal::timed_out));
}

TEST_F(PdoRequestServiceTest, TakesSoManyAndEndsThemAll) {
  for (std::size_t i = 0; i < PdoRequestService::kMost; ++i) {
    execute(5, 1);
  }
  EXPECT_FALSE(host.answer(tag));
  execute(5, 1);
  EXPECT_EQ(host.answer(tag), to_error(Refusal::busy));
  service.end(Refusal::cancelled, parts.now);
  for (std::uint64_t i = 1; i < tag; ++i) {
    EXPECT_EQ(host.answer(i), to_error(Refusal::cancelled));
  }
  EXPECT_FALSE(service.active());
}

}  // namespace
}  // namespace linegate::line

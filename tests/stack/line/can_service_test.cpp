// SPDX-License-Identifier: Apache-2.0
#include "stack/line/can_service.h"

#include <gtest/gtest.h>

#include "tests/stack/line/service_fixture.h"

namespace linegate::line {
namespace {

struct CanServiceTest : testing::Test {
  void send(std::uint32_t id) {
    service.execute({.tag = ++tag, .request = CanSend{.frame = can::make_frame(id, {7})}},
                    parts.now);
  }
  std::size_t heard() {
    std::array<Event, 8> out;
    return parts.events.take(out);
  }

  NodeParts parts{config_with_axis()};
  RecordingHost host;
  CanService service{host, *parts.node, parts.plan.tpdos, parts.events};
  std::uint64_t tag = 0;
};

TEST_F(CanServiceTest, AFrameIsSentAndAnsweredWhenItIsAcknowledged) {
  send(0x7F0);
  EXPECT_FALSE(host.answer(tag));
  host.acknowledge();
  EXPECT_EQ(host.answer(tag), Error{});
  can::Frame frame;
  bool sent = false;
  while (parts.node->next_frame(frame, parts.now)) {
    sent = sent || text(frame) == "7F0#07";
  }
  EXPECT_TRUE(sent);
}

TEST_F(CanServiceTest, IsRefusedWhereItMakesNoSense) {
  send(0x605);
  EXPECT_EQ(host.answer(tag), to_error(Refusal::identifier_in_use));
  host.set_usable(false);
  send(0x7F0);
  EXPECT_EQ(host.answer(tag), to_error(Refusal::line_down));
}

TEST_F(CanServiceTest, FramesAreReportedWhileSomebodyListens) {
  can::Frame frame = can::make_frame(0x7F1, {1, 2});
  frame.time = parts.now;
  heard();
  service.hear(frame, false);
  EXPECT_EQ(heard(), 0U);
  service.execute(
      {.tag = ++tag,
       .request =
           CanListen{.identifier = 0x7F1, .extended = false, .duration = std::chrono::seconds(1)}},
      parts.now);
  EXPECT_EQ(host.answer(tag), Error{});
  service.hear(frame, false);
  EXPECT_EQ(heard(), 1U);
  frame.time += seconds(2);
  service.hear(frame, false);
  EXPECT_EQ(heard(), 0U);
  service.hear(frame, true);
  EXPECT_EQ(heard(), 1U) << "reported without a listener";
}

}  // namespace
}  // namespace linegate::line

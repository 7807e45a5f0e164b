// SPDX-License-Identifier: Apache-2.0
// The numbers of frames between the line and the bus.
#include "stack/line/frames_under_way.h"

#include <gtest/gtest.h>

namespace linegate::line {
namespace {

class FramesUnderWayTest : public testing::Test {
 protected:
  FramesUnderWayTest() { frames.expect(); }

  void hand_out(unsigned count) {
    for (unsigned i = 0; i < count; ++i) {
      frames.handed_out(can::make_frame(0x605, {}), now);
    }
  }
  bool any() const { return frames.is_stuck(now + std::chrono::seconds(1)); }

  FramesUnderWay frames;
  Instant now{std::chrono::seconds(1)};
};

TEST_F(FramesUnderWayTest, EndWhenTheyAreAcknowledgedOrLost) {
  hand_out(3);
  EXPECT_TRUE(frames.ended(2, now));
  EXPECT_FALSE(frames.ended(2, now));
  EXPECT_TRUE(any());
  EXPECT_TRUE(frames.requests().any(5));
  frames.lost(3, 3);
  EXPECT_FALSE(any());
  EXPECT_FALSE(frames.requests().any(5));
}

TEST_F(FramesUnderWayTest, LostFramesEndWhenThoseBeforeThemHave) {
  hand_out(6);
  frames.lost(3, 3);
  frames.lost(4, 4);
  frames.lost(6, 6);
  EXPECT_TRUE(frames.ended(1, now));
  EXPECT_TRUE(any());
  EXPECT_TRUE(frames.ended(2, now));
  EXPECT_TRUE(any());
  EXPECT_TRUE(frames.ended(5, now));
  EXPECT_FALSE(any()) << "the last frame was lost";
  EXPECT_FALSE(frames.ended(6, now));
}

TEST_F(FramesUnderWayTest, AdjacentLossesEndTogether) {
  hand_out(4);
  frames.lost(3, 3);
  frames.lost(4, 4);
  EXPECT_TRUE(frames.ended(2, now));
  EXPECT_FALSE(any());
}

TEST_F(FramesUnderWayTest, OnlyWhatIsSentAgainIsAwaitedAfterALoss) {
  FramesUnderWay::Awaited once{.number = 1};
  FramesUnderWay::Awaited of_tpdo{.tpdo = 3, .number = 2};
  FramesUnderWay::Awaited scanned{.scanning_tpdo = 4, .number = 3};
  frames.add({.command = {}, .frames = {once, of_tpdo, scanned}});
  hand_out(3);
  frames.lost(1, 3);
  const auto& awaited = frames.sendings().front().frames;
  EXPECT_EQ(awaited[0].number, FramesUnderWay::kLost);
  EXPECT_EQ(awaited[1].number, 0U);
  EXPECT_EQ(awaited[2].number, 0U);
}

TEST_F(FramesUnderWayTest, AnyFrameSufficesIfEachHasTheValue) {
  FramesUnderWay::Sending sending{.command = {},
                                  .frames = {{.tpdo = 3}, {.scanning_tpdo = 4, .number = 7}},
                                  .data = WrittenByPdo{3, PdoWait::none},
                                  .any_frame = true};
  EXPECT_FALSE(FramesUnderWay::is_sent(sending, 6));
  ASSERT_TRUE(FramesUnderWay::is_sent(sending, 7));
  EXPECT_EQ(FramesUnderWay::take_data(sending, 7), (ReplyData{WrittenByPdo{4, PdoWait::none}}));
  sending.any_frame = false;
  EXPECT_FALSE(FramesUnderWay::is_sent(sending, 7));
}

}  // namespace
}  // namespace linegate::line

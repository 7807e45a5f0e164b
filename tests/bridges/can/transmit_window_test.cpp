// SPDX-License-Identifier: Apache-2.0
#include "bridges/can/transmit_window.h"

#include <gtest/gtest.h>

namespace linegate::can_bridge {
namespace {

using can::make_frame;
using std::chrono::milliseconds;

constexpr Instant instant(std::int64_t ms) {
  return Instant(milliseconds(ms));
}

TEST(TransmitWindow, EchoesMakeRoom) {
  TransmitWindow window(2);
  EXPECT_EQ(window.room(instant(0)), 2U);
  window.sent(make_frame(0x181, {1}), instant(0));
  window.sent(make_frame(0x181, {2}), instant(0));
  EXPECT_EQ(window.room(instant(1)), 0U);
  EXPECT_EQ(window.confirmed(make_frame(0x181, {1}), instant(1)), 1U);
  EXPECT_EQ(window.room(instant(1)), 1U);
  EXPECT_EQ(window.in_flight(), 1U);
}

TEST(TransmitWindow, EchoConfirmsWhatWasSentBefore) {
  TransmitWindow window(4);
  for (std::uint8_t i = 0; i < 4; ++i) {
    window.sent(make_frame(0x181, {i}), instant(0));
  }
  EXPECT_EQ(window.confirmed(make_frame(0x181, {2}), instant(1)), 3U);
  EXPECT_EQ(window.in_flight(), 1U);
  EXPECT_EQ(window.confirmed(make_frame(0x181, {0}), instant(1)), 0U);
  EXPECT_EQ(window.confirmed(make_frame(0x182, {3}), instant(1)), 0U);
  EXPECT_EQ(window.confirmed(make_frame(0x181, {3}), instant(1)), 1U);
}

TEST(TransmitWindow, AConfirmedFrameIsKnownByItsNumber) {
  TransmitWindow window(2);
  EXPECT_EQ(window.confirmed_to(), 0U);
  window.sent(make_frame(0x181, {1}), instant(0), 7);
  window.sent(make_frame(0x181, {2}), instant(0), 9);
  window.confirmed(make_frame(0x181, {3}), instant(1));
  EXPECT_EQ(window.confirmed_to(), 0U);
  EXPECT_EQ(window.skipped_to(), 0U);
  window.confirmed(make_frame(0x181, {2}), instant(1));
  EXPECT_EQ(window.confirmed_to(), 9U);
  EXPECT_EQ(window.skipped_to(), 7U) << "its echo was not received";
  window.sent(make_frame(0x181, {4}), instant(2), 10);
  window.clear();
  window.confirmed(make_frame(0x181, {4}), instant(3));
  EXPECT_EQ(window.confirmed_to(), 9U) << "the window was cleared: the frame is lost";
}

TEST(TransmitWindow, AFrameThatMakesRoomForAnotherTryIsSkipped) {
  TransmitWindow window(1);
  window.sent(make_frame(0x181, {1}), instant(0), 5);
  window.sent(make_frame(0x181, {2}), instant(1000), 6);
  EXPECT_EQ(window.skipped_to(), 5U);
}

TEST(TransmitWindow, StuckBusKeepsWaitingButTriesOnceASecond) {
  TransmitWindow window(2);
  window.sent(make_frame(0x181, {1}), instant(0));
  window.sent(make_frame(0x181, {2}), instant(100));
  EXPECT_EQ(window.next_try(), instant(1000));
  EXPECT_EQ(window.room(instant(999)), 0U);
  EXPECT_EQ(window.room(instant(1000)), 1U);
  window.sent(make_frame(0x181, {3}), instant(1000));
  EXPECT_EQ(window.room(instant(1001)), 0U);
  EXPECT_EQ(window.next_try(), instant(2000));
  EXPECT_EQ(window.confirmed(make_frame(0x181, {3}), instant(1500)), 2U);
  EXPECT_EQ(window.room(instant(1500)), 2U);
  EXPECT_EQ(window.next_try(), kNever);
}

TEST(TransmitWindow, RingTurnsRound) {
  TransmitWindow window(TransmitWindow::kMaxDepth);
  for (std::uint8_t i = 0; i < 200; ++i) {
    const auto frame = make_frame(0x181, {i, 0, 0});
    window.sent(frame, instant(i));
    EXPECT_EQ(window.confirmed(frame, instant(i)), 1U);
  }
  EXPECT_EQ(window.in_flight(), 0U);
}

TEST(TransmitWindow, ClearForgetsWhatTheKernelDropped) {
  TransmitWindow window(1);
  window.sent(make_frame(0x181), instant(0));
  window.clear();
  EXPECT_EQ(window.room(instant(0)), 1U);
}

TEST(TransmitWindow, DepthIsKeptInRange) {
  EXPECT_EQ(TransmitWindow(0).room(instant(0)), 1U);
  EXPECT_EQ(TransmitWindow(99).room(instant(0)), TransmitWindow::kMaxDepth);
}

TEST(TransmitWindow, RemoteFramesMatchWithoutData) {
  TransmitWindow window(1);
  can::Frame remote = make_frame(0x701);
  remote.flags = can::Frame::kRemote;
  remote.length = 1;
  window.sent(remote, instant(0));
  remote.data[0] = std::byte{9};
  EXPECT_EQ(window.confirmed(remote, instant(0)), 1U);
}

}  // namespace
}  // namespace linegate::can_bridge

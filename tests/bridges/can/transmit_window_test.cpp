#include "bridges/can/transmit_window.h"

#include <gtest/gtest.h>

namespace linegate::can_bridge {
namespace {

using can::make_frame;
using std::chrono::milliseconds;

constexpr Instant at(std::int64_t ms) {
  return Instant(milliseconds(ms));
}

TEST(TransmitWindow, EchoesMakeRoom) {
  TransmitWindow window(2);
  EXPECT_EQ(window.room(at(0)), 2U);
  window.sent(make_frame(0x181, {1}), at(0));
  window.sent(make_frame(0x181, {2}), at(0));
  EXPECT_EQ(window.room(at(1)), 0U);
  EXPECT_EQ(window.confirmed(make_frame(0x181, {1}), at(1)), 1U);
  EXPECT_EQ(window.room(at(1)), 1U);
  EXPECT_EQ(window.in_flight(), 1U);
}

TEST(TransmitWindow, EchoConfirmsWhatWasSentBefore) {
  TransmitWindow window(4);
  for (std::uint8_t i = 0; i < 4; ++i) {
    window.sent(make_frame(0x181, {i}), at(0));
  }
  EXPECT_EQ(window.confirmed(make_frame(0x181, {2}), at(1)), 3U);
  EXPECT_EQ(window.in_flight(), 1U);
  EXPECT_EQ(window.confirmed(make_frame(0x181, {0}), at(1)), 0U);
  EXPECT_EQ(window.confirmed(make_frame(0x182, {3}), at(1)), 0U);
  EXPECT_EQ(window.confirmed(make_frame(0x181, {3}), at(1)), 1U);
}

TEST(TransmitWindow, StuckBusKeepsWaitingButTriesOnceASecond) {
  TransmitWindow window(2);
  window.sent(make_frame(0x181, {1}), at(0));
  window.sent(make_frame(0x181, {2}), at(100));
  EXPECT_EQ(window.next_try(), at(1000));
  EXPECT_EQ(window.room(at(999)), 0U);
  EXPECT_EQ(window.room(at(1000)), 1U);
  window.sent(make_frame(0x181, {3}), at(1000));
  EXPECT_EQ(window.room(at(1001)), 0U);
  EXPECT_EQ(window.next_try(), at(2000));
  EXPECT_EQ(window.confirmed(make_frame(0x181, {3}), at(1500)), 2U);
  EXPECT_EQ(window.room(at(1500)), 2U);
  EXPECT_EQ(window.next_try(), kNever);
}

TEST(TransmitWindow, RingTurnsRound) {
  TransmitWindow window(TransmitWindow::kMaxDepth);
  for (std::uint8_t i = 0; i < 200; ++i) {
    const auto frame = make_frame(0x181, {i, 0, 0});
    window.sent(frame, at(i));
    EXPECT_EQ(window.confirmed(frame, at(i)), 1U);
  }
  EXPECT_EQ(window.in_flight(), 0U);
}

TEST(TransmitWindow, ClearForgetsWhatTheKernelDropped) {
  TransmitWindow window(1);
  window.sent(make_frame(0x181), at(0));
  window.clear();
  EXPECT_EQ(window.room(at(0)), 1U);
}

TEST(TransmitWindow, DepthIsKeptInRange) {
  EXPECT_EQ(TransmitWindow(0).room(at(0)), 1U);
  EXPECT_EQ(TransmitWindow(99).room(at(0)), TransmitWindow::kMaxDepth);
}

TEST(TransmitWindow, RemoteFramesMatchWithoutData) {
  TransmitWindow window(1);
  can::Frame remote = make_frame(0x701);
  remote.flags = can::Frame::kRemote;
  remote.length = 1;
  window.sent(remote, at(0));
  remote.data[0] = std::byte{9};
  EXPECT_EQ(window.confirmed(remote, at(0)), 1U);
}

}  // namespace
}  // namespace linegate::can_bridge

// SPDX-License-Identifier: Apache-2.0
// Real SocketCAN: needs vcan0 (classical) and vcan1 (CAN FD), and the right to set interfaces up
// and down. Runs in the guest tier only.
#include <array>
#include <cerrno>
#include <chrono>
#include <vector>

#include <gtest/gtest.h>

#include "bridges/can/socketcan.h"

#include "tests/bridges/can/guest_driven.h"

namespace linegate::can_bridge {
namespace {

using can::BusEvent;
using can::BusState;
using can::Frame;
using can::make_frame;
using Kind = BusEvent::Kind;

TEST(GuestSocketcan, FramesCrossInOrderAndOwnOnesAreOnlyConfirmed) {
  Driven a("vcan0");
  Driven b("vcan0");
  ASSERT_TRUE(a.told(Kind::interface_ready));
  std::vector<Frame> sent;
  for (std::uint32_t i = 0; i < 500; ++i) {
    sent.push_back(make_frame(0x180 + i % 127, {static_cast<std::uint8_t>(i), 7}));
  }
  const Instant before = now();
  a.send_all(sent);
  ASSERT_TRUE(b.until([&] { return b.frames.size() == sent.size(); }));
  for (std::size_t i = 0; i < sent.size(); ++i) {
    EXPECT_TRUE(same_content(sent[i], b.frames[i]));
    EXPECT_GE(b.frames[i].time, before - std::chrono::milliseconds(1));
    EXPECT_LE(b.frames[i].time, now());
  }
  ASSERT_TRUE(a.until([&] { return a.channel().counters().confirmed == sent.size(); }));
  EXPECT_TRUE(a.frames.empty());
  EXPECT_EQ(a.channel().room(now()), 8U);
}

// The frames before and after an own NMT command on the bus are not read together.
TEST(GuestSocketcan, ReadingEndsAtTheAcknowledgementOfAnNmtCommand) {
  Driven a("vcan0");
  Driven b("vcan0");
  b.send_all(std::array{make_frame(0x705, {0x05}), make_frame(0x706, {0x05})});
  a.send_all(std::array{make_frame(0x205, {1}), make_frame(0, {0x82, 5}), make_frame(0x205, {2})});
  b.send_all(std::array{make_frame(0x705, {0x00})});
  std::array<Frame, 64> out;
  BusEvents events;
  EXPECT_EQ(a.channel().read(out, events, now()), 2U);
  EXPECT_EQ(a.channel().counters().acknowledged, 2U);
  EXPECT_TRUE(a.channel().more());
  EXPECT_EQ(a.channel().read(out, events, now()), 1U);
  EXPECT_EQ(out[0].data[0], std::byte{0});
  EXPECT_EQ(a.channel().counters().acknowledged, 3U);
  EXPECT_FALSE(a.channel().more());
}

TEST(GuestSocketcan, NoMoreThanTheDepthIsUnconfirmed) {
  Driven a("vcan0", 4);
  EXPECT_EQ(a.channel().room(now()), 4U);
  const std::vector<Frame> ten(10, make_frame(0x181));
  EXPECT_EQ(a.channel().write(ten, now()), 4U);
  EXPECT_EQ(a.channel().room(now()), 0U);
  EXPECT_EQ(a.channel().counters().stalled, 1U);
  ASSERT_TRUE(a.until([&] { return a.channel().room(now()) == 4U; }));
}

TEST(GuestSocketcan, FdFramesOnlyWhereTheInterfaceAllows) {
  Frame fd = make_frame(0x181);
  fd.flags = Frame::kFd | Frame::kBitRateSwitch;
  fd.length = 64;
  fd.data.fill(std::byte{0x5A});
  Driven a("vcan1");
  Driven b("vcan1");
  a.send_all(std::array{fd});
  ASSERT_TRUE(b.until([&] { return b.frames.size() == 1; }));
  EXPECT_TRUE(same_content(fd, b.frames[0]));
  Driven classical("vcan0");
  classical.send_all(std::array{fd});
  EXPECT_EQ(classical.channel().counters().refused, 1U);
}

TEST(GuestSocketcan, ExtendedAndRemoteFrames) {
  Frame extended = make_frame(0);
  extended.id = 0x1234'5678;
  extended.flags = Frame::kExtended;
  Frame remote = make_frame(0x705);
  remote.flags = Frame::kRemote;
  remote.length = 1;
  Driven a("vcan0");
  Driven b("vcan0");
  a.send_all(std::array{extended, remote});
  ASSERT_TRUE(b.until([&] { return b.frames.size() == 2; }));
  EXPECT_TRUE(same_content(extended, b.frames[0]));
  EXPECT_EQ(b.frames[1].flags, Frame::kRemote);
  ASSERT_TRUE(a.until([&] { return a.channel().counters().confirmed == 2; }));
}

TEST(GuestSocketcan, MissingInterfaceIsNamed) {
  Driven a("can9");
  EXPECT_TRUE(a.told(Kind::interface_failed, ENODEV));
  EXPECT_EQ(describe_failure("can9", ENODEV), "no such interface: can9");
  Driven loopback("lo");
  EXPECT_TRUE(loopback.told(Kind::interface_failed, EMEDIUMTYPE));
}

TEST(GuestSocketcan, DownAndUpAgain) {
  shell("ip link add vcan7 type vcan && ip link set vcan7 up");
  Driven a("vcan7");
  Driven b("vcan7");
  EXPECT_EQ(a.channel().write(std::array{make_frame(0x181)}, now()), 1U);
  shell("ip link set vcan7 down");
  ASSERT_TRUE(a.until([&] { return a.told(Kind::interface_failed, ENETDOWN); }));
  EXPECT_EQ(a.events.back().state, BusState::stopped);
  EXPECT_EQ(a.channel().room(now()), 0U);
  a.events.clear();
  shell("ip link set vcan7 up");
  ASSERT_TRUE(a.until([&] { return a.told(Kind::interface_ready); }));
  EXPECT_EQ(a.channel().room(now()), 8U);
  b.frames.clear();
  ASSERT_TRUE(
      b.until([&] { return b.channel().descriptor() >= 0 && b.channel().room(now()) > 0; }));
  a.send_all(std::array{make_frame(0x182)});
  ASSERT_TRUE(b.until([&] { return !b.frames.empty(); }));
  shell("ip link del vcan7");
}

TEST(GuestSocketcan, RemovedAndAddedAgain) {
  shell("ip link add vcan8 type vcan && ip link set vcan8 up");
  Driven a("vcan8");
  shell("ip link del vcan8");
  ASSERT_TRUE(a.until([&] { return a.told(Kind::interface_failed, ENODEV); }));
  EXPECT_EQ(a.events.back().state, BusState::absent);
  a.events.clear();
  shell("ip link add vcan8 type vcan && ip link set vcan8 up");
  ASSERT_TRUE(a.until([&] { return a.told(Kind::interface_ready); }));
  a.send_all(std::array{make_frame(0x181)});
  ASSERT_TRUE(a.until([&] { return a.channel().counters().confirmed == 1; }));
  shell("ip link del vcan8");
}

// A write while the interface is down: the next read() reports the failure, and no frame counts as
// sent.
TEST(GuestSocketcan, RenamedAndBack) {
  shell("ip link add vcan5 type vcan && ip link set vcan5 up");
  Driven a("vcan5");
  ASSERT_TRUE(a.told(Kind::interface_ready));
  shell("ip link set vcan5 down && ip link set vcan5 name press5 && ip link set press5 up");
  EXPECT_TRUE(a.until([&] { return a.told(Kind::interface_failed, ENETDOWN); }));
  EXPECT_TRUE(a.until([&] { return a.told(Kind::interface_failed, ENODEV); }))
      << "the channel follows the name, not the device";
  a.events.clear();
  shell("ip link set press5 down && ip link set press5 name vcan5 && ip link set vcan5 up");
  EXPECT_TRUE(a.until([&] { return a.told(Kind::interface_ready); }));
  Driven b("vcan5");
  b.send_all(std::array{make_frame(0x185)});
  EXPECT_TRUE(a.until([&] { return a.frames.size() == 1; }));
  shell("ip link del vcan5");
}

TEST(GuestSocketcan, WritingToADownInterfaceIsNotSending) {
  shell("ip link add vcan6 type vcan && ip link set vcan6 up");
  Driven a("vcan6");
  shell("ip link set vcan6 down");
  EXPECT_EQ(a.channel().write(std::array{make_frame(0x181)}, now()), 0U);
  ASSERT_TRUE(a.until([&] { return a.told(Kind::interface_failed, ENETDOWN); }));
  EXPECT_EQ(a.channel().counters().sent, 0U);
  shell("ip link del vcan6");
}

TEST(GuestSocketcan, WallClockStepDoesNotShow) {
  Driven a("vcan0");
  Driven b("vcan0");
  a.send_all(std::array{make_frame(0x181)});
  ASSERT_TRUE(b.until([&] { return b.frames.size() == 1; }));
  const Instant before = now();
  a.send_all(std::array{make_frame(0x182)});
  shell("date -s '+1 hour' >/dev/null");
  a.send_all(std::array{make_frame(0x183)});
  ASSERT_TRUE(b.until([&] { return b.frames.size() == 3; }));
  shell("date -s '-1 hour' >/dev/null");
  a.send_all(std::array{make_frame(0x184)});
  ASSERT_TRUE(b.until([&] { return b.frames.size() == 4; }));
  for (std::size_t i = 1; i < 4; ++i) {
    EXPECT_GE(b.frames[i].time, before - std::chrono::milliseconds(5));
    EXPECT_LE(b.frames[i].time, now());
  }
}

TEST(GuestSocketcan, OverflowOfTheReceiveQueueIsCounted) {
  SocketOptions options;
  options.receive_buffer = 4096;
  const auto slow = open_socketcan("vcan0", options);
  std::array<Frame, 64> out;
  BusEvents events;
  slow->read(out, events, now());
  Driven a("vcan0");
  const std::vector<Frame> many(200, make_frame(0x181));
  a.send_all(many);
  std::uint64_t got = 0;
  events.clear();
  got += slow->read(out, events, now());
  a.send_all(std::array{make_frame(0x182)});
  got += slow->read(out, events, now());
  EXPECT_GT(slow->counters().lost, 0U);
  EXPECT_EQ(got + slow->counters().lost, 201U);
  ASSERT_FALSE(events.empty());
  EXPECT_EQ(events.view().back().kind, Kind::frames_lost);
}

}  // namespace
}  // namespace linegate::can_bridge

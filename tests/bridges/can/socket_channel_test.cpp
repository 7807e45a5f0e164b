// SPDX-License-Identifier: Apache-2.0
#include "bridges/can/socket_channel.h"

#include <array>
#include <cerrno>
#include <chrono>
#include <span>
#include <vector>

#include <fcntl.h>
#include <gtest/gtest.h>
#include <linux/can/error.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include "bridges/can/frame_codec.h"
#include "bridges/can/frame_socket.h"

namespace linegate::can_bridge {
namespace {

using can::BusEvent;
using can::BusState;
using can::Frame;
using can::make_frame;
using Kind = BusEvent::Kind;

Instant now() {
  return Instant(std::chrono::steady_clock::now().time_since_epoch());
}

class SocketChannelTest : public testing::Test {
 protected:
  virtual std::array<int, 2> open_pair() {
    std::array<int, 2> ends{-1, -1};
    EXPECT_EQ(::socketpair(AF_UNIX, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0, ends.data()), 0);
    return ends;
  }

  void SetUp() override {
    const auto ends = open_pair();
    const int on = 1;
    ASSERT_EQ(::setsockopt(ends[0], SOL_SOCKET, SO_TIMESTAMPNS, &on, sizeof on), 0);
    channel = open_on_descriptor(ends[0]);
    peer = ends[1];
    std::array<Frame, 1> none;
    EXPECT_EQ(channel->read(none, events, now()), 0U);
  }
  void TearDown() override {
    if (peer >= 0) {
      ::close(peer);
    }
  }

  void inject(const Frame& frame) {
    canfd_frame raw{};
    const std::size_t bytes = encode(frame, raw);
    ASSERT_EQ(::send(peer, &raw, bytes, 0), static_cast<ssize_t>(bytes));
  }
  void inject_error(std::uint32_t classes, std::uint8_t controller) {
    canfd_frame raw{};
    raw.can_id = CAN_ERR_FLAG | classes;
    raw.len = CAN_ERR_DLC;
    raw.data[1] = controller;
    ASSERT_EQ(::send(peer, &raw, CAN_MTU, 0), static_cast<ssize_t>(CAN_MTU));
  }
  std::vector<Frame> read(std::size_t room = 256) {
    events.clear();
    std::vector<Frame> out(room);
    out.resize(channel->read(out, events, now()));
    return out;
  }

  std::unique_ptr<Channel> channel;
  int peer = -1;
  BusEvents events;
};

// A UDP socket on loopback queues more datagrams than a socketpair, which holds ten.
class ManyFramesTest : public SocketChannelTest {
 protected:
  static int bound_socket(sockaddr_in& address) {
    const int descriptor = ::socket(AF_INET, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
    address = {};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t length = sizeof address;
    auto* generic = reinterpret_cast<sockaddr*>(&address);
    EXPECT_EQ(::bind(descriptor, generic, length), 0);
    EXPECT_EQ(::getsockname(descriptor, generic, &length), 0);
    return descriptor;
  }

  std::array<int, 2> open_pair() override {
    std::array<sockaddr_in, 2> addresses;
    const std::array<int, 2> ends{bound_socket(addresses[0]), bound_socket(addresses[1])};
    for (std::size_t i = 0; i < 2; ++i) {
      EXPECT_EQ(::connect(ends[i], reinterpret_cast<const sockaddr*>(&addresses[1 - i]),
                          sizeof(sockaddr_in)),
                0);
    }
    return ends;
  }
};

TEST_F(SocketChannelTest, FirstReadTellsThatItIsReady) {
  ASSERT_EQ(events.view().size(), 2U);
  EXPECT_EQ(events.view()[0].kind, Kind::interface_ready);
  EXPECT_EQ(events.view()[1].state, BusState::error_active);
  EXPECT_EQ(channel->next_wake(), kNever);
}

TEST_F(ManyFramesTest, ReadsInOrderAcrossBatches) {
  const Instant before = now();
  constexpr std::size_t kFrames = 150;
  std::vector<Frame> got;
  for (std::size_t i = 0; i < kFrames; ++i) {
    inject(make_frame(0x181, {static_cast<std::uint8_t>(i)}));
    if (i % 100 == 99) {
      const auto some = read();
      got.insert(got.end(), some.begin(), some.end());
    }
  }
  const auto rest = read();
  got.insert(got.end(), rest.begin(), rest.end());
  ASSERT_EQ(got.size(), kFrames);
  Instant last = before - std::chrono::milliseconds(5);
  for (std::size_t i = 0; i < kFrames; ++i) {
    EXPECT_EQ(got[i].data[0], static_cast<std::byte>(i));
    EXPECT_GE(got[i].time, last);
    last = got[i].time;
  }
  EXPECT_LE(last, now());
  EXPECT_EQ(channel->counters().received, kFrames);
}

// The thread is delayed between reading the clock and reading frames: the frame keeps its later
// time.
TEST_F(SocketChannelTest, AFrameThatCameAfterTheCallersNowKeepsItsTime) {
  const Instant sent = now();
  inject(make_frame(0x181));
  std::array<Frame, 1> out;
  ASSERT_EQ(channel->read(out, events, sent - std::chrono::seconds(1)), 1U);
  EXPECT_GT(out[0].time, sent - std::chrono::milliseconds(5));
  EXPECT_LE(out[0].time, now());
}

// The headers that the kernel filled in for the previous batch must have no effect.
TEST(FrameSocketTest, EachFrameOfABatchHasItsStamp) {
  std::array<int, 2> ends{-1, -1};
  ASSERT_EQ(::socketpair(AF_UNIX, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0, ends.data()), 0);
  const int on = 1;
  ASSERT_EQ(::setsockopt(ends[0], SOL_SOCKET, SO_TIMESTAMPNS, &on, sizeof on), 0);
  FrameSocket receiver;
  receiver.reset(ends[0]);
  FrameSocket sender;
  sender.reset(ends[1]);
  const std::array<Frame, 5> frames{make_frame(0x181, {1}), make_frame(0x182, {2}),
                                    make_frame(0x183, {3}), make_frame(0x184, {4}),
                                    make_frame(0x185, {5})};
  for (const int count : {3, 1, 0, 5, 2, 5}) {
    for (int i = 0; i < count; ++i) {
      ASSERT_EQ(sender.send(std::span(frames).subspan(static_cast<std::size_t>(i), 1)), 1);
    }
    ASSERT_EQ(receiver.receive(FrameSocket::kBatch), count == 0 ? -EAGAIN : count);
    for (int i = 0; i < count; ++i) {
      const FrameSocket::Received got = receiver.received(static_cast<std::size_t>(i));
      EXPECT_NE(got.stamp_ns, 0) << i << " of " << count;
      EXPECT_EQ(got.raw->can_id, frames[static_cast<std::size_t>(i)].id);
      EXPECT_EQ(got.bytes, std::size_t{CAN_MTU});
    }
  }
}

TEST_F(SocketChannelTest, NeverGivesMoreThanThereIsRoomFor) {
  for (std::uint8_t i = 0; i < 10; ++i) {
    inject(make_frame(0x181, {i}));
  }
  for (std::uint8_t i = 0; i < 5; ++i) {
    const auto two = read(2);
    ASSERT_EQ(two.size(), 2U);
    EXPECT_EQ(two[0].data[0], static_cast<std::byte>(2 * i));
  }
  EXPECT_TRUE(read(2).empty());
}

TEST_F(SocketChannelTest, ErrorFramesAreEventsAndNotFrames) {
  inject_error(CAN_ERR_CRTL, CAN_ERR_CRTL_TX_PASSIVE);
  inject(make_frame(0x181));
  inject_error(CAN_ERR_BUSOFF, 0);
  EXPECT_EQ(read().size(), 1U);
  ASSERT_EQ(events.view().size(), 2U);
  EXPECT_EQ(events.view()[0].state, BusState::error_passive);
  EXPECT_EQ(events.frames_before(0), 0U);
  EXPECT_EQ(events.view()[1].state, BusState::bus_off);
  EXPECT_EQ(events.frames_before(1), 1U);
  EXPECT_EQ(channel->room(now()), 0U);
  EXPECT_EQ(channel->write(std::array{make_frame(0x181)}, now()), 0U);
  inject_error(CAN_ERR_RESTARTED, 0);
  EXPECT_TRUE(read().empty());
  EXPECT_EQ(events.view().back().state, BusState::error_active);
  EXPECT_GT(channel->room(now()), 0U);
}

TEST_F(SocketChannelTest, ReceivingEndsBusOff) {
  inject(make_frame(0x181));
  inject_error(CAN_ERR_BUSOFF, 0);
  inject(make_frame(0x181));
  EXPECT_EQ(read().size(), 2U);
  ASSERT_EQ(events.view().size(), 2U);
  EXPECT_EQ(events.frames_before(0), 1U);
  EXPECT_EQ(events.view()[1].state, BusState::error_active);
  EXPECT_EQ(events.frames_before(1), 1U) << "the state is known from the frame and precedes it";
}

TEST_F(ManyFramesTest, StormOfStateChangesLosesNeitherEventsNorFrames) {
  std::size_t told = 0;
  std::size_t frames = 0;
  for (int round = 0; round < 3; ++round) {
    for (int i = 0; i < 30; ++i) {
      inject_error(CAN_ERR_CRTL, i % 2 == 0 ? CAN_ERR_CRTL_TX_WARNING : CAN_ERR_CRTL_ACTIVE);
      inject(make_frame(0x181));
    }
    do {
      frames += read().size();
      told += events.view().size();
    } while (channel->next_wake() != kNever);
  }
  EXPECT_EQ(told, 90U);
  EXPECT_EQ(frames, 90U);
}

TEST_F(SocketChannelTest, MalformedDatagramsAreCountedAndHarmless) {
  const std::array<std::byte, 40> junk{};
  ASSERT_EQ(::send(peer, junk.data(), 3, 0), 3);
  ASSERT_EQ(::send(peer, junk.data(), 40, 0), 40);
  inject(make_frame(0x181));
  EXPECT_EQ(read().size(), 1U);
  EXPECT_EQ(channel->counters().malformed, 2U);
}

TEST_F(SocketChannelTest, WritesWhatWasGiven) {
  Frame fd = make_frame(0x182);
  fd.flags = Frame::kFd;
  fd.length = 20;
  const std::array frames{make_frame(0x181, {1, 2}), fd};
  ASSERT_EQ(channel->write(frames, now()), 2U);
  for (const Frame& frame : frames) {
    canfd_frame raw{};
    const ssize_t bytes = ::recv(peer, &raw, sizeof raw, 0);
    ASSERT_GT(bytes, 0);
    Frame got;
    ASSERT_TRUE(decode(raw, static_cast<std::size_t>(bytes), got));
    EXPECT_TRUE(same_content(frame, got));
  }
  EXPECT_EQ(channel->counters().sent, 2U);
}

TEST_F(SocketChannelTest, FullSocketIsBackPressureUntilWritable) {
  std::uint32_t taken = 0;
  while (channel->write(std::array{make_frame(0x100, {static_cast<std::uint8_t>(taken)})}, now()) ==
         1) {
    ++taken;
  }
  EXPECT_TRUE(channel->wants_writable());
  EXPECT_EQ(channel->room(now()), 0U);
  EXPECT_EQ(channel->counters().stalled, 1U);
  for (std::uint32_t i = 0; i < taken; ++i) {
    canfd_frame raw{};
    ASSERT_EQ(::recv(peer, &raw, sizeof raw, 0), static_cast<ssize_t>(CAN_MTU));
    EXPECT_EQ(raw.data[0], static_cast<std::uint8_t>(i));
  }
  pollfd entry{channel->descriptor(), POLLOUT, 0};
  ASSERT_EQ(::poll(&entry, 1, 1000), 1);
  read();
  EXPECT_FALSE(channel->wants_writable());
  EXPECT_EQ(channel->write(std::array{make_frame(0x100)}, now()), 1U);
  EXPECT_EQ(channel->counters().sent, taken + 1U);
}

TEST_F(SocketChannelTest, ImpossibleFramesAreTakenAndRefused) {
  std::array frames{make_frame(0x181), make_frame(0x182), make_frame(0x183), make_frame(0x184)};
  frames[0].length = 9;
  frames[2].id = 0x800;
  frames[3].flags = Frame::kFd;
  frames[3].length = 9;
  EXPECT_EQ(channel->write(frames, now()), 4U);
  EXPECT_EQ(channel->counters().refused, 3U);
  EXPECT_EQ(channel->counters().sent, 1U);
}

TEST_F(SocketChannelTest, GoneForGoodWhenTheOtherEndIs) {
  ::close(peer);
  peer = -1;
  channel->write(std::array{make_frame(0x181)}, now());
  EXPECT_EQ(channel->room(now()), 0U);
  EXPECT_LE(channel->next_wake(), now());
  read();
  ASSERT_EQ(events.view().size(), 2U);
  EXPECT_EQ(events.view()[0].kind, Kind::interface_failed);
  EXPECT_EQ(events.view()[0].code, static_cast<std::uint32_t>(ECONNREFUSED));
  EXPECT_EQ(events.view()[1].state, BusState::absent);
  EXPECT_EQ(channel->descriptor(), -1);
  EXPECT_EQ(channel->next_wake(), kNever);
  EXPECT_TRUE(read().empty());
  EXPECT_TRUE(events.empty());
}

TEST_F(SocketChannelTest, AFailureComesAfterTheFramesThatWereReceivedUntilThen) {
  for (std::uint8_t i = 0; i < 3; ++i) {
    inject(make_frame(0x181, {i}));
  }
  ASSERT_EQ(::send(peer, nullptr, 0, 0), 0) << "an empty datagram, like the end of a connection";
  EXPECT_EQ(read().size(), 3U);
  ASSERT_EQ(events.view().size(), 2U);
  EXPECT_EQ(events.view()[0].kind, Kind::interface_failed);
  EXPECT_EQ(events.frames_before(0), 3U);
  EXPECT_EQ(events.frames_before(1), 3U);
}

TEST_F(ManyFramesTest, AFailureWaitsForAllFramesHoweverManyThereAre) {
  for (std::uint8_t i = 0; i < 3; ++i) {
    inject(make_frame(0x181, {i}));
  }
  ::close(peer);
  peer = -1;
  channel->write(std::array{make_frame(0x201)}, now());
  channel->write(std::array{make_frame(0x202)}, now());  // detects that the first write failed
  ASSERT_EQ(channel->room(now()), 0U);
  EXPECT_EQ(read(2).size(), 2U);
  EXPECT_TRUE(events.empty()) << "more frames may be pending";
  EXPECT_LE(channel->next_wake(), now());
  const auto last = read(2);
  ASSERT_EQ(last.size(), 1U);
  EXPECT_EQ(last[0].data[0], std::byte{2});
  ASSERT_EQ(events.view().size(), 2U);
  EXPECT_EQ(events.view()[0].kind, Kind::interface_failed);
  EXPECT_EQ(events.frames_before(0), 1U);
}

// The code is ENODEV on a kernel with CAN, and EAFNOSUPPORT on one without; all else is the same.
TEST(SocketcanInterface, MissingInterfaceIsToldOnceAndTriedAgain) {
  SocketOptions options;
  options.retry_period = std::chrono::seconds(2);
  const auto channel = open_socketcan("nosuchcan9", options);
  std::array<Frame, 1> out;
  BusEvents events;
  const Instant start = now();
  EXPECT_LE(channel->next_wake(), start);
  EXPECT_EQ(channel->read(out, events, start), 0U);
  ASSERT_EQ(events.view().size(), 2U);
  EXPECT_EQ(events.view()[0].kind, Kind::interface_failed);
  EXPECT_FALSE(describe_failure("nosuchcan9", events.view()[0].code).empty());
  EXPECT_EQ(events.view()[1].state, BusState::absent);
  EXPECT_EQ(channel->descriptor(), -1);
  EXPECT_EQ(channel->room(start), 0U);
  EXPECT_EQ(channel->write(std::array{make_frame(0x181)}, start), 0U);
  EXPECT_EQ(channel->next_wake(), start + std::chrono::seconds(2));
  events.clear();
  channel->read(out, events, start + std::chrono::seconds(2));
  EXPECT_TRUE(events.empty());
  EXPECT_EQ(channel->next_wake(), start + std::chrono::seconds(4));
}

}  // namespace
}  // namespace linegate::can_bridge

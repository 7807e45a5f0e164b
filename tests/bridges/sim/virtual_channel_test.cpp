// SPDX-License-Identifier: Apache-2.0
#include "bridges/sim/virtual_channel.h"

#include <array>
#include <cerrno>
#include <chrono>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <poll.h>

namespace linegate::sim {
namespace {

using can::BusEvent;
using can::BusState;
using can::Frame;
using can::make_frame;
using can_bridge::BusEvents;
using can_bridge::Channel;

Instant now() {
  return Instant(std::chrono::steady_clock::now().time_since_epoch());
}

bool readable(const Channel& channel, int timeout_ms) {
  pollfd entry{channel.descriptor(), POLLIN, 0};
  return ::poll(&entry, 1, timeout_ms) == 1;
}

std::vector<Frame> read_some(Channel& channel, Instant at) {
  std::vector<Frame> out(64);
  BusEvents events;
  out.resize(channel.read(out, events, at));
  return out;
}

TEST(VirtualChannel, FirstReadReportsTheInterfaceReady) {
  VirtualNetwork network;
  auto channel = network.open("line1");
  EXPECT_EQ(channel->descriptor(), -1);
  EXPECT_LE(channel->next_wake(), now());
  EXPECT_EQ(channel->room(now()), 0U);
  std::array<Frame, 1> out;
  BusEvents events;
  EXPECT_EQ(channel->read(out, events, now()), 0U);
  ASSERT_EQ(events.view().size(), 2U);
  EXPECT_EQ(events.view()[0].kind, BusEvent::Kind::interface_ready);
  EXPECT_EQ(events.view()[1].kind, BusEvent::Kind::state);
  EXPECT_EQ(events.view()[1].state, BusState::error_active);
  EXPECT_GE(channel->descriptor(), 0);
  EXPECT_EQ(channel->next_wake(), kNever);
  EXPECT_GT(channel->room(now()), 0U);
}

// A channel that becomes ready must not receive frames from before.
TEST(VirtualChannel, WhatWasSentBeforeItWasReadyIsNotHeard) {
  VirtualNetwork network;
  auto early = network.open("line1");
  auto late = network.open("line1");
  const Instant start = now();
  EXPECT_TRUE(read_some(*early, start).empty());
  const std::array before{make_frame(0x705, {0})};
  ASSERT_EQ(early->write(before, start), 1U);
  const Instant ready = start + std::chrono::milliseconds(10);
  EXPECT_TRUE(read_some(*late, ready).empty());
  const std::array after{make_frame(0x705, {5})};
  ASSERT_EQ(early->write(after, ready), 1U);
  const std::vector<Frame> got = read_some(*late, ready + std::chrono::milliseconds(10));
  ASSERT_EQ(got.size(), 1U);
  EXPECT_TRUE(same_content(got[0], after[0]));
  EXPECT_GT(got[0].time, ready);
}

TEST(VirtualChannel, DescriptorWakesTheReceiverAndFrameHasItsEndTime) {
  VirtualNetwork network;
  auto a = network.open("line1");
  auto b = network.open("line1");
  auto other = network.open("line2");
  const Instant start = now();
  for (Channel* channel : {a.get(), b.get(), other.get()}) {
    EXPECT_TRUE(read_some(*channel, start).empty());
    EXPECT_FALSE(readable(*channel, 0));
  }
  const std::array frames{make_frame(0x181, {1}), make_frame(0x182, {2})};
  const Instant sent = now();
  ASSERT_EQ(a->write(frames, sent), 2U);
  std::vector<Frame> got;
  while (got.size() < 2) {
    ASSERT_TRUE(readable(*b, 5000));
    const Instant at = now();
    for (const Frame& frame : read_some(*b, at)) {
      EXPECT_LE(frame.time, at);
      EXPECT_GT(frame.time, sent);
      got.push_back(frame);
    }
  }
  EXPECT_TRUE(same_content(got[0], frames[0]));
  EXPECT_TRUE(same_content(got[1], frames[1]));
  EXPECT_LT(got[0].time, got[1].time);
  EXPECT_FALSE(readable(*b, 0));
  EXPECT_FALSE(readable(*other, 0));
  EXPECT_TRUE(read_some(*a, now()).empty());
  EXPECT_EQ(a->counters().confirmed, 2U);
}

TEST(VirtualChannel, FullQueueIsBackPressure) {
  VirtualNetwork network;
  BusOptions slow;
  slow.bit_rate = 10;
  auto channel = network.open("slow", slow);
  const Instant start = now();
  read_some(*channel, start);
  const std::size_t room = channel->room(start);
  const std::vector<Frame> frames(room + 3, make_frame(0x181));
  EXPECT_EQ(channel->write(frames, start), room);
  EXPECT_EQ(channel->room(start), 0U);
  EXPECT_EQ(channel->write(frames, start), 0U);
  EXPECT_EQ(channel->counters().stalled, 2U);
  read_some(*channel, start + std::chrono::hours(1));
  EXPECT_EQ(channel->room(start), room);
}

TEST(VirtualChannel, ImpossibleFrameIsTakenAndRefused) {
  VirtualNetwork network;
  auto channel = network.open("line1");
  read_some(*channel, now());
  std::array frames{make_frame(0x181), make_frame(0x181)};
  frames[0].length = 9;
  EXPECT_EQ(channel->write(frames, now()), 2U);
  EXPECT_EQ(channel->counters().refused, 1U);
  EXPECT_EQ(channel->counters().sent, 1U);
}

TEST(VirtualChannel, ReaderWithoutRoomStaysReadable) {
  VirtualNetwork network;
  auto a = network.open("line1");
  auto b = network.open("line1");
  read_some(*a, now());
  read_some(*b, now());
  const std::array frames{make_frame(0x181), make_frame(0x182), make_frame(0x183)};
  a->write(frames, now());
  const Instant later = now() + std::chrono::seconds(1);
  std::array<Frame, 1> one;
  BusEvents events;
  for (int i = 0; i < 3; ++i) {
    EXPECT_EQ(b->read(one, events, later), 1U);
  }
  EXPECT_EQ(b->read(one, events, later), 0U);
}

TEST(VirtualChannel, LostFramesWereBeforeThoseThatAreLeft) {
  VirtualNetwork network;
  BusOptions short_memory;
  short_memory.history = 2;
  auto a = network.open("line1", short_memory);
  auto b = network.open("line1");
  const Instant start = now();
  read_some(*a, start);
  read_some(*b, start);
  const std::array frames{make_frame(0x181), make_frame(0x182), make_frame(0x183)};
  ASSERT_EQ(a->write(frames, start), 3U);
  std::array<Frame, 8> out;
  BusEvents events;
  ASSERT_EQ(b->read(out, events, start + std::chrono::seconds(1)), 2U);
  ASSERT_EQ(events.view().size(), 1U);
  EXPECT_EQ(events.view()[0].kind, BusEvent::Kind::frames_lost);
  EXPECT_EQ(events.view()[0].count, 1U);
  EXPECT_EQ(events.frames_before(0), 0U);
  EXPECT_LE(events.view()[0].time, out[0].time);
}

// Each thread answers a frame of the other thread with the next number.
TEST(VirtualChannel, TwoThreadsShareABus) {
  VirtualNetwork network;
  constexpr std::uint8_t kRounds = 200;
  const auto play = [&](Channel* channel, std::uint32_t own_id, bool first) {
    std::uint8_t expected = first ? 1 : 0;
    if (first) {
      channel->write(std::array{make_frame(own_id, {0})}, now());
    }
    while (expected < kRounds) {
      if (!readable(*channel, 5000)) {
        return expected;
      }
      for (const Frame& frame : read_some(*channel, now())) {
        if (frame.data[0] != std::byte{expected}) {
          return expected;
        }
        const auto answer = static_cast<std::uint8_t>(expected + 1);
        channel->write(std::array{make_frame(own_id, {answer})}, now());
        expected = static_cast<std::uint8_t>(expected + 2);
      }
    }
    return expected;
  };
  auto left = network.open("shared");
  auto right = network.open("shared");
  read_some(*left, now());
  read_some(*right, now());
  std::uint8_t right_end = 0;
  std::thread other([&] { right_end = play(right.get(), 0x182, false); });
  const std::uint8_t left_end = play(left.get(), 0x181, true);
  other.join();
  EXPECT_GE(left_end, kRounds);
  EXPECT_GE(right_end, kRounds);
}

// --- faults on request ---------------------------------------------------------------------------

// Two channels of a bus, in virtual time.
class VirtualFaultsTest : public testing::Test {
 protected:
  // Sends `count` frames, one every millisecond, and returns those that the other channel received.
  std::vector<Frame> sent_through(const can_bridge::VirtualFaults& faults, std::size_t count) {
    VirtualNetwork network;
    const auto sender = network.open("a", {}, faults);
    const auto receiver = network.open("a");
    std::vector<Frame> out;
    Instant at{std::chrono::seconds(1)};
    read(*sender, at);
    read(*receiver, at);
    errors = 0;
    for (std::size_t i = 0; i < count; ++i) {
      const std::array frame{make_frame(0x181, {static_cast<std::uint8_t>(i)})};
      EXPECT_EQ(sender->write(frame, at), 1U);
      at += std::chrono::milliseconds(1);
      read(*sender, at);
      for (const Frame& got : read(*receiver, at)) {
        out.push_back(got);
      }
    }
    return out;
  }
  std::vector<Frame> read(Channel& channel, Instant at) {
    std::vector<Frame> out(64);
    told.clear();
    out.resize(channel.read(out, told, at));
    for (const BusEvent& event : told.view()) {
      errors += event.kind == BusEvent::Kind::error ? event.count : 0;
    }
    return out;
  }

  BusEvents told;
  std::uint64_t errors = 0;
};

TEST_F(VirtualFaultsTest, LostFramesReachNobody) {
  can_bridge::VirtualFaults faults;
  faults.lost = 0.5;
  const std::vector<Frame> first = sent_through(faults, 400);
  EXPECT_GT(first.size(), 100U);
  EXPECT_LT(first.size(), 300U);
  const std::vector<Frame> again = sent_through(faults, 400);
  ASSERT_EQ(first.size(), again.size()) << "the same seed gives the same faults";
  for (std::size_t i = 0; i < first.size(); ++i) {
    EXPECT_TRUE(same_content(first[i], again[i]));
  }
  faults.seed = 2;
  EXPECT_NE(sent_through(faults, 400).size(), first.size());
}

TEST_F(VirtualFaultsTest, DisturbedFramesAreSentAgainAndTold) {
  can_bridge::VirtualFaults faults;
  faults.disturbed = 0.3;
  EXPECT_EQ(sent_through(faults, 400).size(), 400U);
  EXPECT_GT(errors, 2 * 60U) << "both ends receive each error frame";
}

TEST_F(VirtualFaultsTest, DoubledFramesComeTwice) {
  can_bridge::VirtualFaults faults;
  faults.doubled = 0.3;
  const std::size_t count = sent_through(faults, 400).size();
  EXPECT_GT(count, 460U);
  EXPECT_LT(count, 600U);
}

TEST_F(VirtualFaultsTest, OfAStuckNodeNothingIsHeardForAWhile) {
  VirtualNetwork network;
  can_bridge::VirtualFaults faults;
  faults.stuck = 5;
  faults.stuck_time = std::chrono::seconds(10);
  const auto gateway = network.open("a", {}, faults);
  const auto devices = network.open("a");
  const Instant start{std::chrono::seconds(100)};
  read(*gateway, start);
  read(*devices, start);
  const auto heard_at = [&](Duration after, std::uint32_t id) {
    EXPECT_EQ(devices->write(std::array{make_frame(id)}, start + after), 1U);
    const Instant later = start + after + std::chrono::milliseconds(5);
    read(*devices, later);
    return read(*gateway, later).size();
  };
  const auto ms = [](int n) { return std::chrono::milliseconds(n); };
  EXPECT_EQ(heard_at(ms(9'000), 0x705), 1U);
  int at = 15'000;
  for (const std::uint32_t id : {0x705U, 0x085U, 0x185U, 0x485U, 0x585U}) {
    EXPECT_EQ(heard_at(ms(at += 10), id), 0U) << id;
  }
  for (const std::uint32_t id : {0x706U, 0x605U, 0x205U, 0x080U}) {
    EXPECT_EQ(heard_at(ms(at += 10), id), 1U) << id;
  }
  EXPECT_EQ(heard_at(ms(21'000), 0x705), 1U) << "the node works again";
}

TEST_F(VirtualFaultsTest, AnEndGoesBusOffAndComesBack) {
  VirtualNetwork network;
  can_bridge::VirtualFaults faults;
  faults.bus_off = std::chrono::seconds(10);
  const auto channel = network.open("a", {}, faults);
  const auto other = network.open("a");
  const Instant start{std::chrono::seconds(100)};
  const std::array frame{make_frame(0x181)};
  read(*channel, start);
  read(*other, start);
  const auto state_at = [&](Duration after) {
    read(*channel, start + after);
    return told.empty() ? BusState::unknown : told.view()[0].state;
  };
  EXPECT_EQ(state_at(std::chrono::seconds(9)), BusState::unknown);
  EXPECT_EQ(state_at(std::chrono::seconds(10)), BusState::bus_off);
  EXPECT_EQ(channel->room(start), 0U);
  EXPECT_EQ(channel->write(frame, start + std::chrono::seconds(10)), 0U);
  EXPECT_EQ(other->write(frame, start + std::chrono::milliseconds(10'500)), 1U);
  EXPECT_EQ(state_at(std::chrono::seconds(11)), BusState::error_active);
  EXPECT_EQ(other->write(frame, start + std::chrono::seconds(11)), 1U);
  EXPECT_EQ(read(*channel, start + std::chrono::seconds(12)).size(), 1U)
      << "frames that were sent meanwhile are not received";
  EXPECT_EQ(channel->write(frame, start + std::chrono::seconds(12)), 1U);
  EXPECT_EQ(state_at(std::chrono::seconds(20)), BusState::bus_off) << "bus-off every ten seconds";
}

TEST_F(VirtualFaultsTest, AnEndStaysBusOffUntilItIsToldToRestart) {
  VirtualNetwork network;
  can_bridge::VirtualFaults faults;
  faults.bus_off = std::chrono::seconds(10);
  faults.restart = Duration{};
  const auto channel = network.open("a", {}, faults);
  const Instant start{std::chrono::seconds(100)};
  const auto states_at = [&](Duration after) {
    read(*channel, start + after);
    return told.view().size();
  };
  EXPECT_EQ(states_at({}), 2U) << "events: ready and error-active";
  EXPECT_EQ(channel->restart(start), EBUSY) << "the controller is not bus-off";
  EXPECT_EQ(states_at(std::chrono::seconds(10)), 1U);
  EXPECT_EQ(told.view()[0].state, BusState::bus_off);
  EXPECT_EQ(states_at(std::chrono::hours(1)), 0U) << "it stays bus-off";
  EXPECT_EQ(channel->restart(start + std::chrono::hours(1)), 0);
  EXPECT_EQ(states_at(std::chrono::hours(1)), 1U);
  EXPECT_EQ(told.view()[0].state, BusState::error_active);
  EXPECT_EQ(states_at(std::chrono::hours(1) + std::chrono::seconds(10)), 1U)
      << "the next bus-off period";
  EXPECT_EQ(told.view()[0].state, BusState::bus_off);
}

TEST_F(VirtualFaultsTest, AreSwitchedOnAndOffWhileTheBusRuns) {
  VirtualNetwork network;
  const auto gateway = network.open("a");
  const auto devices = network.open("a");
  Instant at{std::chrono::seconds(100)};
  read(*gateway, at);
  read(*devices, at);
  const auto heard_after = [&](Channel& channel, const char* change) {
    std::string said;
    EXPECT_EQ(channel.fault(change, said, at), 0) << said;
    EXPECT_EQ(devices->write(std::array{make_frame(0x705)}, at), 1U);
    at += std::chrono::milliseconds(5);
    read(*devices, at);
    return std::pair(read(*gateway, at).size(), said);
  };
  using Heard = std::pair<std::size_t, std::string>;
  EXPECT_EQ(heard_after(*gateway, ""), Heard(1, "off"));
  EXPECT_EQ(heard_after(*gateway, "stuck=5@always"), Heard(0, "stuck=5@always"));
  EXPECT_EQ(heard_after(*devices, ""), Heard(0, "stuck=5@always")) << "it blocks the whole bus";
  EXPECT_EQ(heard_after(*gateway, "stuck=off&lost=100%"), Heard(0, "lost=100%"));
  EXPECT_EQ(heard_after(*devices, "lost=off"), Heard(1, "off"));
  EXPECT_EQ(heard_after(*devices, "lost=100%"), Heard(0, "lost=100%"));
  std::string said;
  EXPECT_EQ(gateway->fault("disturbed=100%", said, at), EINVAL);
  EXPECT_NE(said.find("not \"disturbed=100%\""), std::string::npos) << said;
  EXPECT_EQ(heard_after(*gateway, ""), Heard(0, "lost=100%")) << "nothing changed";
  EXPECT_EQ(heard_after(*gateway, "disturbed=99%&lost=off").second, "disturbed=99%");
  for (int i = 0; i < 10; ++i) {
    heard_after(*gateway, "");
  }
  EXPECT_GT(errors, 0U);
  heard_after(*gateway, "off");
  at += std::chrono::seconds(1);
  read(*gateway, at);
  EXPECT_EQ(heard_after(*gateway, ""), Heard(1, "off"));
}

TEST_F(VirtualFaultsTest, AnEndGoesBusOffOnCommand) {
  VirtualNetwork network;
  const auto channel = network.open("a");
  const Instant start{std::chrono::seconds(100)};
  read(*channel, start);
  const auto state_after = [&](int ms, const char* change = "") {
    const Instant at = start + std::chrono::milliseconds(ms);
    std::string said;
    EXPECT_EQ(channel->fault(change, said, at), 0) << said;
    read(*channel, at);
    return told.empty() ? BusState::unknown : told.view()[0].state;
  };
  EXPECT_EQ(state_after(10, "bus_off=now"), BusState::bus_off);
  EXPECT_TRUE(readable(*channel, 1000)) << "its bus-off ended long ago";
  EXPECT_EQ(state_after(1'009), BusState::unknown);
  EXPECT_EQ(state_after(1'010), BusState::error_active) << "after a second";
  EXPECT_EQ(state_after(100'000), BusState::unknown) << "once";
  EXPECT_EQ(state_after(100'000, "bus_off=now&restart=never"), BusState::bus_off);
  EXPECT_EQ(state_after(200'000), BusState::unknown);
  EXPECT_EQ(state_after(200'000, "lost=1%"), BusState::unknown) << "it stays bus-off";
  EXPECT_EQ(state_after(200'001, "bus_off=off"), BusState::error_active);
  EXPECT_EQ(state_after(200'002, "bus_off=10s&restart=4s"), BusState::unknown);
  EXPECT_EQ(state_after(210'002), BusState::bus_off);
  EXPECT_EQ(state_after(214'002), BusState::error_active);
  EXPECT_EQ(state_after(220'001), BusState::unknown);
  EXPECT_EQ(state_after(220'002), BusState::bus_off);
  EXPECT_EQ(state_after(220'003, "off"), BusState::error_active);
  EXPECT_EQ(state_after(900'000), BusState::unknown);
}

}  // namespace
}  // namespace linegate::sim

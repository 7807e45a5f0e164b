// SPDX-License-Identifier: Apache-2.0
#include "bridges/sim/bus.h"

#include <array>
#include <vector>

#include <gtest/gtest.h>

#include "stack/can/wire.h"

namespace linegate::sim {
namespace {

using can::Frame;
using can::make_frame;
using std::chrono::microseconds;

constexpr Instant at(std::int64_t us) {
  return Instant(microseconds(us));
}

std::vector<Frame> taken(Bus& bus, Bus::Endpoint end) {
  std::vector<Frame> out(64);
  out.resize(bus.take(end, out));
  return out;
}

class BusTest : public testing::Test {
 protected:
  Bus bus{BusOptions{}};
  Bus::Endpoint a = bus.attach();
  Bus::Endpoint b = bus.attach();
  Bus::Endpoint c = bus.attach();
};

TEST_F(BusTest, FrameArrivesAtItsLastBitAndNotAtItsSender) {
  const Frame frame = make_frame(0x181, {1, 2, 3});
  ASSERT_TRUE(bus.submit(a, frame, at(100)));
  const Instant end = at(100) + can::wire_time(frame, 1'000'000, 1'000'000);
  EXPECT_EQ(bus.next_wake(), end);
  bus.advance(end - Duration(1));
  EXPECT_EQ(bus.first_waiting(b), kNever);
  bus.advance(end);
  const auto at_b = taken(bus, b);
  ASSERT_EQ(at_b.size(), 1U);
  EXPECT_TRUE(same_content(at_b[0], frame));
  EXPECT_EQ(at_b[0].time, end);
  EXPECT_EQ(taken(bus, c).size(), 1U);
  EXPECT_TRUE(taken(bus, a).empty());
  EXPECT_EQ(bus.next_wake(), kNever);
}

TEST_F(BusTest, LowestIdentifierWinsWhateverTheOrderOfSubmission) {
  bus.submit(a, make_frame(0x701, {5}), at(0));
  bus.submit(b, make_frame(0x080), at(0));
  bus.advance(at(1000));
  const auto seen = taken(bus, c);
  ASSERT_EQ(seen.size(), 2U);
  EXPECT_EQ(seen[0].id, 0x080U);
  EXPECT_EQ(seen[1].id, 0x701U);
  const Duration first = bus.time_on_wire(seen[0]);
  EXPECT_EQ(seen[1].time, at(0) + first + bus.time_to_last_bit(seen[1]));
}

TEST_F(BusTest, FrameOnTheWireIsNotPreempted) {
  bus.submit(a, make_frame(0x701, {5}), at(0));
  bus.submit(b, make_frame(0x000, {1, 0}), at(1));
  bus.advance(at(1000));
  const auto seen = taken(bus, c);
  ASSERT_EQ(seen.size(), 2U);
  EXPECT_EQ(seen[0].id, 0x701U);
}

TEST_F(BusTest, WhoSubmitsDuringAFrameTakesPartInTheNextArbitration) {
  bus.submit(a, make_frame(0x300, {1}), at(0));
  bus.submit(b, make_frame(0x500, {2}), at(1));
  bus.submit(c, make_frame(0x200, {3}), at(40));
  bus.advance(at(1000));
  const auto seen = taken(bus, a);
  ASSERT_EQ(seen.size(), 2U);
  EXPECT_EQ(seen[0].id, 0x200U);
  EXPECT_EQ(seen[1].id, 0x500U);
}

TEST_F(BusTest, AnEndpointSendsInItsOwnOrder) {
  bus.submit(a, make_frame(0x500), at(0));
  bus.submit(a, make_frame(0x100), at(0));
  bus.submit(b, make_frame(0x300), at(0));
  bus.advance(at(1000));
  const auto seen = taken(bus, c);
  ASSERT_EQ(seen.size(), 3U);
  EXPECT_EQ(seen[0].id, 0x300U);
  EXPECT_EQ(seen[1].id, 0x500U);
  EXPECT_EQ(seen[2].id, 0x100U);
}

TEST(Bus, FramesInSeveralTransmitBuffersOvertakeEachOther) {
  Bus bus{BusOptions{.buffers = 2}};
  const auto sender = bus.attach();
  const auto watcher = bus.attach();
  bus.submit(sender, make_frame(0x500, {1}), at(0));
  bus.submit(sender, make_frame(0x500, {2}), at(0));
  bus.submit(sender, make_frame(0x300), at(0));
  bus.submit(sender, make_frame(0x100), at(0));
  bus.advance(at(1000));
  const auto seen = taken(bus, watcher);
  ASSERT_EQ(seen.size(), 4U);
  EXPECT_EQ(seen[0].data[0], std::byte{1})
      << "the other frames are not in a controller's buffer yet";
  EXPECT_EQ(seen[1].id, 0x300U);
  EXPECT_EQ(seen[2].id, 0x100U);
  EXPECT_EQ(seen[3].data[0], std::byte{2});
}

TEST_F(BusTest, AFrameIsAcknowledgedWhenItAndThoseBeforeItHaveLeft) {
  EXPECT_EQ(bus.acknowledged(a), 0U);
  bus.submit(a, make_frame(0x181), at(0));
  bus.submit(a, make_frame(0x182), at(0));
  bus.advance(bus.next_wake());
  EXPECT_EQ(bus.acknowledged(a), 1U);
  bus.advance(at(1000));
  EXPECT_EQ(bus.acknowledged(a), 2U);
  bus.set_disturbance([](const Frame&, Bus::Endpoint) { return Fate::disturbed; });
  bus.submit(a, make_frame(0x183), at(1000));
  bus.advance(at(9000));
  EXPECT_EQ(bus.acknowledged(a), 2U) << "the frame is repeated";
  bus.flush(a);
  EXPECT_EQ(bus.next_wake(), kNever);
}

TEST(Bus, AFrameThatOvertakesIsAcknowledgedWithTheOneBefore) {
  Bus bus(BusOptions{.buffers = 2});
  const Bus::Endpoint a = bus.attach();
  bus.submit(a, make_frame(0x700), at(0));
  bus.submit(a, make_frame(0x100), at(0));
  bus.advance(bus.next_wake());
  EXPECT_EQ(bus.sent(a), 1U);
  EXPECT_EQ(bus.acknowledged(a), 0U);
  bus.advance(at(1000));
  EXPECT_EQ(bus.acknowledged(a), 2U);
}

TEST_F(BusTest, DataFrameBeatsRemoteFrameAndStandardBeatsExtended) {
  Frame remote = make_frame(0x701);
  remote.flags = Frame::kRemote;
  Frame extended;
  extended.id = 0x701U << 18U;
  extended.flags = Frame::kExtended;
  bus.submit(a, extended, at(0));
  bus.submit(b, remote, at(0));
  bus.submit(c, make_frame(0x701, {0}), at(0));
  const auto watcher = bus.attach();
  bus.advance(at(1000));
  const auto seen = taken(bus, watcher);
  ASSERT_EQ(seen.size(), 3U);
  EXPECT_EQ(seen[0].flags, 0);
  EXPECT_TRUE(seen[1].remote());
  EXPECT_TRUE(seen[2].extended());
}

TEST_F(BusTest, BusyTimeIsTheSumOfFramesAndIntermissions) {
  Duration sum{};
  for (std::uint8_t i = 0; i < 8; ++i) {
    const Frame frame = make_frame(0x181, {i, i, i, i});
    sum += bus.time_on_wire(frame);
    ASSERT_TRUE(bus.submit(a, frame, at(0)));
  }
  bus.advance(at(10'000));
  EXPECT_EQ(bus.busy(), sum);
  EXPECT_EQ(bus.frames(), 8U);
  EXPECT_EQ(bus.sent(a), 8U);
  const auto seen = taken(bus, b);
  EXPECT_EQ(seen.back().time, at(0) + sum - microseconds(can::kIntermissionBits));
}

TEST_F(BusTest, FullEndpointRefusesUntilAFrameHasLeft) {
  while (bus.room(a) > 0) {
    ASSERT_TRUE(bus.submit(a, make_frame(0x181), at(0)));
  }
  EXPECT_FALSE(bus.submit(a, make_frame(0x182), at(0)));
  bus.advance(bus.next_wake());
  EXPECT_EQ(bus.room(a), 1U);
}

TEST_F(BusTest, PulledCableKeepsItsFramesAndHearsNothing) {
  bus.set_connected(a, false, at(0));
  bus.submit(a, make_frame(0x181), at(0));
  bus.submit(b, make_frame(0x182), at(0));
  bus.advance(at(1000));
  EXPECT_TRUE(taken(bus, a).empty());
  EXPECT_TRUE(taken(bus, b).empty());
  EXPECT_EQ(taken(bus, c).size(), 1U);
  bus.set_connected(a, true, at(1500));
  EXPECT_GT(bus.next_wake(), at(1500)) << "a waiting frame is not sent before the connection";
  bus.advance(at(3000));
  EXPECT_TRUE(taken(bus, a).empty());
  EXPECT_EQ(taken(bus, c).size(), 1U);
}

TEST_F(BusTest, DisturbedFrameIsRepeatedAndLostFrameIsNot) {
  int calls = 0;
  bus.set_disturbance([&](const Frame&, Bus::Endpoint sender) {
    EXPECT_EQ(sender, a);
    ++calls;
    return calls == 1 ? Fate::disturbed : calls == 2 ? Fate::delivered : Fate::lost;
  });
  const Frame frame = make_frame(0x181, {1});
  bus.submit(a, frame, at(0));
  bus.advance(at(1000));
  bus.submit(a, frame, at(1000));
  bus.advance(at(2000));
  const auto seen = taken(bus, b);
  ASSERT_EQ(seen.size(), 1U);
  EXPECT_EQ(seen[0].time, at(20) + bus.time_on_wire(frame) + bus.time_to_last_bit(frame));
  EXPECT_EQ(bus.sent(a), 2U);
}

TEST_F(BusTest, ADoubledFrameComesTwiceWithAnErrorFrameBetween) {
  int calls = 0;
  bus.set_disturbance(
      [&](const Frame&, Bus::Endpoint) { return ++calls == 1 ? Fate::doubled : Fate::delivered; });
  const Frame frame = make_frame(0x181, {1});
  bus.submit(a, frame, at(0));
  bus.advance(at(1000));
  const auto seen = taken(bus, b);
  ASSERT_EQ(seen.size(), 2U);
  EXPECT_EQ(seen[0].time, at(0) + bus.time_to_last_bit(frame));
  EXPECT_EQ(seen[1].time, at(20) + bus.time_on_wire(frame) + bus.time_to_last_bit(frame));
  EXPECT_EQ(bus.sent(a), 1U);
  EXPECT_EQ(bus.frames(), 2U);
}

TEST_F(BusTest, LateReaderIsToldWhatPassed) {
  BusOptions small;
  small.history = 4;
  Bus bus4(small);
  const auto x = bus4.attach();
  const auto y = bus4.attach();
  for (std::uint8_t i = 0; i < 7; ++i) {
    bus4.submit(x, make_frame(0x181, {i}), at(i * 1000));
    bus4.advance(at((i + 1) * 1000));
  }
  const auto seen = taken(bus4, y);
  ASSERT_EQ(seen.size(), 4U);
  EXPECT_EQ(seen[0].data[0], std::byte{3});
  EXPECT_EQ(bus4.pop_lost(y), 3U);
  EXPECT_EQ(bus4.pop_lost(y), 0U);
}

TEST_F(BusTest, TakeStopsAtTheGivenTime) {
  bus.submit(a, make_frame(0x181), at(0));
  bus.submit(a, make_frame(0x182), at(0));
  bus.advance(at(1000));
  std::array<Frame, 4> out;
  const Instant first = bus.first_waiting(b);
  EXPECT_EQ(bus.take(b, out, first), 1U);
  EXPECT_GT(bus.first_waiting(b), first);
}

TEST_F(BusTest, AttachedLaterHearsOnlyWhatFollows) {
  bus.submit(a, make_frame(0x181), at(0));
  bus.advance(at(1000));
  const auto late = bus.attach();
  EXPECT_TRUE(taken(bus, late).empty());
  bus.detach(late);
  EXPECT_EQ(bus.attach(), late);
}

}  // namespace
}  // namespace linegate::sim

// SPDX-License-Identifier: Apache-2.0
// Malformed frames of a service: they are counted, reported, and have no other effect.
#include <array>
#include <random>

#include "tests/stack/node/node_fixture.h"

namespace linegate::node {
namespace {

class MalformedFrameTest : public NodeTest {
 protected:
  void expect_told(std::uint32_t id, std::initializer_list<std::uint8_t> data) {
    const auto before = node->counters().malformed;
    const auto state = node->state();
    testing::pop_events(events);
    hear(1ms, id, data);
    EXPECT_EQ(node->counters().malformed, before + 1) << id;
    const auto told = testing::pop_events(events);
    const auto is_malformed = [](const Event& e) { return e.kind() == EventKind::malformed_frame; };
    ASSERT_EQ(std::ranges::count_if(told, is_malformed), 1) << id;
    const Event& event = *std::ranges::find_if(told, is_malformed);
    const auto& frame = std::get<event::MalformedFrame>(event.data);
    EXPECT_EQ(frame.identifier, id);
    EXPECT_EQ(frame.length, data.size());
    EXPECT_EQ(event.time, at(1ms));
    EXPECT_EQ(node->state(), state);
  }
};

TEST_F(MalformedFrameTest, NodeControl) {
  boot();
  expect_told(0x000, {});
  expect_told(0x000, {0x01});
  expect_told(0x000, {0x01, 0x05, 0x00});
  expect_told(0x000, {0x55, 0x05});
  EXPECT_TRUE(drain(at(1ms)).empty());
}

// An NMT master executes no NMT commands from the bus, but it reports malformed ones.
TEST_F(MalformedFrameTest, NodeControlOfAMaster) {
  node =
      std::make_unique<Node>(example_dictionary(), Options{kNodeId, false, false}, events, nullptr);
  boot();
  expect_told(0x000, {});
  expect_told(0x000, {0x01});
  expect_told(0x000, {0x55, 0x05});
  nmt(0x01);
  EXPECT_EQ(node->state(), nmt::State::pre_operational);
  EXPECT_EQ(node->counters().malformed, 3U);
}

TEST_F(MalformedFrameTest, SyncIsAnEmcyOnce) {
  boot();
  expect_told(0x080, {1});
  expect_told(0x080, {1, 2});
  const std::vector<Sent> error{{at(1ms), 0x085, {0x40, 0x82, 0x11, 0, 0, 0, 0, 0}}};
  EXPECT_EQ(drain(at(1ms)), error);
  hear(2ms, 0x080, {});
  const std::vector<Sent> reset{{at(2ms), 0x085, {0, 0, 0, 0, 0, 0, 0, 0}}};
  EXPECT_EQ(drain(at(2ms)), reset);
}

TEST_F(MalformedFrameTest, SyncCounterOutOfItsRange) {
  boot();
  EXPECT_EQ(sdo_write({0x1019, 0}, 1, 10), 0U);
  expect_told(0x080, {0});
  expect_told(0x080, {11});
  EXPECT_TRUE(drain(at(1ms)).empty()) << "no EMCY: the length is right";
  EXPECT_EQ(node->counters().syncs, 2U) << "they count as SYNCs";
}

TEST_F(MalformedFrameTest, Sdo) {
  boot();
  expect_told(0x605, {});
  expect_told(0x605, {0x40, 0x00, 0x10, 0x00});
  EXPECT_TRUE(drain(at(1ms)).empty());
  EXPECT_EQ(sdo_write({0x2000, 1}, 2, 1), 0U);
}

TEST_F(MalformedFrameTest, Heartbeat) {
  boot();
  sdo_write({0x1016, 1}, 4, 0x0007'0064);
  expect_told(0x707, {});
  expect_told(0x707, {0x05, 0x05});
  expect_told(0x707, {0x33});
  EXPECT_EQ(node->next_wake(), kNever);
}

TEST_F(MalformedFrameTest, OwnNodeId) {
  boot();
  expect_told(0x705, {});
  expect_told(0x705, {0x05, 0x05});
  expect_told(0x705, {0x33});
  EXPECT_TRUE(drain(at(1ms)).empty());
}

TEST_F(MalformedFrameTest, Time) {
  boot();
  expect_told(0x100, {});
  expect_told(0x100, {1, 2, 3, 4, 5});
  expect_told(0x100, {0xFF, 0xFF, 0xFF, 0x0F, 1, 0});
  EXPECT_EQ(node->counters().times, 0U);
}

TEST_F(MalformedFrameTest, Emcy) {
  boot();
  sdo_write({0x1028, 7}, 4, 0x87);
  expect_told(0x087, {0x00, 0x10, 0x01});
}

TEST_F(MalformedFrameTest, EmcyOnTheCobIdOfSeveralEntriesIsOneFrame) {
  boot();
  for (const std::uint8_t id : std::array<std::uint8_t, 3>{7, 3, 8}) {
    ASSERT_EQ(sdo_write({0x1028, id}, 4, 0x87), 0U);
  }
  for (int i = 0; i < 3; ++i) {
    expect_told(0x087, {0x00, 0x10, 0x01});
  }
}

// Frames with identifiers near those of the services, any length and any data: the node continues
// to work.
TEST_F(MalformedFrameTest, RandomFramesDoNoHarm) {
  boot_and_start();
  sdo_write({0x1016, 1}, 4, 0x0007'0064);
  sdo_write({0x1028, 7}, 4, 0x87);
  std::mt19937 random(20260101);
  constexpr std::array<std::uint32_t, 10> kIds{0x000, 0x080, 0x087, 0x100, 0x205,
                                               0x305, 0x605, 0x707, 0x185, 0x705};
  Instant now = at(1ms);
  for (int i = 0; i < 20'000; ++i) {
    can::Frame frame;
    frame.time = now;
    frame.id = kIds[random() % kIds.size()];
    frame.length = static_cast<std::uint8_t>(random() % 9);
    frame.flags = random() % 16 == 0 ? can::Frame::kRemote : 0;
    for (std::byte& byte : std::span(frame.data).first(8)) {
      byte = static_cast<std::byte>(random());
    }
    node->receive({&frame, 1});
    now += 37us;
    node->advance(now);
    drain(now);
    testing::pop_events(events);
  }
  EXPECT_EQ(node->counters().received.frames, 20'000U + 3);
  node->start(now);
  drain(now);
  EXPECT_EQ(sdo_write({0x2000, 1}, 2, 0x4321, now - at(0ms)), 0U);
  EXPECT_EQ(number(0x2000, 1), 0x4321U);
}

}  // namespace
}  // namespace linegate::node

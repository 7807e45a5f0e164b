// SPDX-License-Identifier: Apache-2.0
// A node of CANopen FD: USDO and never SDO, no remote frames, no guarding.
#include <algorithm>
#include <cstdint>
#include <optional>

#include <gmock/gmock.h>

#include "tests/stack/node/node_fixture.h"

namespace linegate::node {
namespace {

class FdNodeTest : public NodeTest {
 protected:
  FdNodeTest() : NodeTest({.node_id = kNodeId, .fd = true}) {}

  void hear_fd(Duration when, std::uint32_t id, std::initializer_list<std::uint8_t> data) {
    can::Frame frame = frame_at(at(when), id, {});
    frame.flags = can::Frame::kFd | can::Frame::kBitRateSwitch;
    frame.length = can::fd_length(data.size());
    std::ranges::transform(data, frame.data.begin(), [](std::uint8_t b) { return std::byte{b}; });
    node->receive({&frame, 1});
  }
  // The answer to client 1.
  std::vector<int> ask(std::initializer_list<std::uint8_t> request, Duration when = 0ms) {
    hear_fd(when, 0x601, request);
    const std::vector<Sent> sent = drain(at(when));
    if (sent.empty()) {
      return {};
    }
    EXPECT_EQ(sent.front().id, 0x580U + kNodeId);
    return sent.front().data;
  }
};

using testing::sub;

constexpr std::uint16_t kClassicalObjects[] = {0x100C, 0x100D, 0x1200, 0x1201, 0x1280};

TEST_F(FdNodeTest, ServesUsdoOfEveryClient) {
  boot();
  EXPECT_THAT(ask({5, 0x11, 1, 1, 0, 0x20}),
              ::testing::ElementsAre(1, 0x31, 1, 1, 0, 0x20, 6, 2, 0x11, 0x11, 0, 0));
  hear_fd(0ms, 0x67F, {5, 0x11, 9, 1, 0, 0x20});
  const std::vector<Sent> sent = drain(at(0ms));
  ASSERT_EQ(sent.size(), 1U);
  EXPECT_THAT(sent[0].data,
              ::testing::ElementsAre(127, 0x31, 9, 1, 0, 0x20, 6, 2, 0x11, 0x11, 0, 0));
}

TEST_F(FdNodeTest, AWriteTakesEffectAtOnce) {
  boot();
  EXPECT_EQ(ask({5, 0x01, 1, 0, 0x17, 0x10, 6, 2, 100, 0}).at(1), 0x21);
  EXPECT_EQ(advance(99ms).size(), 0U);
  EXPECT_EQ(advance(100ms).size(), 1U) << "the heartbeat";
}

TEST_F(FdNodeTest, NeverServesSdo) {
  boot();
  EXPECT_EQ(sdo_write({0x2000, 1}, 2, 7), std::nullopt);
  hear(0ms, 0x601, {0x40, 0, 0x20, 1, 0, 0, 0, 0});
  EXPECT_TRUE(drain(at(0ms)).empty());
  EXPECT_EQ(node->counters().malformed, 1U) << "601h is an identifier of USDO";
}

TEST_F(FdNodeTest, HasNoObjectsOfSdoAndGuarding) {
  od::Dictionary dictionary = example_dictionary();
  for (const std::uint16_t index : kClassicalObjects) {
    od::ObjectDescription object;
    object.index = index;
    object.variables.push_back(sub(0, od::DataType::unsigned8, 0));
    ASSERT_TRUE(dictionary.add(object).ok());
  }
  const Node other(std::move(dictionary), {.node_id = kNodeId, .fd = true}, events, nullptr);
  for (const std::uint16_t index : kClassicalObjects) {
    EXPECT_FALSE(other.dictionary().has_object(index)) << index;
  }
}

TEST_F(FdNodeTest, AnswersNoRemoteFrame) {
  boot_and_start();
  drain(at(0ms));
  for (const std::uint32_t id : {0x285U, 0x700U + kNodeId}) {
    can::Frame remote = frame_at(at(1ms), id, {});
    remote.flags = can::Frame::kRemote;
    node->receive({&remote, 1});
  }
  EXPECT_TRUE(advance(1ms).empty());
  EXPECT_EQ(node->counters().unused, 2U);
}

TEST_F(FdNodeTest, UsdoStopsWithTheStateStopped) {
  boot();
  nmt(0x02);
  EXPECT_TRUE(ask({5, 0x11, 1, 1, 0, 0x20}).empty());
  nmt(0x80);
  EXPECT_FALSE(ask({5, 0x11, 1, 1, 0, 0x20}).empty());
}

TEST_F(FdNodeTest, AStalledTransferIsAborted) {
  boot();
  EXPECT_EQ(ask({5, 0x02, 1, 1, 0, 0x20, 6, 0, 2, 0, 0, 0}).at(1), 0x22);
  EXPECT_EQ(node->next_wake(), at(1s));
  const std::vector<Sent> sent = advance(1s);
  ASSERT_EQ(sent.size(), 1U);
  EXPECT_THAT(sent[0].data, ::testing::ElementsAre(1, 0x7F, 1, 1, 0, 0x20, 0x60));
}

}  // namespace
}  // namespace linegate::node

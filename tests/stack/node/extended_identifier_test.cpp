// SPDX-License-Identifier: Apache-2.0
// Every object that holds a COB-ID, with 29-bit identifiers: transmitted frames are extended, and a
// received 11-bit frame with the same number is not accepted.
#include "stack/node/sdo_clients.h"
#include "stack/time/service.h"

#include "tests/stack/node/node_fixture.h"

namespace linegate::node {
namespace {

using enum od::DataType;

constexpr std::uint32_t kInvalid = 0x8000'0000;
constexpr std::uint32_t kProduce = 0x4000'0000;
constexpr std::uint32_t kExtended = 0x2000'0000;
// No service receives 11-bit frames with the lower bits of these identifiers.
constexpr std::uint32_t kId = 0x1234'56D1;
constexpr std::uint32_t kOther = 0x1ABC'DED2;

class ExtendedIdentifierTest : public NodeTest {
 protected:
  ExtendedIdentifierTest() {
    od::Dictionary dictionary = example_dictionary();
    for (const std::uint16_t index : {std::uint16_t{0x1201}, std::uint16_t{0x1280}}) {
      EXPECT_TRUE(
          dictionary
              .add(testing::record(
                  index, {testing::sub(0, unsigned8, 3, od::Access::constant),
                          testing::sub(1, unsigned32, kInvalid),
                          testing::sub(2, unsigned32, kInvalid), testing::sub(3, unsigned8, 7)}))
              .ok());
    }
    node =
        std::make_unique<Node>(std::move(dictionary), Options{.node_id = kNodeId}, events, nullptr);
    boot_and_start();
  }

  void write(std::uint16_t index, std::uint8_t sub, std::uint32_t cob_id) {
    EXPECT_EQ(sdo_write({index, sub}, 4, cob_id), 0U) << std::hex << index << ' ' << cob_id;
  }

  // Receives the data in an 11-bit frame first, which no service accepts.
  void hear_extended(std::uint32_t id, std::initializer_list<std::uint8_t> data,
                     std::uint8_t flags = 0) {
    const std::uint64_t unused = node->counters().unused;
    can::Frame frame = frame_at(at(1ms), id & 0x7FFU, data);
    frame.flags = flags;
    node->receive({&frame, 1});
    EXPECT_EQ(node->counters().unused, unused + 1);
    EXPECT_FALSE(node->next_frame(frame, at(1ms)));
    frame = frame_at(at(1ms), id, data);
    frame.flags = flags | can::Frame::kExtended;
    node->receive({&frame, 1});
    EXPECT_EQ(node->counters().unused, unused + 1);
  }

  // The only frame that is due.
  can::Frame only_frame(Duration when = 1ms) {
    can::Frame frame;
    can::Frame next;
    EXPECT_TRUE(node->next_frame(frame, at(when)));
    EXPECT_FALSE(node->next_frame(next, at(when)));
    EXPECT_TRUE(frame.extended());
    return frame;
  }
};

TEST_F(ExtendedIdentifierTest, Sync1005h) {
  write(0x1005, 0, kExtended | kId);
  hear_extended(kId, {});
  EXPECT_EQ(node->counters().syncs, 1U);
  drain(at(1ms));
  write(0x1800, 1, kInvalid);
  write(0x1005, 0, kExtended | kProduce | kId);
  write(0x1006, 0, 10'000);
  node->advance(at(10ms));
  const can::Frame sync = only_frame(10ms);
  EXPECT_EQ(sync.id, kId);
  EXPECT_EQ(sync.length, 0);
}

TEST_F(ExtendedIdentifierTest, Time1012h) {
  node->clock().set_clock(true);
  write(0x1012, 0, 0x100);
  write(0x1012, 0, kExtended | time::kConsumeBit | kId);
  hear_extended(kId, {0, 0, 0, 0, 1, 0});
  EXPECT_EQ(node->counters().times, 1U);
  write(0x1012, 0, kExtended | kId);
  write(0x1012, 0, kExtended | time::kProduceBit | kOther);
  ASSERT_TRUE(node->clock().send({}));
  EXPECT_EQ(only_frame().id, kOther);
}

TEST_F(ExtendedIdentifierTest, EmcyProducer1014h) {
  write(0x1014, 0, kInvalid);
  write(0x1014, 0, kExtended | kId);
  EXPECT_EQ(node->set_error(0x1000, {}, at(1ms)), emcy::SendResult::sent);
  EXPECT_EQ(only_frame().id, kId);
}

TEST_F(ExtendedIdentifierTest, EmcyConsumer1028h) {
  write(0x1028, 7, kExtended | kId);
  write(0x1028, 8, kExtended | kOther);
  testing::pop_events(events);
  hear_extended(kId, {0x00, 0x10, 0x01, 0, 0, 0, 0, 0});
  hear_extended(kOther, {0x00, 0x20, 0x01, 0, 0, 0, 0, 0});
  const std::vector<Event> told = testing::pop_events(events);
  ASSERT_EQ(told.size(), 2U);
  EXPECT_EQ(told[0].kind(), EventKind::emcy);
  EXPECT_EQ(told[0].node, 7);
  EXPECT_EQ(told[1].node, 8);
  write(0x1028, 7, kInvalid);
  can::Frame frame = frame_at(at(2ms), kId, {0x00, 0x10, 0x01, 0, 0, 0, 0, 0});
  frame.flags = can::Frame::kExtended;
  node->receive({&frame, 1});
  EXPECT_TRUE(testing::pop_events(events).empty());
}

TEST_F(ExtendedIdentifierTest, SdoServer1201h) {
  write(0x1201, 1, kExtended | kId);
  write(0x1201, 2, kExtended | kOther);
  hear_extended(kId, {0x40, 0x00, 0x20, 0x01, 0, 0, 0, 0});
  const can::Frame answer = only_frame();
  EXPECT_EQ(answer.id, kOther);
  EXPECT_EQ(testing::data_of(answer), (std::vector<int>{0x4B, 0x00, 0x20, 0x01, 0x11, 0x11, 0, 0}));
}

TEST_F(ExtendedIdentifierTest, SdoClient1280h) {
  write(0x1280, 1, kExtended | kId);
  write(0x1280, 2, kExtended | kOther);
  const Result<sdo::Client*> client = node->sdo_clients().client(1);
  ASSERT_TRUE(client.ok());
  (*client)->read({0x2000, 1}, 500ms, at(1ms), node->transmit());
  EXPECT_EQ(only_frame().id, kId);
  hear_extended(kOther, {0x4B, 0x00, 0x20, 0x01, 0x34, 0x12, 0, 0});
  const auto done = (*client)->take();
  ASSERT_TRUE(done);
  EXPECT_EQ(done->abort, AbortCode::none);
  EXPECT_EQ(done->data, (std::vector{std::byte{0x34}, std::byte{0x12}}));
}

TEST_F(ExtendedIdentifierTest, Rpdo1400h) {
  write(0x1400, 1, kInvalid);
  write(0x1400, 1, kExtended | kId);
  hear_extended(kId, {0x34, 0x12});
  EXPECT_EQ(number(0x2000, 1), 0x1234U);
  EXPECT_TRUE(node->pdos().request_rpdo(1));
  const can::Frame asked = only_frame();
  EXPECT_EQ(asked.id, kId);
  EXPECT_TRUE(asked.remote());
}

TEST_F(ExtendedIdentifierTest, Tpdo1800h) {
  write(0x1801, 1, kInvalid);
  write(0x1801, 1, kExtended | kId);
  drain(at(0ms));
  EXPECT_TRUE(node->pdos().trigger(2, at(1ms)));
  EXPECT_EQ(only_frame().id, kId);
  hear_extended(kId, {}, can::Frame::kRemote);
  EXPECT_EQ(only_frame().id, kId) << "answers a remote frame";
}

}  // namespace
}  // namespace linegate::node

// SPDX-License-Identifier: Apache-2.0
#include "stack/emcy/consumer.h"

#include <gtest/gtest.h>

#include "stack/emcy/consumer_object.h"
#include "stack/od/objects.h"

#include "tests/stack/node/objects.h"

namespace linegate::emcy {
namespace {

using namespace std::chrono_literals;
using testing::at;
using testing::frame_at;
using testing::pop_events;
using testing::write;

struct Heard : Listener {
  void emergency(std::uint8_t node, const Message& message, Instant /*now*/) override {
    nodes.push_back(node);
    last = message;
  }
  std::vector<int> nodes;
  Message last;
};

class EmcyConsumerTest : public ::testing::Test {
 protected:
  bool wants(std::uint32_t id) { return dispatch.find(can::make_frame(id, {})) != nullptr; }

  can::Dispatch dispatch;
  EventLog events;
  Consumer consumer{dispatch, events};
};

TEST_F(EmcyConsumerTest, MessagesBecomeEvents) {
  Heard heard;
  consumer.set_listener(&heard);
  EXPECT_TRUE(consumer.receive(5, frame_at(at(7ms), 0x85, {0x30, 0x81, 0x11, 1, 2, 3, 4, 5})));
  const auto told = pop_events(events);
  ASSERT_EQ(told.size(), 1U);
  EXPECT_EQ(told[0].node, 5);
  EXPECT_EQ(told[0].time, at(7ms));
  const auto& emcy = std::get<event::Emcy>(told[0].data);
  EXPECT_EQ(emcy.code, 0x8130U);
  EXPECT_EQ(emcy.error_register, 0x11U);
  EXPECT_EQ(emcy.manufacturer[0], std::byte{1});
  EXPECT_EQ(heard.nodes, (std::vector<int>{5}));
  EXPECT_EQ(heard.last.code, 0x8130);
  EXPECT_EQ(consumer.received(), 1U);
}

TEST_F(EmcyConsumerTest, MessagesOfCanopenFdAreReceivedIfTheyAreExpected) {
  const Message message{.code = 0x8130,
                        .error_register = 0x11,
                        .info = {std::byte{1}},
                        .fd = {.any = true, .logical_device = 1, .status = 1, .profile = 401}};
  const can::Frame frame = encode(message, can::CobId{0x85});
  EXPECT_FALSE(consumer.receive(5, frame));
  EXPECT_TRUE(events.empty());
  consumer.accept_fd();
  EXPECT_TRUE(consumer.receive(5, frame));
  EXPECT_TRUE(consumer.receive(5, frame_at(at(7ms), 0x85, {0x30, 0x81, 0x11, 1, 2, 3, 4, 5})));
  const auto reported = pop_events(events);
  ASSERT_EQ(reported.size(), 2U);
  EXPECT_EQ(std::get<event::Emcy>(reported[0].data).fd, message.fd);
  EXPECT_FALSE(std::get<event::Emcy>(reported[1].data).fd.any);
}

TEST_F(EmcyConsumerTest, ShortMessagesAreMalformed) {
  EXPECT_FALSE(consumer.receive(5, frame_at(at(7ms), 0x85, {0x30, 0x81, 0x11})));
  EXPECT_TRUE(events.empty());
  EXPECT_EQ(consumer.received(), 0U);
}

TEST_F(EmcyConsumerTest, ListensToAllButTheOwnNode) {
  consumer.listen_all(7);
  EXPECT_TRUE(wants(0x081));
  EXPECT_TRUE(wants(0x0FF));
  EXPECT_FALSE(wants(0x087));
  EXPECT_FALSE(wants(0x080));
}

TEST_F(EmcyConsumerTest, TheObjectListsWhatIsConsumed) {
  od::Dictionary dictionary = testing::dictionary_of(
      {testing::array(od::objects::kEmcyConsumer, od::DataType::unsigned32, 8)});
  ConsumerObject object(dictionary, consumer);
  ASSERT_TRUE(dictionary.set_hook(od::objects::kEmcyConsumer, &object).ok());
  object.configure();
  EXPECT_FALSE(wants(0x000));
  EXPECT_EQ(write<std::uint32_t>(dictionary, {od::objects::kEmcyConsumer, 5}, 0x85),
            AbortCode::none);
  EXPECT_TRUE(wants(0x085));
  EXPECT_FALSE(wants(0x086));
  EXPECT_EQ(write<std::uint32_t>(dictionary, {od::objects::kEmcyConsumer, 5}, 0x86),
            AbortCode::invalid_value);
  EXPECT_EQ(write<std::uint32_t>(dictionary, {od::objects::kEmcyConsumer, 5}, 0x8000'0085),
            AbortCode::none);
  EXPECT_FALSE(wants(0x085));
  EXPECT_EQ(write<std::uint32_t>(dictionary, {od::objects::kEmcyConsumer, 6}, 0x701),
            AbortCode::invalid_value);
}

}  // namespace
}  // namespace linegate::emcy

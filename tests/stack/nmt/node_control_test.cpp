#include "stack/nmt/node_control.h"

#include <gtest/gtest.h>

#include "stack/nmt/master.h"

#include "tests/stack/node/objects.h"

namespace linegate::nmt {
namespace {

using testing::data_of;
using testing::take_frames;

TEST(NodeControl, CommandSpecifiers) {
  const std::pair<Command, int> table[] = {{Command::start, 0x01},
                                           {Command::stop, 0x02},
                                           {Command::enter_pre_operational, 0x80},
                                           {Command::reset_node, 0x81},
                                           {Command::reset_communication, 0x82}};
  for (const auto& [command, specifier] : table) {
    const can::Frame frame = encode({command, 5});
    EXPECT_EQ(frame.id, 0U);
    EXPECT_EQ(data_of(frame), (std::vector<int>{specifier, 5}));
    const auto decoded = decode_node_control(frame);
    ASSERT_TRUE(decoded);
    EXPECT_EQ(decoded->command, command);
    EXPECT_EQ(decoded->node, 5);
  }
}

TEST(NodeControl, AddressesOneNodeOrAll) {
  EXPECT_TRUE((NodeControl{Command::start, 0}.addresses(5)));
  EXPECT_TRUE((NodeControl{Command::start, 5}.addresses(5)));
  EXPECT_FALSE((NodeControl{Command::start, 6}.addresses(5)));
}

TEST(NodeControl, MalformedFramesAreNotDecoded) {
  EXPECT_FALSE(decode_node_control(can::make_frame(0, {})));
  EXPECT_FALSE(decode_node_control(can::make_frame(0, {0x01})));
  EXPECT_FALSE(decode_node_control(can::make_frame(0, {0x01, 5, 0})));
  EXPECT_FALSE(decode_node_control(can::make_frame(0, {0x03, 5})));
  EXPECT_FALSE(decode_node_control(can::make_frame(0, {0x83, 5})));
  EXPECT_FALSE(decode_node_control(can::make_frame(0, {0x01, 128})));
}

TEST(Master, QueuesTheCommand) {
  can::TransmitQueue queue(2);
  Master master(queue);
  EXPECT_TRUE(master.send(Command::reset_communication));
  EXPECT_EQ(queue.queued(can::TransmitClass::nmt), 1U);
  const auto frames = take_frames(queue);
  ASSERT_EQ(frames.size(), 1U);
  EXPECT_EQ(frames[0].id, 0U);
  EXPECT_EQ(data_of(frames[0]), (std::vector<int>{0x82, 0}));
}

TEST(Master, RefusesWhatCannotBeSent) {
  can::TransmitQueue queue(1);
  Master master(queue);
  EXPECT_FALSE(master.send(Command::start, 128));
  EXPECT_TRUE(master.send(Command::start, 127));
  EXPECT_FALSE(master.send(Command::start, 1));
}

}  // namespace
}  // namespace linegate::nmt

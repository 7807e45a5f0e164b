// SPDX-License-Identifier: Apache-2.0
#include "stack/nmt/node_control.h"

#include <gtest/gtest.h>

#include "stack/nmt/master.h"
#include "stack/od/dictionary.h"

#include "tests/stack/node/objects.h"

namespace linegate::nmt {
namespace {

using testing::data_of;
using testing::pop_frames;

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

TEST(NodeControl, EachCommandLeadsToOneState) {
  EXPECT_EQ(state_after(Command::start), State::operational);
  EXPECT_EQ(state_after(Command::stop), State::stopped);
  for (const Command command :
       {Command::enter_pre_operational, Command::reset_node, Command::reset_communication}) {
    EXPECT_EQ(state_after(command), State::pre_operational);
  }
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
  EXPECT_TRUE(master.send(Command::reset_communication, 0, Instant{}));
  EXPECT_EQ(queue.queued(can::TransmitClass::nmt), 1U);
  const auto frames = pop_frames(queue);
  ASSERT_EQ(frames.size(), 1U);
  EXPECT_EQ(frames[0].id, 0U);
  EXPECT_EQ(data_of(frames[0]), (std::vector<int>{0x82, 0}));
}

TEST(Master, RefusesWhatCannotBeSent) {
  can::TransmitQueue queue(1);
  Master master(queue);
  EXPECT_FALSE(master.send(Command::start, 128, Instant{}));
  EXPECT_TRUE(master.send(Command::start, 127, Instant{}));
  EXPECT_FALSE(master.send(Command::start, 1, Instant{}));
}

od::Dictionary with_inhibit_time(std::uint16_t ticks) {
  od::VariableDescription variable;
  variable.type = od::DataType::unsigned16;
  variable.value = {static_cast<std::byte>(ticks), static_cast<std::byte>(ticks >> 8U)};
  od::ObjectDescription object;
  object.index = 0x102A;
  object.variables.push_back(variable);
  od::Dictionary out;
  EXPECT_TRUE(out.add(object).ok());
  return out;
}

TEST(Master, CommandsKeepTheInhibitTimeAndTheirOrder) {
  using std::chrono::milliseconds;
  can::TransmitQueue queue(4);
  od::Dictionary dictionary = with_inhibit_time(100);
  Master master(queue, &dictionary);
  const Instant start{std::chrono::seconds(1)};
  EXPECT_TRUE(master.send(Command::stop, 5, start));
  EXPECT_TRUE(master.send(Command::stop, 6, start));
  EXPECT_TRUE(master.send(Command::start, 5, start + milliseconds(1)));
  EXPECT_EQ(data_of(pop_frames(queue).at(0)), (std::vector<int>{0x02, 5}));
  EXPECT_EQ(master.next_wake(), start + milliseconds(10));
  master.advance(start + milliseconds(9));
  EXPECT_TRUE(queue.empty());
  master.advance(start + milliseconds(10));
  EXPECT_EQ(data_of(pop_frames(queue).at(0)), (std::vector<int>{0x02, 6}));
  EXPECT_EQ(master.next_wake(), start + milliseconds(20));
  ASSERT_TRUE(dictionary.set({0x102A, 0}, std::uint16_t{0}));
  master.advance(start + milliseconds(20));
  EXPECT_EQ(data_of(pop_frames(queue).at(0)), (std::vector<int>{0x01, 5}));
  EXPECT_EQ(master.next_wake(), kNever);
  EXPECT_TRUE(master.send(Command::stop, 6, start + milliseconds(20)))
      << "no inhibit time any more";
  EXPECT_TRUE(master.send(Command::stop, 7, start + milliseconds(20)));
  EXPECT_EQ(pop_frames(queue).size(), 2U);
}

// Other services use the most urgent class, too.
TEST(Master, AnInactiveOneDropsItsCommandsAlone) {
  can::TransmitQueue queue(4);
  Master master(queue);
  EXPECT_TRUE(master.send(Command::start, 5, Instant{}));
  EXPECT_TRUE(queue.push(can::TransmitClass::nmt, can::make_frame(0x690, {3})));
  EXPECT_TRUE(master.send(Command::start, 6, Instant{}));
  master.set_active(false);
  const auto frames = pop_frames(queue);
  ASSERT_EQ(frames.size(), 1U);
  EXPECT_EQ(frames[0].id, 0x690U);
  EXPECT_FALSE(master.send(Command::start, 5, Instant{}));
}

}  // namespace
}  // namespace linegate::nmt

// SPDX-License-Identifier: Apache-2.0
// Configured values for objects of the own node.
#include "stack/base/abort_code.h"
#include "stack/od/dictionary.h"

#include "tests/stack/line/line_fixture.h"

namespace linegate::line {
namespace {

class OwnValuesTest : public LineTest {
 protected:
  static ObjectValue value(std::uint16_t index, std::uint8_t sub,
                           std::initializer_list<unsigned> bytes) {
    ObjectValue out{.address = {index, sub}, .data = {}};
    for (const unsigned byte : bytes) {
      out.data.push_back(static_cast<std::byte>(byte));
    }
    return out;
  }
  std::uint64_t own(std::uint16_t index, std::uint8_t sub) {
    return line_->dictionary().number({index, sub}).value_or(0);
  }
};

TEST_F(OwnValuesTest, AreWrittenAtTheStartAndAfterEachReset) {
  LineConfig config = config_with_axis();
  config.own_values = {value(0x1007, 0, {0x20, 0x4E, 0, 0}), value(0x5F41, 8, {100, 0})};
  make(std::move(config));
  EXPECT_EQ(own(0x1007, 0), 0U);
  line_->start(now_);
  pass(milliseconds(1));
  EXPECT_EQ(own(0x1007, 0), 20'000U);
  EXPECT_EQ(own(0x1800, 5), 100U) << "5F41h:8 is the event timer of all TPDOs";
  ASSERT_TRUE(line_->dictionary().set({0x1007, 0}, 1U));
  Command command{.request = NmtRequest{.node = 127, .command = nmt::Command::reset_node}};
  line_->execute(std::move(command), now_);
  ASSERT_TRUE(answer().ok());
  EXPECT_EQ(own(0x1007, 0), 20'000U) << "the reset restores it";
  pass(milliseconds(1));
  EXPECT_EQ(own(0x1800, 5), 100U);
}

// A line of CANopen FD keeps its role.
TEST_F(OwnValuesTest, DoNotChangeTheRoleOfAnFdLine) {
  for (const Role role : {Role::manager, Role::device}) {
    for (const unsigned startup : {0U, 1U}) {
      LineConfig config;
      config.name = "press";
      config.canopen_fd = true;
      config.role = role;
      config.own_values = {value(0x1F80, 0, {startup, 0, 0, 0})};
      EXPECT_EQ(Line::make(config).ok(), (role == Role::manager) == (startup == 1));
    }
  }
}

// The configured 1F80h: bit 0 is 0, NMT slave; bit 2 is 0, the node enters Operational without a
// command.
class SlaveByOwnValuesTest : public OwnValuesTest {
 protected:
  void start(unsigned startup) {
    LineConfig config = config_with_axis();
    config.own_values = {value(0x1F80, 0, {startup, 0, 0, 0})};
    make(std::move(config));
    line_->start(now_);
    pass(milliseconds(10));
  }
  void reset_own(nmt::Command which) {
    Command command{.request = NmtRequest{.node = 127, .command = which}};
    line_->execute(std::move(command), now_);
    EXPECT_TRUE(answer().ok());
    pass(milliseconds(10));
  }
  static bool has_node_control(const std::vector<std::string>& frames) {
    return std::ranges::any_of(frames, [](const auto& frame) { return frame.starts_with("000#"); });
  }
};

TEST_F(SlaveByOwnValuesTest, SendsNoNodeControlWhenTheOwnNodeIsReset) {
  start(0x04);
  EXPECT_FALSE(has_node_control(sent()));
  for (const auto reset : {nmt::Command::reset_node, nmt::Command::reset_communication}) {
    reset_own(reset);
    EXPECT_FALSE(has_node_control(sent()));
    EXPECT_EQ(line_->state().role, Role::device);
    EXPECT_EQ(line_->state().own_state, nmt::State::pre_operational);
  }
  hear(0x000, {0x81, 0x7F});
  pass(milliseconds(10));
  EXPECT_FALSE(has_node_control(sent())) << "reset by the master of the network";
  line_->stop(now_);
  line_->start(now_);
  pass(milliseconds(10));
  EXPECT_FALSE(has_node_control(sent())) << "the line is started again";
}

TEST_F(SlaveByOwnValuesTest, EntersOperationalByItselfWheneverItBoots) {
  start(0x00);
  EXPECT_EQ(line_->state().own_state, nmt::State::operational) << "power-on";
  for (const auto reset : {nmt::Command::reset_node, nmt::Command::reset_communication}) {
    reset_own(reset);
    EXPECT_EQ(line_->state().own_state, nmt::State::operational);
  }
  line_->stop(now_);
  line_->start(now_);
  pass(milliseconds(1));
  EXPECT_EQ(line_->state().own_state, nmt::State::operational);
}

TEST_F(SlaveByOwnValuesTest, TheRoleDeviceWithoutDevicesIsTheSame) {
  for (const bool by_itself : {false, true}) {
    LineConfig config = config_with_axis();
    config.role = Role::device;
    config.own_start = by_itself;
    make(std::move(config));
    line_->start(now_);
    pass(milliseconds(10));
    EXPECT_EQ(line_->dictionary().number({0x1F80, 0}), by_itself ? 0U : 4U);
    EXPECT_EQ(line_->state().own_state,
              by_itself ? nmt::State::operational : nmt::State::pre_operational);
    hear(0x000, {0x02, 0x7F});
    EXPECT_EQ(line_->state().own_state, nmt::State::stopped);
    hear(0x000, {0x82, 0x7F});
    pass(milliseconds(10));
    EXPECT_EQ(line_->state().own_state,
              by_itself ? nmt::State::operational : nmt::State::pre_operational);
    EXPECT_FALSE(has_node_control(sent()));
  }
}

// The default SDO servers of other nodes belong to the master (IXXAT 8.1.9).
TEST_F(SlaveByOwnValuesTest, ADeviceStartsNoSdoToOtherNodes) {
  LineConfig config = config_with_axis();
  config.role = Role::device;
  make(std::move(config));
  line_->start(now_);
  pass(milliseconds(10));
  (void)sent();
  const Request requests[] = {SdoRead{.node = 5, .address = {0x1000, 0}},
                              SdoWrite{.node = 5, .address = {0x1000, 0}}};
  for (const Request& request : requests) {
    line_->execute({.request = request}, now_);
    Reply reply;
    ASSERT_TRUE(line_->pop_reply(reply));
    EXPECT_EQ(reply.error, to_error(Refusal::wrong_role));
  }
  pass(milliseconds(10));
  EXPECT_THAT(sent(), testing::Not(testing::Contains(testing::StartsWith("605#"))));
}

TEST_F(SlaveByOwnValuesTest, CommandsThatWaitAreNotSentByASlave) {
  LineConfig config = config_with_axis();
  config.nmt_inhibit = milliseconds(100);
  make(std::move(config));
  line_->start(now_);
  pass(milliseconds(10));
  (void)sent();
  Command command{.request = NmtRequest{.node = 5, .command = nmt::Command::start}};
  line_->execute(std::move(command), now_);
  ASSERT_TRUE(line_->dictionary().set({0x1F80, 0}, 4U));
  pass(seconds(1));
  EXPECT_FALSE(has_node_control(sent()));
}

TEST_F(OwnValuesTest, WhatIsRefusedIsToldAndTheOthersAreWritten) {
  LineConfig config = config_with_axis();
  config.own_values = {value(0x5F41, 5, {0, 0}), value(0x1007, 0, {1, 0, 0, 0})};
  make(std::move(config));
  line_->start(now_);
  EXPECT_EQ(own(0x1007, 0), 1U);
  const std::vector<Event> all = events();
  const auto refused = std::ranges::find(all, EventKind::configuration_error, &Event::kind);
  ASSERT_NE(refused, all.end());
  EXPECT_EQ(refused->node, 127);
  EXPECT_EQ(refused->data, EventData(event::ConfigurationError{
                               .abort = AbortCode::value_too_low, .index = 0x5F41, .sub = 5}));
}

}  // namespace
}  // namespace linegate::line

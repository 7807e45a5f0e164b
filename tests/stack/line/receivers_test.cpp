// SPDX-License-Identifier: Apache-2.0
// The outputs of a node: they are sent when it is started, and are shown as valid after they were
// sent.
#include "stack/base/byte_order.h"
#include "stack/od/dictionary.h"

#include "tests/stack/line/line_fixture.h"

namespace linegate::line {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

constexpr std::uint8_t kOperational = 0x05;
constexpr std::uint8_t kPreOperational = 0x7F;

class OutputsOfANode : public LineTest {
 protected:
  std::vector<std::string> pdos() {
    std::vector<std::string> out = sent();
    std::erase_if(out, [](const std::string& frame) { return !frame.starts_with("205#"); });
    return out;
  }
  OutputRefusal write(std::uint32_t setpoint, std::uint8_t mode, std::uint64_t arming = 1,
                      Duration watchdog = {}, std::uint8_t reactions = kHoldOutputs) {
    OutputWrite out;
    out.layout_id = line_->layout(Direction::outputs).id;
    out.arming = arming;
    out.watchdog = watchdog;
    out.reactions = reactions;
    out.values = {{.entry = 0, .length = 4, .data = {}}, {.entry = 1, .length = 1, .data = {}}};
    store_le(out.values[0].data.data(), setpoint);
    out.values[1].data[0] = std::byte{mode};
    return line_->write_outputs(out, now_);
  }
  bool valid() { return snapshot(Direction::outputs).is_valid(0); }
  bool known() { return snapshot(Direction::outputs).is_known(0); }
  void hear_heartbeat(std::uint8_t state) {
    hear(0x705, {state});
    line_->advance(now_);
  }
  // Boots the node again, from its boot-up message to the NMT start.
  void boot_again() {
    hear(0x705, {0x00});
    hear(0x585, {0x43, 0x00, 0x10, 0x00, 0x92, 0x01, 0x02, 0x00});
    hear(0x585, {0x43, 0x18, 0x10, 0x01, 0x23, 0x01, 0x00, 0x00});
    hear(0x585, {0x43, 0x18, 0x10, 0x02, 0x42, 0x00, 0x00, 0x00});
    hear_no_serial_number();
    hear_no_pdo_records();
    hear(0x585, {0x60, 0x17, 0x10, 0x00, 0, 0, 0, 0});
    hear_heartbeat(kPreOperational);
  }
  // The same for a node without error control.
  void boot_unwatched() {
    hear_identity();
    sent();
    hear_no_serial_number();
    line_->advance(now_);
  }
  // Starts the node and receives an old heartbeat, which remained in the controller of a removed
  // device.
  void start_with_a_heartbeat_of_old() {
    LineConfig config = config_with_axis();
    config.defaults = {{.entry = 0, .value = 9}, {.entry = 1, .value = 3}};
    make(std::move(config));
    line_->start(now_);
    hear_heartbeat(kOperational);
  }
  void expect_outputs_after_two_heartbeats() {
    EXPECT_THAT(pdos(), IsEmpty());
    EXPECT_FALSE(valid());
    for (int i = 0; i < 2; ++i) {
      pass(milliseconds(100));
      hear_heartbeat(kOperational);
    }
    line_->advance(now_);
    EXPECT_THAT(pdos(), ElementsAre("205#0900000003"));
    EXPECT_TRUE(valid());
  }
  void become_device_beside_a_guarded_node() {
    LineConfig config = config_without_error_control();
    config.nodes[0].guard_time = milliseconds(100);
    config.nodes[0].life_time_factor = 2;
    make(std::move(config));
    line_->start(now_);
    hear_identity();
    hear_no_serial_number();
    hear(0x585, {0x60, 0x0C, 0x10, 0x00, 0, 0, 0, 0});
    hear(0x585, {0x60, 0x0D, 0x10, 0x00, 0, 0, 0, 0});
    sent();
    hear_heartbeat(kPreOperational);
    sent();
    pass(milliseconds(100));
    hear_heartbeat(0x80 | kOperational);
    pass(milliseconds(100));
    hear_heartbeat(kOperational);
    sent();
    ASSERT_TRUE(valid());
    ASSERT_TRUE(line_->dictionary().set({0x1F80, 0}, 4U));
    pass(milliseconds(1));
    ASSERT_EQ(line_->state().role, Role::device);
    sent();
    ASSERT_TRUE(valid());
  }
  Error write_by_hand(std::uint32_t entry, std::vector<std::byte> data) {
    line_->execute({.request = SingleOutput{.entry = entry, .data = std::move(data)}}, now_);
    return answer().error;
  }
};

TEST_F(OutputsOfANode, AreSentAgainWhenItWasSwitchedOffAndOn) {
  make(config_with_axis());
  boot();
  pass(milliseconds(1));
  EXPECT_EQ(write(1, 2), OutputRefusal::none);
  EXPECT_THAT(pdos(), ElementsAre("205#0100000002"));
  EXPECT_TRUE(valid());
  boot_again();
  EXPECT_FALSE(valid()) << "the device starts with its own values";
  EXPECT_TRUE(known());
  EXPECT_EQ(write(1, 2), OutputRefusal::none);
  EXPECT_THAT(pdos(), IsEmpty()) << "no heartbeat since the start command";
  hear_heartbeat(kOperational);
  EXPECT_THAT(pdos(), ElementsAre("205#0100000002"));
  EXPECT_TRUE(valid());
  hear_heartbeat(kOperational);
  EXPECT_EQ(write(1, 2), OutputRefusal::none);
  EXPECT_THAT(pdos(), IsEmpty()) << "sent once";
}

TEST_F(OutputsOfANode, AreSentAgainWhenItLeftOperationalByItself) {
  make(config_with_axis());
  boot();
  pass(milliseconds(1));
  write(1, 2);
  pdos();
  hear_heartbeat(kPreOperational);
  EXPECT_FALSE(valid());
  write(3, 2);
  EXPECT_FALSE(valid());
  pdos();
  hear_heartbeat(kOperational);
  EXPECT_THAT(pdos(), ElementsAre("205#0300000002"));
  EXPECT_TRUE(valid());
}

TEST_F(OutputsOfANode, AreNotValidWhileItIsMissing) {
  make(config_with_axis());
  boot();
  pass(milliseconds(1));
  write(1, 2);
  pdos();
  pass(milliseconds(250));
  EXPECT_EQ(line_->node_state(5).presence, Presence::missing);
  EXPECT_FALSE(valid());
  EXPECT_EQ(write(3, 4), OutputRefusal::none) << "never refused for an absent node";
  EXPECT_TRUE(known());
  EXPECT_FALSE(valid());
}

// Not with the NMT command that resets the nodes.
TEST_F(OutputsOfANode, DefaultsAreSentAfterItsStart) {
  LineConfig config = config_with_axis();
  config.defaults = {{.entry = 0, .value = 9}, {.entry = 1, .value = 3}};
  make(std::move(config));
  line_->start(now_);
  line_->advance(now_);
  ASSERT_EQ(line_->state().own_state, nmt::State::operational) << "no node is mandatory";
  EXPECT_THAT(pdos(), IsEmpty());
  EXPECT_TRUE(known());
  EXPECT_FALSE(valid());
  boot_again();
  EXPECT_THAT(pdos(), IsEmpty());
  hear_heartbeat(kOperational);
  EXPECT_THAT(pdos(), ElementsAre("205#0900000003"));
  EXPECT_TRUE(valid());
}

TEST_F(OutputsOfANode, WithoutErrorControlAreSentAfterTheStartCommand) {
  make(config_without_error_control());
  line_->start(now_);
  boot_unwatched();
  EXPECT_THAT(sent(), ElementsAre("000#0105", "205#0900000003"));
  EXPECT_TRUE(valid());
}

// One heartbeat remained in the controller of a removed device.
TEST_F(OutputsOfANode, AreNotSentByAHeartbeatFromBeforeTheRoleChanged) {
  start_with_a_heartbeat_of_old();
  line_->execute({.request = NmtRequest{.node = 5, .command = nmt::Command::start}}, now_);
  pass(milliseconds(10));
  ASSERT_TRUE(line_->dictionary().set({0x1F80, 0}, 4U));
  pass(milliseconds(1));
  ASSERT_EQ(line_->state().role, Role::device);
  expect_outputs_after_two_heartbeats();
}

// Possibly no node received the NMT start: the following heartbeats show its effect.
TEST_F(OutputsOfANode, AreNotValidByAStartOfAnotherMasterUntilHeartbeatsFollow) {
  start_with_a_heartbeat_of_old();
  ASSERT_TRUE(line_->dictionary().set({0x1F80, 0}, 4U));
  pass(milliseconds(1));
  ASSERT_EQ(line_->state().role, Role::device);
  hear(0x000, {0x01, 0x00});
  line_->advance(now_);
  expect_outputs_after_two_heartbeats();
}

// The own node is NMT slave, and receives the NMT commands of its master to other nodes.
TEST_F(OutputsOfANode, WithoutErrorControlAreSentWhenAnotherMasterStartsIt) {
  make(config_without_error_control());
  line_->start(now_);
  boot_unwatched();
  EXPECT_THAT(pdos(), ElementsAre("205#0900000003"));
  ASSERT_TRUE(line_->dictionary().set({0x1F80, 0}, 4U));
  pass(milliseconds(1));
  ASSERT_EQ(line_->state().role, Role::device);
  pdos();
  ASSERT_TRUE(valid());
  hear(0x000, {0x02, 0x05});
  line_->advance(now_);
  EXPECT_FALSE(valid()) << "the node is Stopped";
  EXPECT_EQ(line_->node_state(5).state, nmt::State::stopped);
  EXPECT_THAT(pdos(), IsEmpty());
  hear(0x000, {0x80, 0x00});
  EXPECT_EQ(line_->node_state(5).state, nmt::State::pre_operational);
  hear(0x000, {0x01, 0x05});
  EXPECT_EQ(line_->node_state(5).state, nmt::State::operational);
  hear(0x000, {0x82, 0x05});
  EXPECT_EQ(line_->node_state(5).state, nmt::State::unknown) << "unknown until its boot-up message";
  hear(0x000, {0x01, 0x00});
  EXPECT_EQ(line_->node_state(5).state, nmt::State::unknown) << "no message from the node since";
  EXPECT_FALSE(valid());
  hear(0x705, {0x00});
  EXPECT_EQ(line_->node_state(5).state, nmt::State::pre_operational);
  hear(0x000, {0x01, 0x00});
  line_->advance(now_);
  EXPECT_THAT(pdos(), ElementsAre("205#0900000003"));
  EXPECT_TRUE(valid());
  EXPECT_FALSE(emitted(EventKind::foreign_manager)) << "the own node's master";
}

// The guard response may belong to the last request of the line, or to a request of the other
// master.
TEST_F(OutputsOfANode, AreNotValidByAGuardAnswerToAnotherMaster) {
  become_device_beside_a_guarded_node();
  hear_heartbeat(0x80 | kPreOperational);
  EXPECT_EQ(line_->node_state(5).state, nmt::State::pre_operational);
  EXPECT_FALSE(valid()) << "it left Operational without a command";
  hear_heartbeat(0x80 | kOperational);
  EXPECT_EQ(line_->node_state(5).state, nmt::State::pre_operational) << "ignored: same toggle bit";
  EXPECT_EQ(line_->state().counters.frames_unused, 1U);
  EXPECT_EQ(line_->state().counters.frames_malformed, 0U);
  hear_heartbeat(kOperational);
  EXPECT_EQ(line_->node_state(5).state, nmt::State::operational);
  EXPECT_THAT(pdos(), ElementsAre("205#0900000003"));
}

// Guard responses arrive only while the own node sends guarding requests, so the NMT command
// counts.
TEST_F(OutputsOfANode, AreSentToAGuardedNodeThatAnotherMasterStarts) {
  become_device_beside_a_guarded_node();
  hear_heartbeat(0x80 | kOperational);  // response to the last request
  hear(0x000, {0x80, 0x00});
  EXPECT_EQ(line_->node_state(5).state, nmt::State::pre_operational);
  EXPECT_FALSE(valid());
  hear(0x000, {0x01, 0x00});
  EXPECT_EQ(line_->node_state(5).state, nmt::State::operational);
  line_->advance(now_);
  EXPECT_THAT(pdos(), ElementsAre("205#0900000003"));
  EXPECT_TRUE(valid());
}

TEST_F(OutputsOfANode, AreSentAsTheWatchdogLeftThem) {
  make(config_with_axis());
  boot();
  pass(milliseconds(1));
  write(1, 2, 7, milliseconds(50), kZeroOutputs);
  pdos();
  hear_heartbeat(kPreOperational);
  pass(milliseconds(60));
  pdos();
  EXPECT_EQ(write(5, 5, 7), OutputRefusal::not_armed);
  hear_heartbeat(kOperational);
  EXPECT_THAT(pdos(), ElementsAre("205#0000000000"));
}

TEST_F(OutputsOfANode, AreNotWrittenByHandAfterTheWatchdogFired) {
  make(config_with_axis());
  boot();
  pass(milliseconds(1));
  write(1, 2, 7, milliseconds(50), kZeroOutputs);
  pass(milliseconds(60));
  pdos();
  events();
  const ReplyData group = std::vector{std::byte{0}, std::byte{0}};
  line_->execute({.request = SingleOutput{.entry = 1, .data = {std::byte{7}}}}, now_);
  Reply refused = answer();
  EXPECT_EQ(refused.error, to_error(Refusal::wrong_state));
  EXPECT_EQ(refused.data, group) << "the reply names the group";
  EXPECT_TRUE(emitted(EventKind::command_refused, 5));
  ObjectWrite object{.node = 5, .address = {0x2003, 0}, .data = {std::byte{7}}};
  line_->execute({.request = object}, now_);
  refused = answer();
  EXPECT_EQ(refused.error, to_error(Refusal::wrong_state));
  EXPECT_EQ(refused.data, group);
  hear_heartbeat(kOperational);
  EXPECT_THAT(pdos(), IsEmpty());
  EXPECT_EQ(snapshot(Direction::outputs).bytes.at(4), std::byte{0}) << "as the reaction left it";
  object.force_sdo = true;
  line_->execute({.request = object}, now_);
  EXPECT_THAT(sent(), ElementsAre("605#2F03200007000000")) << "not an output of the group";
  hear(0x585, {0x60, 0x03, 0x20, 0, 0, 0, 0, 0});
  EXPECT_EQ(answer().error, Error{});
  EXPECT_EQ(write(5, 5, 8), OutputRefusal::none);
  EXPECT_THAT(pdos(), ElementsAre("205#0500000005"));
  EXPECT_EQ(write_by_hand(1, {std::byte{7}}), Error{});
  EXPECT_THAT(pdos(), ElementsAre("205#0500000007"));
}

TEST_F(OutputsOfANode, ASingleWriteAnswersWhatItsPdoWaitsFor) {
  make(config_with_axis());
  boot();
  pass(milliseconds(1));
  const auto ask = [this](std::uint32_t entry, std::vector<std::byte> data) {
    line_->execute({.request = SingleOutput{.entry = entry, .data = std::move(data)}}, now_);
    return answer().data;
  };
  const auto bytes = [](std::initializer_list<unsigned char> values) {
    std::vector<std::byte> out;
    for (const unsigned char value : values) {
      out.push_back(std::byte{value});
    }
    return out;
  };
  EXPECT_EQ(ask(1, bytes({7})), (ReplyData{WrittenByPdo{1, PdoWait::values, {0}}}))
      << "waits for entry 0";
  EXPECT_THAT(pdos(), IsEmpty());
  EXPECT_EQ(ask(0, bytes({1, 0, 0, 0})), (ReplyData{WrittenByPdo{1, PdoWait::none}}));
  EXPECT_THAT(pdos(), ElementsAre("205#0100000007"));
}

TEST_F(OutputsOfANode, AWriteWithoutValuesIsAHandshake) {
  make(config_with_axis());
  boot();
  pass(milliseconds(1));
  write(1, 2, 1, milliseconds(50), kZeroOutputs);
  EXPECT_THAT(pdos(), ElementsAre("205#0100000002"));
  OutputWrite empty{.layout_id = line_->layout(Direction::outputs).id,
                    .arming = 1,
                    .watchdog = milliseconds(50),
                    .reactions = kZeroOutputs,
                    .values = {},
                    .bytes = {}};
  for (int i = 0; i < 4; ++i) {
    pass(milliseconds(40));
    EXPECT_EQ(line_->write_outputs(empty, now_), OutputRefusal::none);
    EXPECT_THAT(pdos(), IsEmpty());
  }
  pass(milliseconds(50));
  EXPECT_THAT(pdos(), ElementsAre("205#0000000000")) << "the watchdog expires without writes";
}

TEST_F(OutputsOfANode, SingleWritesAreRefusedWhileItIsNotOperational) {
  make(config_with_axis());
  boot();
  pass(milliseconds(1));
  write(1, 2);
  pdos();
  hear_heartbeat(kPreOperational);
  events();
  EXPECT_EQ(write_by_hand(1, {std::byte{7}}), to_error(Refusal::wrong_state));
  EXPECT_TRUE(emitted(EventKind::command_refused, 5)) << "the event names the node";
  line_->execute(
      {.request = ObjectWrite{.node = 5, .address = {0x2003, 0}, .data = {std::byte{7}}}}, now_);
  EXPECT_EQ(answer().error, to_error(Refusal::wrong_state));
  EXPECT_THAT(pdos(), IsEmpty());
  hear_heartbeat(kOperational);
  EXPECT_THAT(pdos(), ElementsAre("205#0100000002")) << "the refused value is not stored";
  EXPECT_EQ(write_by_hand(1, {std::byte{7}}), Error{});
  EXPECT_THAT(pdos(), ElementsAre("205#0100000007"));
}

}  // namespace
}  // namespace linegate::line

// SPDX-License-Identifier: Apache-2.0
// Data of devices by object (CANopenIA manual 5.1) and PDOs triggered by hand (IXXAT CANopen
// Manager API manual 6.1.6).
#include <algorithm>

#include "stack/base/abort_code.h"
#include "stack/base/byte_order.h"
#include "stack/od/dictionary.h"

#include "tests/stack/line/under_way_fixture.h"

namespace linegate::line {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

constexpr std::uint16_t kSetpoint = 0x2002;  // 32 bits, in RPDO 1 of node 5
constexpr std::uint16_t kMode = 0x2003;      // 8 bits, in the same RPDO
constexpr std::uint16_t kLimit = 0x2004;     // 8 bits, in RPDO 2 of config_with_shared_mode()

od::VariableDescription mapped_variable(std::uint8_t sub, od::DataType type, std::uint64_t value) {
  od::VariableDescription out{
      .sub = sub, .name = "Value", .type = type, .access = od::Access::rw, .mappable = true};
  out.value.resize(od::byte_size(type));
  store_le(std::span(out.value), value);
  return out;
}

od::ObjectDescription mapped_object(std::uint16_t index, od::ObjectType type,
                                    std::vector<od::VariableDescription> variables) {
  od::ObjectDescription out;
  out.index = index;
  out.name = "Object";
  out.type = type;
  out.variables = std::move(variables);
  return out;
}

// RPDO 2 has the mode, too: entry 2; entry 3 is the limit.
LineConfig config_with_shared_mode() {
  using enum od::DataType;
  LineConfig config = config_with_axis();
  std::vector<od::ObjectDescription>& objects = config.nodes[0].device.objects;
  objects.push_back(
      mapped_object(0x1401, od::ObjectType::record,
                    {mapped_variable(0, unsigned8, 2), mapped_variable(1, unsigned32, 0x305),
                     mapped_variable(2, unsigned8, 255)}));
  objects.push_back(
      mapped_object(0x1601, od::ObjectType::record,
                    {mapped_variable(0, unsigned8, 2), mapped_variable(1, unsigned32, 0x2003'0008),
                     mapped_variable(2, unsigned32, 0x2004'0008)}));
  objects.push_back(
      mapped_object(kLimit, od::ObjectType::variable, {mapped_variable(0, unsigned8, 0)}));
  std::ranges::sort(objects, {}, &od::ObjectDescription::index);
  return config;
}

class DataByObject : public LineTest {
 protected:
  void run(LineConfig config) {
    make(std::move(config));
    boot();
    pass(milliseconds(1));
    sent();
    events();
  }
  void run_with_update_time(Duration time) {
    LineConfig config = config_with_axis();
    config.pdo_update_time = time;
    run(std::move(config));
  }

  Reply ask(Command command) {
    line_->execute(std::move(command), now_);
    return answer();
  }
  static Command write(std::uint16_t index, std::vector<std::byte> data) {
    return {.request = ObjectWrite{.node = 5, .address = {index, 0}, .data = std::move(data)}};
  }
  static Command write_keeping_pdo(std::uint16_t index, std::vector<std::byte> data) {
    Command command = write(index, std::move(data));
    std::get<ObjectWrite>(command.request).keep_pdo = true;
    return command;
  }
  static std::vector<std::byte> setpoint(std::uint32_t value) {
    std::vector<std::byte> out(4);
    store_le(std::span(out), value);
    return out;
  }
  static std::vector<std::byte> mode(unsigned value) { return {static_cast<std::byte>(value)}; }
  static Command trigger(std::uint8_t node, std::uint16_t number) {
    return {.request = PdoTrigger{.node = node, .number = number}};
  }
  static Command trigger_byte(std::uint32_t offset) {
    return {.request = PdoTrigger{.output_byte = offset}};
  }
  std::vector<OutputWait> reasons() {
    OutputState state;
    line_->output_state(0, state);
    std::vector<OutputWait> out;
    for (const OutputState::Wait& wait : state.waits) {
      out.push_back(wait.reason);
    }
    return out;
  }
  // The result of a write by PDO 1 that waits for `wait`.
  static ReplyData by_pdo(PdoWait wait) { return WrittenByPdo{1, wait}; }
  std::vector<std::string> pdos() {
    std::vector<std::string> out = sent();
    std::erase_if(out, [](const std::string& frame) { return !frame.starts_with("205#"); });
    return out;
  }
  void leave_operational() {
    Command command{.request =
                        NmtRequest{.node = 127, .command = nmt::Command::enter_pre_operational}};
    ASSERT_TRUE(ask(command).ok());
  }
  void set_event_timer(std::uint16_t ms) { ASSERT_TRUE(line_->dictionary().set({0x1800, 5}, ms)); }
};

TEST_F(DataByObject, APdoIsSentOnlyWhenAllItsValuesWereWritten) {
  run(config_with_axis());
  const ReplyData waits = WrittenByPdo{1, PdoWait::values, {1}};
  EXPECT_EQ(ask(write(kSetpoint, setpoint(0x11223344))).data, waits) << "waits for entry 1";
  pass(milliseconds(200));
  EXPECT_THAT(pdos(), IsEmpty());
  EXPECT_EQ(ask(write(kMode, mode(7))).data, by_pdo(PdoWait::none));
  EXPECT_THAT(pdos(), ElementsAre("205#4433221107"));
  EXPECT_EQ(ask(write(kMode, mode(7))).data, by_pdo(PdoWait::none));
  EXPECT_THAT(pdos(), ElementsAre("205#4433221107")) << "an unchanged value is sent, too";
}

TEST_F(DataByObject, ADefaultIsAValue) {
  LineConfig config = config_with_axis();
  config.defaults.push_back({.entry = 1, .value = 3});
  run(std::move(config));
  EXPECT_EQ(ask(write(kSetpoint, setpoint(1))).data, by_pdo(PdoWait::none));
  EXPECT_THAT(pdos(), ElementsAre("205#0100000003"));
}

TEST_F(DataByObject, WhatNoPdoCarriesGoesBySdo) {
  run(config_with_axis());
  line_->execute(write(0x2F00, setpoint(5)), now_);
  EXPECT_THAT(sent(), ElementsAre("605#23002F0005000000"));
  hear(0x585, {0x60, 0x00, 0x2F, 0, 0, 0, 0, 0});
  EXPECT_EQ(answer().data, ReplyData{WrittenBySdo{}});
  line_->execute(write(0x2F00, setpoint(5)), now_);
  sent();
  hear(0x585, {0x80, 0x00, 0x2F, 0, 0x02, 0, 0x01, 0x06});
  const Reply refused = answer();
  EXPECT_EQ(refused.error, to_error(AbortCode::read_only));
  EXPECT_EQ(refused.data, ReplyData{});
}

TEST_F(DataByObject, SdoCanBeEnforced) {  // 5F01h
  run(config_with_axis());
  Command command = write(kMode, mode(7));
  std::get<ObjectWrite>(command.request).force_sdo = true;
  line_->execute(command, now_);
  EXPECT_THAT(sent(), ElementsAre("605#2F03200007000000"));
  hear(0x585, {0x60, 0x03, 0x20, 0, 0, 0, 0, 0});
  EXPECT_EQ(answer().data, ReplyData{WrittenBySdo{}});
  EXPECT_EQ(snapshot(Direction::outputs).valid.at(0), 0U) << "not valid in the image";
}

TEST_F(DataByObject, TheAnswerForTwoPdosIsThatOfTheOneThatWaits) {
  run(config_with_shared_mode());
  const auto frames = [this] {
    std::vector<std::string> out = sent();
    std::erase_if(out, [](const std::string& frame) {
      return !frame.starts_with("205#") && !frame.starts_with("305#");
    });
    return out;
  };
  ask(write(kSetpoint, setpoint(1)));
  EXPECT_EQ(ask(write(kMode, mode(7))).data, (ReplyData{WrittenByPdo{2, PdoWait::values, {3}}}))
      << "PDO 2 waits for the limit";
  EXPECT_THAT(frames(), ElementsAre("205#0100000007"));
  EXPECT_EQ(ask(write(kLimit, mode(9))).data, (ReplyData{WrittenByPdo{2, PdoWait::none}}));
  EXPECT_THAT(frames(), ElementsAre("305#0709"));
  EXPECT_EQ(ask(write(kMode, mode(8))).data, by_pdo(PdoWait::none));
  EXPECT_THAT(frames(), ElementsAre("205#0100000008", "305#0809"));
  EXPECT_EQ(ask(write_keeping_pdo(kMode, mode(9))).data, by_pdo(PdoWait::trigger));
}

TEST_F(DataByObject, TheUpdateTimeOfOneOfTwoPdosIsAnswered) {
  LineConfig config = config_with_shared_mode();
  config.pdo_update_time = milliseconds(20);
  run(std::move(config));
  ask(write(kSetpoint, setpoint(1)));
  ask(write(kLimit, mode(9)));
  pass(milliseconds(20));
  set_event_timer(100);
  EXPECT_EQ(ask(write(kMode, mode(8))).data, (ReplyData{WrittenByPdo{2, PdoWait::update_time}}))
      << "with an event timer PDO 1 has no update time";
}

TEST_F(DataByObject, TheUpdateTimeCollectsTheValuesOfAPdo) {  // 5F01h
  run_with_update_time(milliseconds(20));
  ask(write(kSetpoint, setpoint(1)));
  ask(write(kMode, mode(1)));
  EXPECT_THAT(pdos(), ElementsAre("205#0100000001")) << "sent at once: all values were written";
  EXPECT_EQ(ask(write(kSetpoint, setpoint(2))).data, by_pdo(PdoWait::update_time));
  pass(milliseconds(15));
  EXPECT_THAT(pdos(), IsEmpty());
  ask(write(kSetpoint, setpoint(3)));
  pass(milliseconds(19));
  EXPECT_THAT(pdos(), IsEmpty()) << "each write restarts the time";
  pass(milliseconds(1));
  EXPECT_THAT(pdos(), ElementsAre("205#0300000001"));
  pass(seconds(1));
  EXPECT_THAT(pdos(), IsEmpty());
}

TEST_F(DataByObject, WithAnEventTimerThereIsNoUpdateTime) {  // 5F01h
  run_with_update_time(milliseconds(20));
  set_event_timer(100);
  ask(write(kSetpoint, setpoint(1)));
  ask(write(kMode, mode(1)));
  pdos();
  EXPECT_EQ(ask(write(kMode, mode(2))).data, by_pdo(PdoWait::none));
  EXPECT_THAT(pdos(), ElementsAre("205#0100000002"));
  pass(milliseconds(100));
  EXPECT_THAT(pdos(), ElementsAre("205#0100000002")) << "cyclically, written or not";
}

TEST_F(DataByObject, TheInhibitTimeIsKept) {
  LineConfig config = config_with_axis();
  config.nodes[0].rpdo_inhibit[1] = milliseconds(50);
  run(std::move(config));
  ask(write(kSetpoint, setpoint(1)));
  ask(write(kMode, mode(1)));
  EXPECT_EQ(pdos().size(), 1U);
  ask(write(kMode, mode(2)));
  ask(write(kMode, mode(3)));
  pass(milliseconds(49));
  EXPECT_THAT(pdos(), IsEmpty());
  pass(milliseconds(1));
  EXPECT_THAT(pdos(), ElementsAre("205#0100000003"));
}

TEST_F(DataByObject, AKeptPdoIsSentWhenItIsTriggered) {  // 5F01h
  run(config_with_axis());
  EXPECT_EQ(ask(write_keeping_pdo(kSetpoint, setpoint(1))).data, by_pdo(PdoWait::trigger));
  EXPECT_EQ(ask(trigger(5, 1)).error, to_error(Refusal::wrong_state)) << "a value is missing";
  ask(write_keeping_pdo(kMode, mode(1)));
  EXPECT_THAT(pdos(), IsEmpty());
  const ReplyData first = TriggeredPdos{1};
  EXPECT_EQ(ask(trigger(5, 1)).data, first) << "by node and number of its RPDO";
  EXPECT_THAT(pdos(), ElementsAre("205#0100000001"));
  EXPECT_EQ(ask(trigger(0, 1)).data, first) << "by the number of the own TPDO";
  EXPECT_THAT(pdos(), ElementsAre("205#0100000001"));
  EXPECT_EQ(ask(trigger_byte(4)).data, first) << "by a byte of the image";
  EXPECT_THAT(pdos(), ElementsAre("205#0100000001"));
}

TEST_F(DataByObject, AKeptValueWaitsForATrigger) {
  run(config_with_axis());
  ask(write(kSetpoint, setpoint(1)));
  ask(write_keeping_pdo(kMode, mode(1)));
  EXPECT_THAT(reasons(), ElementsAre(OutputWait::trigger, OutputWait::trigger));
  ask(trigger(5, 1));
  pdos();
  EXPECT_THAT(reasons(), IsEmpty());
  ask(write_keeping_pdo(kMode, mode(2)));
  EXPECT_THAT(reasons(), ElementsAre(OutputWait::trigger)) << "of the value that was written";
  ask(write(kSetpoint, setpoint(2)));
  EXPECT_THAT(pdos(), ElementsAre("205#0200000002"));
  EXPECT_THAT(reasons(), IsEmpty());
}

TEST_F(DataByObject, AKeptValueOfARequestedPdoWaitsForATrigger) {
  run(config_with_axis());
  ask(write(kSetpoint, setpoint(1)));
  ask(write(kMode, mode(1)));
  ask(write_keeping_pdo(kMode, mode(2)));
  EXPECT_THAT(reasons(), ElementsAre(OutputWait::turn, OutputWait::trigger));
  EXPECT_THAT(pdos(), ElementsAre("205#0100000001"));
  EXPECT_THAT(reasons(), ElementsAre(OutputWait::trigger));
}

TEST_F(DataByObject, ACollectedValueWaitsForTheUpdateTime) {
  run_with_update_time(milliseconds(20));
  ask(write(kSetpoint, setpoint(1)));
  ask(write(kMode, mode(1)));
  pdos();
  ask(write(kMode, mode(2)));
  EXPECT_THAT(reasons(), ElementsAre(OutputWait::update_time));
}

TEST_F(DataByObject, WhatIsNotThereCannotBeTriggered) {
  run(config_with_axis());
  EXPECT_EQ(ask(trigger(5, 2)).error, to_error(Refusal::unknown_entry));
  EXPECT_EQ(ask(trigger(6, 1)).error, to_error(Refusal::unknown_entry));
  EXPECT_EQ(ask(trigger(0, 2)).error, to_error(Refusal::unknown_entry));
  EXPECT_EQ(ask(trigger_byte(5)).error, to_error(Refusal::unknown_entry)) << "beyond the image";
  leave_operational();
  EXPECT_EQ(ask(trigger(0, 2)).error, to_error(Refusal::wrong_state)) << "not Operational";
}

TEST_F(DataByObject, ATriggerTakesTheUpdateTimeAway) {
  run_with_update_time(milliseconds(20));
  ask(write(kSetpoint, setpoint(1)));
  ask(write(kMode, mode(1)));
  pdos();
  ask(write(kMode, mode(2)));
  ask(trigger(5, 1));
  EXPECT_THAT(pdos(), ElementsAre("205#0100000002"));
  pass(seconds(1));
  EXPECT_THAT(pdos(), IsEmpty());
}

TEST_F(DataByObject, BeforeOperationalTheValueWaits) {
  run(config_with_axis());
  ask(write(kSetpoint, setpoint(1)));
  ask(write(kMode, mode(1)));
  pdos();
  leave_operational();
  EXPECT_EQ(ask(write(kMode, mode(2))).data, by_pdo(PdoWait::operational));
  EXPECT_EQ(ask(trigger(5, 1)).error, to_error(Refusal::wrong_state));
  EXPECT_THAT(pdos(), IsEmpty());
}

TEST_F(DataByObject, WhatDoesNotFitIsRefused) {
  run(config_with_axis());
  EXPECT_EQ(ask(write(kMode, setpoint(1))).error, to_error(Refusal::bad_request)) << "4 bytes";
  Command nobody = write(kMode, mode(1));
  std::get<ObjectWrite>(nobody.request).node = 0;
  EXPECT_EQ(ask(nobody).error, to_error(Refusal::bad_request));
  LineConfig config = config_with_axis();
  config.bound = {1};
  run(std::move(config));
  EXPECT_EQ(ask(write(kMode, mode(1))).error, to_error(Refusal::bound_entry))
      << "the entry follows an input";
  EXPECT_THAT(pdos(), IsEmpty());
}

TEST_F(DataByObject, TheOwnNodeIsWrittenWithoutABus) {
  run(config_with_axis());
  Command command = write(0x1005, setpoint(0x80));
  std::get<ObjectWrite>(command.request).node = 127;
  const Reply reply = ask(command);
  EXPECT_TRUE(reply.ok());
  EXPECT_EQ(reply.data, ReplyData{});
}

TEST_F(DataByObject, AReadMayBeAnsweredFromTheImage) {
  run(config_with_axis());
  const Command read{.request = SdoRead{.node = 5, .address = {0x2000, 0}, .from_image = true}};
  line_->execute(read, now_);
  EXPECT_THAT(sent(), ElementsAre("605#4000200000000000")) << "the PDO was not received yet";
  hear(0x585, {0x4B, 0x00, 0x20, 0, 0x01, 0, 0, 0});
  EXPECT_EQ(answer().bytes().size(), 2U);
  hear(0x185, {0x34, 0x12, 0, 0, 0, 0});
  EXPECT_EQ(ask(read).bytes(), (std::vector<std::byte>{std::byte{0x34}, std::byte{0x12}}));
  EXPECT_THAT(sent(), IsEmpty());
  Command fresh = read;
  std::get<SdoRead>(fresh.request).from_image = false;
  line_->execute(fresh, now_);
  EXPECT_EQ(sent().size(), 1U) << "without kFromImage it is read by SDO";
}

TEST_F(DataByObject, ADeviceOfTheLineTriggersItsOwnPdo) {
  LineConfig config;
  config.name = "cell";
  config.role = Role::device;
  config.devices.push_back({9, "one", *eds::load(kDeviceFile, "axis.eds", 9).value});
  make(std::move(config));
  line_->start(now_);
  EXPECT_EQ(ask(trigger(9, 1)).error, to_error(Refusal::wrong_state));
  hear(0x000, {1, 9});
  sent();
  EXPECT_EQ(ask(trigger(9, 1)).error, Error{});
  EXPECT_EQ(sent().size(), 1U);
  EXPECT_EQ(ask(trigger(9, 2)).error, to_error(Refusal::unknown_entry));
  EXPECT_EQ(ask(trigger(8, 1)).error, to_error(Refusal::bad_request));
  EXPECT_EQ(ask(write(kMode, mode(1))).error, to_error(Refusal::wrong_role));
}

// The mode is in two PDOs, and the bus reports which frames it acknowledged.
class ObjectOfTwoPdos : public AcknowledgedOutputs {
 protected:
  // All values were written and acknowledged.
  void run(LineConfig config) {
    AcknowledgedOutputs::run(std::move(config));
    for (const std::uint16_t index : {kMode, kLimit}) {
      write_object(index, {std::byte{1}});
    }
    write_object(kSetpoint, std::vector<std::byte>(4));
    hand_out();
    acknowledge_all();
    while (is_answered()) {
    }
  }
  void write_object(std::uint16_t index, std::vector<std::byte> data) {
    line_->execute(
        {.request = ObjectWrite{.node = 5, .address = {index, 0}, .data = std::move(data)}}, now_);
  }
};

TEST_F(ObjectOfTwoPdos, IsSentWhenBothFramesAreAcknowledged) {
  run(config_with_shared_mode());
  write_object(kMode, {std::byte{7}});
  EXPECT_THAT(hand_out(), ElementsAre("205#0000000007", "305#0701"));
  line_->acknowledged(given_ - 1, now_);
  EXPECT_FALSE(is_answered()) << "PDO 1 alone";
  line_->acknowledged(given_, now_);
  EXPECT_EQ(answer().data, (ReplyData{WrittenByPdo{1, PdoWait::none}}));
}

TEST_F(ObjectOfTwoPdos, NamesThePdoThatIsNotAcknowledged) {
  run(config_with_shared_mode());
  write_object(kMode, {std::byte{7}});
  hand_out();
  line_->acknowledged(given_ - 1, now_);
  live(kSendTime);
  EXPECT_EQ(answer().data, (ReplyData{WrittenByPdo{2, PdoWait::bus}}));
}

TEST_F(ObjectOfTwoPdos, NamesThePdoWhoseInhibitTimeRuns) {
  LineConfig config = config_with_shared_mode();
  config.nodes[0].rpdo_inhibit[2] = seconds(5);
  run(std::move(config));
  write_object(kMode, {std::byte{7}});
  EXPECT_THAT(hand_out(), ElementsAre("205#0000000007"));
  acknowledge_all();
  EXPECT_FALSE(is_answered());
  live(kSendTime);
  EXPECT_EQ(answer().data, (ReplyData{WrittenByPdo{2, PdoWait::turn}}));
}

}  // namespace
}  // namespace linegate::line

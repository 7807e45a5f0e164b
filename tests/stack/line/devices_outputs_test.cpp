// SPDX-License-Identifier: Apache-2.0
// A line in the role device: when the outputs of its devices are valid, and what they wait for.
#include <algorithm>
#include <cstdint>
#include <initializer_list>
#include <string>
#include <utility>
#include <vector>

#include "stack/base/byte_order.h"
#include "stack/eds/reader.h"

#include "tests/stack/line/under_way_fixture.h"

namespace linegate::line {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

using Waits = std::vector<OutputState::Wait>;

// The outputs of the devices 5 and 6: Status and Position, which TPDO 1 carries.
enum Entry : std::uint32_t { kStatus5, kPosition5, kStatus6, kPosition6 };

od::VariableDescription& variable(DeviceConfig& device, std::uint16_t index, std::uint8_t sub) {
  auto& objects = device.device.objects;
  auto& object = *std::ranges::find(objects, index, &od::ObjectDescription::index);
  return *std::ranges::find(object.variables, sub, &od::VariableDescription::sub);
}

class OutputsOfDevices : public AcknowledgedLine {
 protected:
  static LineConfig two_devices() {
    LineConfig config = config_of_devices();
    for (const std::uint8_t id : {std::uint8_t{5}, std::uint8_t{6}}) {
      config.devices.push_back({.id = id,
                                .name = "axis" + std::to_string(id),
                                .device = *eds::load(kDeviceFile, "axis.eds", id).value});
    }
    return config;
  }
  void start(LineConfig config = two_devices()) {
    make(std::move(config));
    line_->expect_acknowledgements();
    line_->start(now_);
    settle();
  }
  void run(LineConfig config = two_devices()) {
    start(std::move(config));
    command(0x01);
    settle();
  }
  // An NMT command of the master.
  void command(std::uint8_t specifier, std::uint8_t node = 0) {
    hear(0x000, {specifier, node});
    line_->advance(now_);
  }
  void settle() {
    hand_out();
    acknowledge_all();
  }
  void write(std::uint32_t entry, std::uint8_t value) {
    OutputWrite write{.layout_id = line_->layout(Direction::outputs).id, .arming = 1};
    const std::uint16_t bits = line_->layout(Direction::outputs).entries[entry].bit_length;
    write.values.push_back({.entry = entry, .length = static_cast<std::uint8_t>(bits / 8)});
    write.values.back().data[0] = std::byte{value};
    EXPECT_EQ(line_->write_outputs(write, now_), OutputRefusal::none);
  }
  // An expedited SDO download of the master.
  void download(std::uint16_t index, std::uint8_t sub, std::uint32_t value, unsigned bytes) {
    const auto octet = [](std::uint32_t number, unsigned shift) {
      return static_cast<std::uint8_t>(number >> shift);
    };
    hear(0x605,
         {static_cast<std::uint8_t>(0x23 | (4 - bytes) << 2U), octet(index, 0), octet(index, 8),
          sub, octet(value, 0), octet(value, 8), octet(value, 16), octet(value, 24)});
    line_->advance(now_);
  }
  bool valid(std::uint32_t entry) { return snapshot(Direction::outputs).is_valid(entry); }
  Waits waits() {
    OutputState state;
    line_->output_state(0, state);
    EXPECT_EQ(state.waiting, state.waits.size());
    return state.waits;
  }
  // The reason of the only entry that was written.
  OutputWait reason() {
    Waits all = waits();
    std::erase_if(all, [](const auto& wait) { return wait.reason == OutputWait::value; });
    EXPECT_EQ(all.size(), 1U);
    return all.empty() ? OutputWait::value : all.front().reason;
  }
};

TEST_F(OutputsOfDevices, AreValidWhenTheBusAcknowledgedTheirValue) {
  run();
  EXPECT_FALSE(valid(kStatus5)) << "it was never written";
  write(kStatus5, 4);
  EXPECT_FALSE(valid(kStatus5));
  EXPECT_EQ(reason(), OutputWait::turn);
  EXPECT_THAT(hand_out(), ElementsAre("185#040000000000"));
  EXPECT_FALSE(valid(kStatus5)) << "only the controller has the frame";
  acknowledge_all();
  EXPECT_TRUE(valid(kStatus5));
  EXPECT_THAT(waits(), ElementsAre(OutputState::Wait{kPosition5, OutputWait::value},
                                   OutputState::Wait{kStatus6, OutputWait::value},
                                   OutputState::Wait{kPosition6, OutputWait::value}));
}

TEST_F(OutputsOfDevices, AreValidWhenTheyAreHandedToABusThatReportsNothing) {
  make(two_devices());
  line_->start(now_);
  command(0x01);
  sent();
  write(kStatus5, 4);
  EXPECT_FALSE(valid(kStatus5));
  sent();
  EXPECT_TRUE(valid(kStatus5));
}

TEST_F(OutputsOfDevices, AreValidWithTheirNewestValueOnly) {
  run();
  write(kStatus5, 4);
  hand_out();
  write(kStatus5, 7);
  acknowledge_all();
  EXPECT_FALSE(valid(kStatus5));
  EXPECT_THAT(hand_out(), ElementsAre("185#070000000000"));
  write(kPosition5, 1);
  acknowledge_all();
  EXPECT_TRUE(valid(kStatus5)) << "it did not change since";
  EXPECT_FALSE(valid(kPosition5));
  settle();
  EXPECT_TRUE(valid(kPosition5));
}

// The frame of value 4 is not that of the second value 4: value 7 may be between them.
TEST_F(OutputsOfDevices, AValueThatReturnsWaitsForItsFrame) {
  run();
  write(kStatus5, 4);
  settle();
  write(kStatus5, 7);
  hand_out();
  write(kStatus5, 4);
  EXPECT_FALSE(valid(kStatus5));
  acknowledge_all();
  EXPECT_FALSE(valid(kStatus5)) << "the master has value 7";
  EXPECT_THAT(hand_out(), ElementsAre("185#040000000000"));
  acknowledge_all();
  EXPECT_TRUE(valid(kStatus5));
}

TEST_F(OutputsOfDevices, AValueThatTheTpdoHadAlreadyIsValidAtOnce) {
  run();
  write(kStatus5, 0);
  EXPECT_THAT(hand_out(), IsEmpty());
  EXPECT_TRUE(valid(kStatus5)) << "the first TPDO had it";
  write(kStatus5, 0);
  EXPECT_TRUE(valid(kStatus5));
}

TEST_F(OutputsOfDevices, WaitForTheirDeviceUntilItIsOperational) {
  start();
  write(kStatus5, 4);
  EXPECT_FALSE(valid(kStatus5));
  EXPECT_EQ(reason(), OutputWait::own_node);
  command(0x01, 6);
  settle();
  EXPECT_EQ(reason(), OutputWait::own_node) << "the other device is Operational";
  command(0x01, 5);
  EXPECT_EQ(reason(), OutputWait::turn);
  settle();
  EXPECT_TRUE(valid(kStatus5));
}

TEST_F(OutputsOfDevices, AreNotValidWhenTheirDeviceLeavesOperational) {
  run();
  write(kStatus5, 4);
  write(kStatus6, 6);
  settle();
  for (const std::uint8_t left :
       {std::uint8_t{0x02}, std::uint8_t{0x80}, std::uint8_t{0x81}, std::uint8_t{0x82}}) {
    ASSERT_TRUE(valid(kStatus5));
    command(left, 5);
    settle();
    EXPECT_FALSE(valid(kStatus5)) << int{left};
    EXPECT_EQ(reason(), OutputWait::own_node);
    EXPECT_TRUE(valid(kStatus6));
    EXPECT_TRUE(snapshot(Direction::outputs).is_known(kStatus5));
    command(0x01, 5);
    EXPECT_THAT(hand_out(), ElementsAre("185#040000000000")) << "the value is kept";
    EXPECT_FALSE(valid(kStatus5));
    acknowledge_all();
  }
}

TEST_F(OutputsOfDevices, AFrameFromBeforeAResetDoesNotCount) {
  run();
  write(kStatus5, 4);
  hand_out();
  command(0x82, 5);
  command(0x01, 5);
  acknowledge_all();
  EXPECT_FALSE(valid(kStatus5));
  settle();
  EXPECT_TRUE(valid(kStatus5));
}

TEST_F(OutputsOfDevices, AFrameThatIsLostIsSentAgain) {
  run();
  write(kStatus5, 4);
  hand_out();
  line_->lost(given_, given_);
  line_->acknowledged(given_, now_);
  EXPECT_FALSE(valid(kStatus5));
  EXPECT_THAT(hand_out(), ElementsAre("185#040000000000"));
  acknowledge_all();
  EXPECT_TRUE(valid(kStatus5));
}

TEST_F(OutputsOfDevices, WaitForABusWithoutAcknowledge) {
  run();
  write(kStatus5, 4);
  hand_out();
  EXPECT_EQ(reason(), OutputWait::turn);
  pass(milliseconds(200));
  EXPECT_EQ(reason(), OutputWait::bus);
}

TEST_F(OutputsOfDevices, AreNotValidWithoutABusAndAreSentAgainWhenItIsBack) {
  run();
  write(kStatus5, 4);
  settle();
  line_->bus_event({.kind = can::BusEvent::Kind::interface_failed, .code = 100, .time = now_});
  EXPECT_FALSE(valid(kStatus5));
  EXPECT_EQ(reason(), OutputWait::bus);
  line_->bus_event({.kind = can::BusEvent::Kind::interface_ready, .time = now_});
  line_->advance(now_);
  EXPECT_FALSE(valid(kStatus5));
  EXPECT_THAT(hand_out(), ElementsAre("185#040000000000", "186#000000000000"));
  acknowledge_all();
  EXPECT_TRUE(valid(kStatus5));
}

TEST_F(OutputsOfDevices, AreNotValidWhenTheLineIsStopped) {
  run();
  write(kStatus5, 4);
  settle();
  line_->stop(now_);
  EXPECT_FALSE(valid(kStatus5));
}

TEST_F(OutputsOfDevices, WaitForSync) {
  LineConfig config = two_devices();
  variable(config.devices[0], 0x1800, 2).value = {std::byte{0}};
  auto& objects = config.devices[0].device.objects;
  objects.push_back({.index = 0x1005, .name = "COB-ID SYNC"});
  objects.back().variables.push_back({.type = od::DataType::unsigned32,
                                      .access = od::Access::rw,
                                      .value = {std::byte{0x80}, {}, {}, {}}});
  std::ranges::sort(objects, {}, &od::ObjectDescription::index);
  run(std::move(config));
  write(kStatus5, 4);
  EXPECT_THAT(hand_out(), IsEmpty());
  EXPECT_EQ(reason(), OutputWait::turn);
  hear(0x080, {});
  EXPECT_FALSE(valid(kStatus5));
  settle();
  EXPECT_TRUE(valid(kStatus5));
}

TEST_F(OutputsOfDevices, DefaultsAreValidAfterTheirFrame) {
  LineConfig config = two_devices();
  config.defaults = {{.entry = kStatus6, .value = 9}};
  start(std::move(config));
  EXPECT_FALSE(valid(kStatus6));
  command(0x01);
  settle();
  EXPECT_TRUE(valid(kStatus6));
}

TEST_F(OutputsOfDevices, AreZeroAndSentByTheirWatchdog) {
  run();
  OutputWrite write{.layout_id = line_->layout(Direction::outputs).id, .arming = 1};
  write.watchdog = milliseconds(100);
  write.reactions = kZeroOutputs;
  write.values.push_back({.entry = kStatus5, .length = 2});
  write.values.back().data[0] = std::byte{4};
  EXPECT_EQ(line_->write_outputs(write, now_), OutputRefusal::none);
  settle();
  pass(milliseconds(150));
  EXPECT_FALSE(valid(kStatus5));
  EXPECT_THAT(hand_out(), ElementsAre("185#000000000000"));
  acknowledge_all();
  EXPECT_TRUE(valid(kStatus5));
}

// A write by SDO is no event of the TPDO.
TEST_F(OutputsOfDevices, AValueOfTheMasterWaitsForATrigger) {
  LineConfig config = two_devices();
  variable(config.devices[0], 0x2000, 0).access = od::Access::rw;
  run(std::move(config));
  download(0x2000, 0, 5, 2);
  settle();
  EXPECT_FALSE(valid(kStatus5));
  EXPECT_EQ(reason(), OutputWait::trigger);
  line_->execute({.request = PdoTrigger{.node = 5, .number = 1}}, now_);
  EXPECT_THAT(hand_out(), ElementsAre("185#050000000000"));
  acknowledge_all();
  EXPECT_TRUE(valid(kStatus5));
}

// The last sample of the TPDO has value 4, so that its return is no change for the TPDO.
TEST_F(OutputsOfDevices, AValueThatReplacesTheOneOfTheMasterIsSent) {
  LineConfig config = two_devices();
  variable(config.devices[0], 0x2000, 0).access = od::Access::rw;
  run(std::move(config));
  write(kStatus5, 4);
  settle();
  download(0x2000, 0, 5, 2);
  settle();
  write(kStatus5, 4);
  EXPECT_THAT(hand_out(), ElementsAre("185#040000000000"));
  write(kStatus5, 4);
  EXPECT_THAT(hand_out(), IsEmpty()) << "its frame is under way";
  acknowledge_all();
  EXPECT_TRUE(valid(kStatus5));
  download(0x2000, 0, 6, 2);
  settle();
  EXPECT_EQ(reason(), OutputWait::trigger);
  write(kStatus5, 6);
  EXPECT_THAT(hand_out(), ElementsAre("185#060000000000")) << "a write is a trigger";
  acknowledge_all();
  EXPECT_TRUE(valid(kStatus5));
}

TEST_F(OutputsOfDevices, ThatNoTpdoCarriesAreNotValidWithoutABus) {
  run();
  write(kStatus5, 4);
  settle();
  download(0x1800, 1, 0x8000'0185, 4);
  settle();
  EXPECT_TRUE(valid(kStatus5));
  line_->bus_event({.kind = can::BusEvent::Kind::interface_failed, .code = 100, .time = now_});
  write(kStatus5, 5);
  EXPECT_FALSE(valid(kStatus5));
  EXPECT_EQ(reason(), OutputWait::bus);
  line_->bus_event({.kind = can::BusEvent::Kind::interface_ready, .time = now_});
  EXPECT_TRUE(valid(kStatus5));
}

// TPDO 2 of device 5 sends Status by MPDO in source address mode.
class ScannedOutputsOfDevices : public OutputsOfDevices {
 protected:
  static LineConfig with_mpdo() {
    LineConfig config = two_devices();
    auto& objects = config.devices[0].device.objects;
    variable(config.devices[0], 0x1A00, 0).value = {std::byte{1}};
    variable(config.devices[0], 0x1A00, 1).value = {
        std::byte{0x20}, {}, std::byte{1}, std::byte{0x20}};
    const auto add = [&objects](std::uint16_t index, std::vector<std::uint32_t> values) {
      objects.push_back({.index = index, .name = "Object", .type = od::ObjectType::record});
      for (std::uint8_t sub = 0; sub < values.size(); ++sub) {
        od::VariableDescription value{.sub = sub, .name = "Sub", .access = od::Access::rw};
        const bool is_byte = sub == 0 || (index == 0x1801 && sub == 2);
        value.type = is_byte ? od::DataType::unsigned8 : od::DataType::unsigned32;
        value.value.resize(od::byte_size(value.type));
        store_le(std::span(value.value), values[sub]);
        objects.back().variables.push_back(std::move(value));
      }
    };
    add(0x1801, {2, 0x285, 254});
    add(0x1A01, {0xFE});
    add(0x1FA0, {1, 0x01'2000'00});
    std::ranges::sort(objects, {}, &od::ObjectDescription::index);
    return config;
  }
  std::uint32_t status() {
    const std::vector<image::Entry>& entries = line_->layout(Direction::outputs).entries;
    const auto found = std::ranges::find_if(
        entries, [](const image::Entry& each) { return each.node == 5 && each.index == 0x2000; });
    return static_cast<std::uint32_t>(found - entries.begin());
  }
  void write_by_hand(std::uint8_t value) {
    line_->execute(
        {.request = SingleOutput{.entry = status(), .data = {std::byte{value}, std::byte{}}}},
        now_);
  }
};

TEST_F(ScannedOutputsOfDevices, AreValidWhenTheBusAcknowledgedTheirMpdo) {
  run(with_mpdo());
  write(status(), 4);
  EXPECT_FALSE(valid(status()));
  EXPECT_EQ(reason(), OutputWait::turn);
  EXPECT_THAT(hand_out(), ElementsAre("285#0500200004000000"));
  EXPECT_FALSE(valid(status()));
  pass(milliseconds(200));
  EXPECT_EQ(reason(), OutputWait::bus);
  line_->lost(given_, given_);
  EXPECT_THAT(hand_out(), ElementsAre("285#0500200004000000"));
  acknowledge_all();
  EXPECT_TRUE(valid(status()));
  command(0x80, 5);
  EXPECT_FALSE(valid(status()));
  EXPECT_EQ(reason(), OutputWait::own_node);
  command(0x01, 5);
  EXPECT_FALSE(valid(status()));
  EXPECT_THAT(hand_out(), testing::Contains("285#0500200004000000")) << "it is sent again";
  acknowledge_all();
  EXPECT_TRUE(valid(status()));
}

TEST_F(ScannedOutputsOfDevices, AreSentAgainWhenTheBusIsBack) {
  run(with_mpdo());
  write(status(), 4);
  settle();
  ASSERT_TRUE(valid(status()));
  line_->bus_event({.kind = can::BusEvent::Kind::interface_failed, .code = 100, .time = now_});
  EXPECT_FALSE(valid(status()));
  line_->bus_event({.kind = can::BusEvent::Kind::interface_ready, .time = now_});
  EXPECT_FALSE(valid(status()));
  EXPECT_THAT(hand_out(), testing::Contains("285#0500200004000000"));
  acknowledge_all();
  EXPECT_TRUE(valid(status()));
}

TEST_F(ScannedOutputsOfDevices, ASingleWriteIsAnsweredWhenItsMpdoIsAcknowledged) {
  start(with_mpdo());
  write_by_hand(3);
  EXPECT_EQ(answer().data, (ReplyData{WrittenByPdo{2, PdoWait::operational}}));
  command(0x01);
  settle();
  write_by_hand(4);
  EXPECT_FALSE(is_answered());
  EXPECT_THAT(hand_out(), ElementsAre("285#0500200004000000"));
  EXPECT_FALSE(is_answered());
  acknowledge_all();
  EXPECT_EQ(answer().data, (ReplyData{WrittenByPdo{2, PdoWait::none}}));
  write_by_hand(5);
  hand_out();
  pass(kSendTime);
  EXPECT_EQ(answer().data, (ReplyData{WrittenByPdo{2, PdoWait::bus}}));
}

TEST_F(ScannedOutputsOfDevices, AValueThatReturnsReplacesTheMpdoThatWaits) {
  run(with_mpdo());
  write(status(), 4);
  ASSERT_THAT(hand_out(), ElementsAre("285#0500200004000000"));
  write(status(), 5);
  write(status(), 4);
  EXPECT_THAT(hand_out(), ElementsAre("285#0500200004000000"));
  acknowledge_all();
  EXPECT_TRUE(valid(status()));
}

TEST_F(ScannedOutputsOfDevices, ASingleWriteWhoseMpdoIsLostIsAnsweredByItsRepetition) {
  run(with_mpdo());
  write_by_hand(4);
  ASSERT_THAT(hand_out(), ElementsAre("285#0500200004000000"));
  line_->lost(given_, given_);
  EXPECT_FALSE(is_answered());
  settle();
  EXPECT_EQ(answer().data, (ReplyData{WrittenByPdo{2, PdoWait::none}}));
}

TEST_F(ScannedOutputsOfDevices, AreSentWhenTheirTpdoIsSwitchedOnWithAnotherCobId) {
  run(with_mpdo());
  write(status(), 4);
  settle();
  download(0x1801, 1, 0x8000'0285, 4);
  EXPECT_TRUE(valid(status())) << "no PDO carries it: the master reads it by SDO";
  write(status(), 5);
  download(0x1801, 1, 0x0000'0286, 4);
  EXPECT_FALSE(valid(status()));
  EXPECT_THAT(hand_out(), testing::Contains("286#0500200005000000"));
  acknowledge_all();
  EXPECT_TRUE(valid(status()));
}

TEST_F(OutputsOfDevices, FollowTheMappingOfTheMaster) {
  run();
  write(kStatus5, 4);
  write(kPosition5, 6);
  settle();
  EXPECT_TRUE(valid(kStatus5));
  download(0x1800, 1, 0x8000'0185, 4);
  EXPECT_TRUE(valid(kStatus5)) << "no TPDO carries it: the master reads it by SDO";
  download(0x1A00, 0, 0, 1);
  download(0x1A00, 1, 0x2001'0020, 4);
  download(0x1A00, 0, 1, 1);
  download(0x1800, 1, 0x0000'0185, 4);
  EXPECT_FALSE(valid(kPosition5));
  hand_out();
  EXPECT_FALSE(valid(kPosition5));
  acknowledge_all();
  EXPECT_TRUE(valid(kPosition5));
  write(kStatus5, 8);
  EXPECT_TRUE(valid(kStatus5));
  write(kPosition5, 8);
  EXPECT_FALSE(valid(kPosition5));
}

TEST_F(OutputsOfDevices, TheMappingOfAnotherDeviceLeavesThemValid) {
  run();
  write(kStatus6, 4);
  settle();
  download(0x1800, 1, 0x8000'0185, 4);
  EXPECT_TRUE(valid(kStatus6));
}

TEST_F(OutputsOfDevices, WithoutANodeIdWaitForTheirDevice) {
  LineConfig config = two_devices();
  config.devices[0].lss = true;
  start(std::move(config));
  write(kStatus5, 4);
  EXPECT_FALSE(valid(kStatus5));
  EXPECT_EQ(reason(), OutputWait::own_node);
  line_->execute({.request = SingleOutput{.entry = kStatus5, .data = {std::byte{5}, std::byte{}}}},
                 now_);
  const WrittenByPdo waits{1, PdoWait::operational};
  EXPECT_EQ(answer().data, ReplyData(waits));
}

}  // namespace
}  // namespace linegate::line

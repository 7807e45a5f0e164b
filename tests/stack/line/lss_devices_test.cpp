// SPDX-License-Identifier: Apache-2.0
// An own device of the line that is an LSS slave: it gets its node-ID over the bus.
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "stack/storage/medium.h"

#include "tests/stack/line/device_file.h"
#include "tests/stack/line/line_fixture.h"

namespace linegate::line {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

class LssDeviceTest : public LineTest {
 protected:
  void start() {
    LineConfig config = config_of_devices();
    config.bit_rate = 250'000;
    config.devices.push_back({.id = 5,
                              .name = "axis",
                              .device = *eds::load(kDeviceFile, "axis.eds", 5).value,
                              .lss = true});
    make(std::move(config));
    if (keeps) {
      line_->set_medium(&medium, {.device = 5, .kind = ParameterSet::Kind::lss});
    }
    line_->start(now_);
  }
  // The response of the device to an LSS message.
  std::vector<std::string> lss(std::initializer_list<std::uint8_t> data) {
    hear(0x7E5, data);
    pass(Duration{});
    return sent();
  }
  void configuration() { lss({0x04, 1, 0, 0, 0, 0, 0, 0}); }
  std::vector<std::string> waiting() { return lss({0x04, 0, 0, 0, 0, 0, 0, 0}); }
  void give(std::uint8_t node) {
    configuration();
    EXPECT_THAT(lss({0x11, node, 0, 0, 0, 0, 0, 0}), ElementsAre("7E4#1100000000000000"));
  }

  storage::MemoryMedium medium;
  bool keeps = true;
};

TEST_F(LssDeviceTest, SaysAndHearsNothingWithoutANodeId) {
  start();
  EXPECT_THAT(sent(), IsEmpty());
  hear(0x000, {0x01, 0x00});
  hear(0x605, {0x40, 0x00, 0x10, 0x00, 0, 0, 0, 0});
  EXPECT_THAT(sent(), IsEmpty());
  EXPECT_EQ(line_->node_state(5).state, nmt::State::initialising);
  EXPECT_EQ(line_->node_state(5).presence, Presence::missing);
  EXPECT_THAT(lss({0x4C, 0, 0, 0, 0, 0, 0, 0}), ElementsAre("7E4#5000000000000000"));
}

TEST_F(LssDeviceTest, BootsWithTheNodeIdItIsGivenWhateverItIsCalledByHere) {
  start();
  give(9);
  EXPECT_THAT(waiting(), ElementsAre("709#00"));
  EXPECT_EQ(line_->node_state(5).presence, Presence::present);
  hear(0x609, {0x40, 0x00, 0x18, 0x01, 0, 0, 0, 0});
  pass(Duration{});
  EXPECT_THAT(sent(), ElementsAre("589#4300180189010000")) << "COB-IDs follow the node-ID";
  hear(0x605, {0x40, 0x00, 0x10, 0x00, 0, 0, 0, 0});
  EXPECT_THAT(sent(), IsEmpty());
}

TEST_F(LssDeviceTest, EventsNameTheDeviceAndTheNodeIdOnTheBus) {
  start();
  EXPECT_EQ(line_->own_device(5)->node_id, 0);
  EXPECT_EQ(line_->own_device(5)->indicators, node::Indicators{});
  events();
  give(9);
  waiting();
  EXPECT_EQ(line_->own_device(5)->node_id, 9);
  std::vector<Event> states = events();
  std::erase_if(states, [](const Event& e) { return e.kind() != EventKind::own_state; });
  ASSERT_FALSE(states.empty());
  EXPECT_EQ(states.back().node, 5);
  EXPECT_EQ(std::get<event::OwnState>(states.back().data).node_id, 9);
  line_->execute({.request = EmcySend{.node = 5, .code = 0x1000}}, now_);
  EXPECT_TRUE(answer().ok());
  EXPECT_THAT(sent(), ElementsAre("089#0010010000000000"));
  EXPECT_TRUE(emitted(EventKind::emcy_sent, 5));
  hear(0x705, {0x00});
  EXPECT_TRUE(emitted(EventKind::boot_up, 5)) << "another device uses the node-ID";
  hear(0x709, {0x00});
  EXPECT_FALSE(emitted(EventKind::boot_up, 9));
}

// Devices with the configured node-IDs 5 and 6, with product codes 5 and 6.
class TwoLssDevices : public LineTest {
 protected:
  void SetUp() override {
    LineConfig config = config_of_devices();
    for (std::uint8_t id = 5; id <= 6; ++id) {
      od::DeviceDescription file = *eds::load(kDeviceFile, "axis.eds", id).value;
      const auto identity = std::ranges::find(file.objects, 0x1018, &od::ObjectDescription::index);
      std::ranges::find(identity->variables, 2, &od::VariableDescription::sub)->value[0] =
          std::byte{id};
      config.devices.push_back({.id = id, .name = "axis", .device = std::move(file), .lss = true});
    }
    make(std::move(config));
    line_->start(now_);
  }
  void lss(std::uint8_t command, std::uint32_t number) {
    const auto part = [number](unsigned shift) {
      return static_cast<std::uint8_t>(number >> shift);
    };
    hear(0x7E5, {command, part(0), part(8), part(16), part(24), 0, 0, 0});
    pass(Duration{});
    sent();
  }
  // Assigns a node-ID to the device with that product code, which boots with it.
  void give(std::uint8_t product, std::uint8_t node) {
    const std::uint32_t address[] = {0x123, product, 0, 0};
    for (std::uint8_t i = 0; i < 4; ++i) {
      lss(static_cast<std::uint8_t>(0x40 + i), address[i]);
    }
    lss(0x11, node);
    lss(0x04, 0);
  }
  // The node that is reported for an EMCY of the device with that configured node-ID.
  std::uint8_t reported_for(std::uint8_t device) {
    events();
    line_->execute({.request = EmcySend{.node = device, .code = 0x1000}}, now_);
    EXPECT_TRUE(answer().ok());
    sent();
    for (const Event& event : events()) {
      if (event.kind() == EventKind::emcy_sent) {
        return event.node;
      }
    }
    return 0;
  }
  std::uint8_t bus_id(std::uint8_t device) { return line_->own_device(device)->node_id; }
};

TEST_F(TwoLssDevices, EventsNameTheDeviceWhereANodeIdIsTheNameOfAnother) {
  give(5, 6);
  EXPECT_EQ(bus_id(5), 6);
  give(6, 7);
  EXPECT_EQ(bus_id(6), 7);
  EXPECT_EQ(reported_for(5), 5);
  EXPECT_EQ(reported_for(6), 6);
}

TEST_F(TwoLssDevices, ARefusedCommandNamesTheDeviceThatItWasFor) {
  give(5, 6);
  events();
  line_->execute({.request = EmcySend{.node = 6, .code = 0x1000}}, now_);
  EXPECT_FALSE(answer().ok());
  EXPECT_TRUE(emitted(EventKind::command_refused, 6)) << "device 6 has no node-ID";
}

// The device loses node-ID 6, which the other device gets.
TEST_F(TwoLssDevices, ANodeIdThatADeviceLostSaysNothingAboutIt) {
  give(5, 6);
  hear(0x000, {0x81, 0x06});
  pass(Duration{});
  EXPECT_EQ(bus_id(5), 0);
  give(6, 6);
  EXPECT_EQ(bus_id(6), 6);
  EXPECT_EQ(reported_for(6), 6);
}

TEST_F(LssDeviceTest, ResetNodeTakesTheNodeIdThatIsNotStored) {
  start();
  give(9);
  waiting();
  hear(0x000, {0x81, 0x09});
  pass(Duration{});
  EXPECT_THAT(sent(), IsEmpty());
  EXPECT_THAT(lss({0x4C, 0, 0, 0, 0, 0, 0, 0}), ElementsAre("7E4#5000000000000000"));
  give(9);
  EXPECT_THAT(waiting(), ElementsAre("709#00"));
}

TEST_F(LssDeviceTest, AnotherNodeIdIsUsedAfterResetCommunication) {
  start();
  give(9);
  waiting();
  give(10);
  EXPECT_THAT(waiting(), IsEmpty());
  hear(0x000, {0x82, 0x09});
  pass(Duration{});
  EXPECT_THAT(sent(), ElementsAre("70A#00"));
}

TEST_F(LssDeviceTest, WhatItStoresIsItsNodeIdTheNextTime) {
  start();
  give(9);
  EXPECT_THAT(lss({0x17, 0, 0, 0, 0, 0, 0, 0}), ElementsAre("7E4#1700000000000000"));
  start();
  EXPECT_THAT(sent(), ElementsAre("709#00"));
}

TEST_F(LssDeviceTest, StoreIsNotSupportedWithoutAPlaceForIt) {
  keeps = false;
  start();
  give(9);
  EXPECT_THAT(lss({0x17, 0, 0, 0, 0, 0, 0, 0}), ElementsAre("7E4#1701000000000000"));
}

TEST_F(LssDeviceTest, HasTheBitRateOfItsLineAlone) {
  start();
  configuration();
  EXPECT_THAT(lss({0x13, 0, 3, 0, 0, 0, 0, 0}), ElementsAre("7E4#1300000000000000"));
  EXPECT_THAT(lss({0x13, 0, 2, 0, 0, 0, 0, 0}), ElementsAre("7E4#1301000000000000"));
}

TEST_F(LssDeviceTest, WhatTheApplicationSaidIsThereUnderTheNewNodeId) {
  start();
  const auto& entries = line_->layout(Direction::outputs).entries;
  ASSERT_FALSE(entries.empty());
  line_->execute({.request = SingleOutput{.entry = 0,
                                          .data = std::vector<std::byte>(entries[0].bit_length / 8U,
                                                                         std::byte{0x2A})}},
                 now_);
  EXPECT_TRUE(answer().ok());
  give(9);
  waiting();
  line_->execute({.request = SdoRead{.node = 5, .address = {entries[0].index, entries[0].sub}}},
                 now_);
  EXPECT_EQ(answer().bytes().at(0), std::byte{0x2A});
}

}  // namespace
}  // namespace linegate::line

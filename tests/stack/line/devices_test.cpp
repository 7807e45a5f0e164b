// SPDX-License-Identifier: Apache-2.0
// A line in the role device: its devices below a master, which the test simulates.
#include <algorithm>
#include <cstdint>
#include <initializer_list>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "stack/base/byte_order.h"
#include "stack/eds/reader.h"
#include "stack/line/line.h"
#include "stack/profile/io_device.h"
#include "stack/storage/medium.h"
#include "stack/storage/parameters.h"

#include "tests/stack/line/device_file.h"
#include "tests/stack/line/line_fixture.h"

namespace linegate::line {
namespace {

using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

od::ObjectDescription consumer_heartbeat_times() {
  od::ObjectDescription out{.index = 0x1016, .name = "Consumers", .type = od::ObjectType::array};
  out.variables.push_back({.sub = 0, .type = od::DataType::unsigned8, .value = {std::byte{2}}});
  for (std::uint8_t sub = 1; sub <= 2; ++sub) {
    out.variables.push_back({.sub = sub, .type = od::DataType::unsigned32});
  }
  return out;
}

DeviceConfig axis_device(std::uint8_t id, const std::string& name) {
  DeviceConfig out{.id = id, .name = name, .device = *eds::load(kDeviceFile, "axis.eds", id).value};
  out.device.objects.push_back(consumer_heartbeat_times());
  std::ranges::sort(out.device.objects, {}, &od::ObjectDescription::index);
  return out;
}

LineConfig devices_config(std::vector<std::uint8_t> ids) {
  LineConfig config = config_of_devices();
  for (const std::uint8_t id : ids) {
    config.devices.push_back(axis_device(id, "axis" + std::to_string(id)));
  }
  return config;
}

class DevicesTest : public LineTest {
 protected:
  void start(std::vector<std::uint8_t> ids) {
    make(devices_config(std::move(ids)));
    line_->start(now_);
    sent();
  }
  void operate(std::vector<std::uint8_t> ids) {
    start(std::move(ids));
    hear(0x000, {0x01, 0x00});
    sent();
    events();
  }
  std::uint32_t entry(Direction direction, const std::string& name) {
    const auto& entries = line_->layout(direction).entries;
    const auto found = std::ranges::find(entries, name, &image::Entry::name);
    EXPECT_NE(found, entries.end()) << name;
    return static_cast<std::uint32_t>(found - entries.begin());
  }
  std::uint64_t input(const std::string& name) {
    const image::Snapshot all = snapshot(Direction::inputs);
    const image::Entry& at =
        line_->layout(Direction::inputs).entries[entry(Direction::inputs, name)];
    std::uint64_t out = 0;
    for (unsigned byte = at.bit_length / 8U; byte-- > 0;) {
      out = out << 8U | std::to_integer<std::uint64_t>(all.bytes[at.bit_offset / 8U + byte]);
    }
    return out;
  }
  bool valid(const std::string& name) {
    return snapshot(Direction::inputs).is_valid(entry(Direction::inputs, name));
  }
  OutputRefusal write(const std::string& name, std::uint8_t value, std::uint8_t length,
                      Duration watchdog = {}, std::uint8_t reactions = kHoldOutputs) {
    OutputWrite write{.layout_id = line_->layout(Direction::outputs).id, .arming = 1};
    write.watchdog = watchdog;
    write.reactions = reactions;
    write.values.push_back({.entry = entry(Direction::outputs, name), .length = length});
    write.values.back().data[0] = std::byte{value};
    return line_->write_outputs(write, now_);
  }
  Reply command(Command asked) {
    line_->execute(std::move(asked), now_);
    return answer();
  }
  void set(std::uint8_t node, std::uint16_t index, std::uint8_t sub, std::vector<std::byte> data) {
    EXPECT_TRUE(
        command(
            {.request = LocalWrite{.node = node, .address = {index, sub}, .data = std::move(data)}})
            .ok());
    pass(Duration{});
  }
};

TEST_F(DevicesTest, TheEventOfAPdoNamesItsDevice) {
  operate({5, 6});
  hear(0x206, {1});
  EXPECT_TRUE(emitted(EventKind::pdo_length, 6));
  hear(0x205, {1});
  EXPECT_TRUE(emitted(EventKind::pdo_length, 5));
}

TEST_F(DevicesTest, APdoThatDoesNotComeNamesItsDevice) {
  LineConfig config = devices_config({5, 6});
  for (DeviceConfig& device : config.devices) {
    auto& rpdo = *std::ranges::find(device.device.objects, 0x1400, &od::ObjectDescription::index);
    rpdo.variables.push_back({.sub = 5,
                              .type = od::DataType::unsigned16,
                              .access = od::Access::rw,
                              .value = {std::byte{50}, std::byte{}}});
  }
  make(std::move(config));
  line_->start(now_);
  hear(0x000, {0x01, 0x00});
  sent();
  events();
  hear(0x206, {1, 0, 0, 0, 0});
  pass(milliseconds(30));
  hear(0x205, {1, 0, 0, 0, 0});
  const std::uint64_t revision = line_->node_revision(6);
  pass(milliseconds(30));
  EXPECT_TRUE(emitted(EventKind::pdo_timeout, 6));
  EXPECT_NE(line_->node_revision(6), revision);
  EXPECT_EQ(line_->own_device(6)->indicators.error, node::Pattern::quadruple_flash);
  EXPECT_EQ(line_->own_device(5)->indicators.error, node::Pattern::off);
  hear(0x206, {1, 0, 0, 0, 0});
  EXPECT_TRUE(emitted(EventKind::pdo_recovered, 6));
  EXPECT_EQ(line_->own_device(6)->indicators.error, node::Pattern::off);
}

TEST_F(DevicesTest, EachDeviceHasItsIndicators) {
  start({5, 6});
  hear(0x000, {0x01, 0x06});
  EXPECT_EQ(line_->own_device(5)->indicators.run, node::Pattern::blinking);
  EXPECT_EQ(line_->own_device(6)->indicators.run, node::Pattern::on);
  EXPECT_EQ(line_->own_device(6)->node_id, 6);
  EXPECT_FALSE(line_->own_device(7));
}

TEST_F(DevicesTest, AnErrorResetOfTheApplicationWaitsForTheErrorsOfItsDevice) {
  operate({5, 6});
  hear(0x206, {1});
  EXPECT_THAT(sent(), Contains("086#1082110100000000"));
  const auto emcy = [&](std::uint8_t node, std::uint16_t code) {
    return command({.request = EmcySend{.node = node, .code = code}}).error;
  };
  EXPECT_EQ(emcy(6, 0x2310), Error{});
  EXPECT_EQ(emcy(5, 0x2310), Error{});
  EXPECT_THAT(sent(), ElementsAre("085#1023030000000000", "086#1023130000000000"));
  EXPECT_EQ(line_->node_state(6).error_register, 0x13);
  EXPECT_EQ(emcy(6, 0), to_error(Refusal::wrong_state));
  EXPECT_THAT(sent(), IsEmpty());
  EXPECT_EQ(line_->node_state(6).error_register, 0x11);
  EXPECT_EQ(emcy(5, 0), Error{});
  EXPECT_THAT(sent(), ElementsAre("085#0000000000000000"));
  hear(0x206, {1, 0, 0, 0, 0});
  EXPECT_THAT(sent(), ElementsAre("086#0000000000000000"));
  EXPECT_EQ(line_->node_state(6).error_register, 0);
}

TEST_F(DevicesTest, EachDeviceBootsAndObeysTheMaster) {
  make(devices_config({6, 5}));
  line_->start(now_);
  EXPECT_THAT(sent(), ElementsAre("705#00", "706#00"));
  EXPECT_EQ(line_->state().own_state, nmt::State::pre_operational);
  EXPECT_EQ(line_->state().nodes_configured, 2);
  EXPECT_EQ(line_->state().node_id, 5);
  const std::uint64_t revision = line_->node_revision(6);
  hear(0x000, {0x01, 0x06});
  EXPECT_THAT(sent(), ElementsAre("186#000000000000"));
  EXPECT_EQ(line_->state().nodes_operational, 1);
  EXPECT_NE(line_->node_revision(6), revision);
  EXPECT_EQ(line_->node_state(6).state, nmt::State::operational);
  EXPECT_EQ(line_->node_state(6).vendor, 0x123U);
  EXPECT_EQ(line_->node_state(5).state, nmt::State::pre_operational);
  EXPECT_FALSE(line_->node_state(7).configured);
  EXPECT_TRUE(emitted(EventKind::own_state, 6));
}

TEST_F(DevicesTest, WhatAnRpdoBringsIsInTheInputs) {
  operate({5, 6});
  EXPECT_FALSE(valid("axis6.Setpoint"));
  hear(0x206, {0x44, 0x33, 0x22, 0x11, 0x07});
  EXPECT_EQ(input("axis6.Setpoint"), 0x11223344U);
  EXPECT_EQ(input("axis6.Mode"), 7U);
  EXPECT_TRUE(valid("axis6.Setpoint"));
  EXPECT_FALSE(valid("axis5.Setpoint"));
  hear(0x206, {0x44, 0x33, 0x22, 0x11, 0x08});
  const image::Snapshot image = snapshot(Direction::inputs);
  ASSERT_EQ(image.marks.size(), 1U);
  EXPECT_EQ(image.marks[0].node, 6);
  EXPECT_EQ(image.marks[0].remote_pdo, 1);
  EXPECT_EQ(image.marks[0].count, 1U);
  EXPECT_TRUE(image.is_changed(entry(Direction::inputs, "axis6.Mode")));
  EXPECT_FALSE(image.is_changed(entry(Direction::inputs, "axis6.Setpoint")));
  EXPECT_EQ(line_->state().counters.rpdos, 2U);
}

TEST_F(DevicesTest, WhatIsWrittenIsSentToTheMaster) {
  operate({5, 6});
  EXPECT_EQ(write("axis5.Status", 0x42, 2), OutputRefusal::none);
  EXPECT_THAT(sent(), ElementsAre("185#420000000000"));
  EXPECT_EQ(write("axis5.Status", 0x42, 2), OutputRefusal::none);
  EXPECT_THAT(sent(), IsEmpty());
  EXPECT_EQ(write("axis5.Status", 0x42, 4), OutputRefusal::bad_length);
  OutputWrite bytes{.layout_id = line_->layout(Direction::outputs).id, .arming = 1};
  const auto& entries = line_->layout(Direction::outputs).entries;
  const image::Entry& position = entries[entry(Direction::outputs, "axis6.Position")];
  bytes.bytes.push_back({position.bit_offset / 8U, std::vector<std::byte>(4, std::byte{9})});
  EXPECT_EQ(line_->write_outputs(bytes, now_), OutputRefusal::none);
  EXPECT_THAT(sent(), ElementsAre("186#000009090909"));
}

TEST_F(DevicesTest, AWriteBeforeTheStartIsInTheFirstPdo) {
  start({5});
  EXPECT_EQ(write("axis5.Status", 1, 2), OutputRefusal::none);
  EXPECT_THAT(sent(), IsEmpty());
  hear(0x000, {0x01, 0x05});
  EXPECT_THAT(sent(), ElementsAre("185#010000000000"));
}

TEST_F(DevicesTest, AResetTakesWhatTheMasterSaidNotWhatTheApplicationSaid) {
  operate({5});
  hear(0x205, {1, 0, 0, 0, 7});
  write("axis5.Status", 3, 2);
  sent();
  hear(0x000, {0x81, 0x05});
  EXPECT_THAT(sent(), ElementsAre("705#00"));
  EXPECT_EQ(input("axis5.Mode"), 0U);
  EXPECT_FALSE(valid("axis5.Mode"));
  hear(0x000, {0x01, 0x05});
  EXPECT_THAT(sent(), ElementsAre("185#030000000000"));
}

TEST_F(DevicesTest, AnotherMappingFillsTheSameEntries) {
  start({5});
  hear(0x605, {0x23, 0x00, 0x14, 0x01, 0x05, 0x02, 0x00, 0x80});
  hear(0x605, {0x2F, 0x00, 0x16, 0x00, 0x00, 0, 0, 0});
  hear(0x605, {0x23, 0x00, 0x16, 0x01, 0x08, 0x00, 0x03, 0x20});
  hear(0x605, {0x2F, 0x00, 0x16, 0x00, 0x01, 0, 0, 0});
  hear(0x605, {0x23, 0x00, 0x14, 0x01, 0x05, 0x02, 0x00, 0x00});
  EXPECT_THAT(sent(), Contains("585#6000160100000000"));
  hear(0x605, {0x23, 0x02, 0x20, 0x00, 0x55, 0, 0, 0});
  EXPECT_EQ(input("axis5.Setpoint"), 0x55U);
  hear(0x000, {0x01, 0x05});
  hear(0x205, {0x09});
  EXPECT_EQ(input("axis5.Mode"), 9U);
  EXPECT_EQ(input("axis5.Setpoint"), 0x55U);
}

TEST_F(DevicesTest, TheDevicesHearEachOther) {
  operate({5, 6});
  set(6, 0x1400, 1, {std::byte{0x06}, std::byte{2}, std::byte{}, std::byte{0x80}});
  set(6, 0x1400, 1, {std::byte{0x85}, std::byte{1}, std::byte{}, std::byte{}});
  write("axis5.Status", 0x77, 2);
  EXPECT_THAT(sent(), Contains("185#770000000000"));
  EXPECT_EQ(input("axis6.Setpoint"), 0x77U);
  EXPECT_FALSE(valid("axis5.Setpoint"));
  // Device 6 monitors the heartbeat of device 5, 100 ms with 250 ms.
  set(5, 0x1017, 0, {std::byte{100}, std::byte{}});
  set(6, 0x1016, 1, {std::byte{250}, std::byte{}, std::byte{5}, std::byte{}});
  for (int i = 0; i < 20; ++i) {
    pass(milliseconds(50));
    sent();
  }
  EXPECT_FALSE(emitted(EventKind::heartbeat_lost, 5));
  set(5, 0x1017, 0, {std::byte{}, std::byte{}});
  pass(milliseconds(300));
  EXPECT_TRUE(emitted(EventKind::heartbeat_lost, 5));
}

TEST_F(DevicesTest, TheLossOfTheMasterIsToldAndObeyed) {
  operate({5, 6});
  hear(0x205, {1, 0, 0, 0, 7});
  hear(0x206, {1, 0, 0, 0, 8});
  set(6, 0x1016, 1, {std::byte{100}, std::byte{}, std::byte{1}, std::byte{}});
  hear(0x701, {0x05});
  pass(milliseconds(150));
  EXPECT_THAT(sent(), Contains(testing::StartsWith("086#3081")));
  const std::vector<Event> told = events();
  EXPECT_THAT(told, Contains(testing::Property(&Event::kind, EventKind::heartbeat_lost)));
  EXPECT_TRUE(std::ranges::any_of(told, [](const Event& event) {
    const auto* const own = event.get<event::OwnState>();
    return own != nullptr && event.node == 6 && own->state == nmt::State::pre_operational;
  }));
  EXPECT_FALSE(valid("axis6.Mode"));
  EXPECT_TRUE(valid("axis5.Mode"));
  EXPECT_EQ(input("axis6.Mode"), 8U);
  EXPECT_EQ(line_->node_state(6).last_emcy, 0x8130);
  EXPECT_EQ(line_->node_state(6).emcy_count, 1U);
}

TEST_F(DevicesTest, WithoutAnInterfaceNothingIsValid) {
  operate({5});
  hear(0x205, {1, 0, 0, 0, 7});
  EXPECT_TRUE(valid("axis5.Mode"));
  line_->bus_event({.kind = can::BusEvent::Kind::interface_failed, .code = 100, .time = now_});
  EXPECT_FALSE(valid("axis5.Mode"));
}

TEST_F(DevicesTest, TheMostUrgentFrameOfAllDevicesGoesFirst) {
  start({5, 6});
  hear(0x605, {0x40, 0x00, 0x10, 0x00, 0, 0, 0, 0});
  hear(0x000, {0x01, 0x06});
  hear(0x606, {0x40, 0x01, 0x10, 0x00, 0, 0, 0, 0});
  EXPECT_THAT(sent(),
              ElementsAre("186#000000000000", "585#4300100092010200", "586#4F01100000000000"));
  EXPECT_FALSE(line_->wants_to_send(now_));
}

TEST_F(DevicesTest, CommandsAreForTheDevices) {
  operate({5, 6});
  const Command read{.request = LocalRead{.node = 6, .what = od::Address{0x1018, 1}}};
  EXPECT_THAT(command(read).bytes(),
              ElementsAre(std::byte{0x23}, std::byte{1}, std::byte{}, std::byte{}));
  Command nobody = read;
  std::get<LocalRead>(nobody.request).node = 0;
  EXPECT_EQ(command(nobody).error, to_error(Refusal::bad_request));
  SdoRead other{.node = 9, .address = {0x1018, 1}};
  EXPECT_EQ(command({.request = other}).error, to_error(Refusal::wrong_role));
  other.node = 6;
  EXPECT_TRUE(command({.request = other}).ok());
  EXPECT_EQ(command({.request = NmtRequest{.node = 9}}).error, to_error(Refusal::wrong_role));
  EXPECT_TRUE(command({.request = NmtRequest{.node = 6, .command = nmt::Command::stop}}).ok());
  EXPECT_EQ(line_->node_state(6).state, nmt::State::stopped);
  EXPECT_EQ(line_->node_state(5).state, nmt::State::operational);
  EXPECT_TRUE(command({.request = EmcySend{.node = 5, .code = 0x1000}}).ok());
  EXPECT_THAT(sent(), Contains("085#0010010000000000"));
  EXPECT_EQ(command({.request = EmcySend{.node = 6, .code = 0x1000}}).error,
            to_error(Refusal::wrong_state));
  Command one{.request = SingleOutput{.entry = entry(Direction::outputs, "axis5.Status"),
                                      .data = {std::byte{4}, std::byte{}}}};
  EXPECT_TRUE(command(one).ok());
  EXPECT_THAT(sent(), Contains("185#040000000000"));
}

TEST_F(DevicesTest, ASilentWriterIsTold) {
  operate({5, 6});
  write("axis6.Status", 3, 2, milliseconds(50), kZeroOutputs | kHeartbeatOff | kNmtStop);
  EXPECT_THAT(sent(), Contains("186#030000000000"));
  set(6, 0x1017, 0, {std::byte{100}, std::byte{}});
  pass(milliseconds(60));
  EXPECT_THAT(sent(), Contains("186#000000000000"));
  const std::vector<Event> told = events();
  EXPECT_TRUE(std::ranges::any_of(told, [](const Event& event) {
    const auto* const fired = event.get<event::OutputWatchdog>();
    return fired != nullptr && fired->reactions == (kZeroOutputs | kHeartbeatOff);
  }));
  pass(seconds(1));
  EXPECT_THAT(sent(), Not(Contains(HasSubstr("706#"))));
  const Reply refused =
      command({.request = SingleOutput{.entry = entry(Direction::outputs, "axis6.Status"),
                                       .data = {std::byte{4}, std::byte{}}}});
  EXPECT_EQ(refused.error, to_error(Refusal::wrong_state)) << "a value by hand";
  EXPECT_EQ(refused.data, (ReplyData{std::vector{std::byte{0}, std::byte{0}}})) << "the group";
}

TEST_F(DevicesTest, AnEmcyThatNoDeviceSendsIsNoReaction) {
  operate({5, 6});
  write("axis6.Status", 3, 2, milliseconds(50), kSendEmcy);
  hear(0x000, {0x02, 0x00});
  pass(milliseconds(60));
  EXPECT_THAT(sent(), Not(Contains(HasSubstr("086#"))));
  const std::vector<Event> reported = events();
  EXPECT_TRUE(std::ranges::any_of(reported, [](const Event& event) {
    const auto* const fired = event.get<event::OutputWatchdog>();
    return fired != nullptr && fired->reactions == kHoldOutputs;
  }));
}

TEST_F(DevicesTest, DefaultsAreThereFromTheStart) {
  LineConfig config = devices_config({5});
  config.defaults = {{.entry = 0, .value = 0x1234}};
  make(std::move(config));
  line_->start(now_);
  hear(0x000, {0x01, 0x05});
  EXPECT_THAT(sent(), Contains("185#341200000000"));
}

TEST_F(DevicesTest, BoundOutputsFollowAnInputAlone) {
  LineConfig config = devices_config({5});
  config.bound = {0};
  make(std::move(config));
  line_->start(now_);
  hear(0x000, {0x01, 0x05});
  sent();
  line_->write_bound(std::vector<BoundValue>{{.entry = 0, .value = 0x4321}}, now_);
  EXPECT_THAT(sent(), ElementsAre("185#214300000000"));
  line_->write_bound(std::vector<BoundValue>{{.entry = 0, .value = 0x4321}}, now_);
  EXPECT_THAT(sent(), IsEmpty());
  EXPECT_EQ(write("axis5.Status", 1, 2), OutputRefusal::bound_entry);
  EXPECT_EQ(write("axis5.Position", 1, 4), OutputRefusal::none);
  const Command person{.request = SingleOutput{.data = {std::byte{}, std::byte{}}}};
  EXPECT_EQ(command(person).error, to_error(Refusal::bound_entry));
  hear(0x205, {9, 0, 0, 0, 0});
  EXPECT_EQ(line_->input(0).value, 9U);
  EXPECT_TRUE(line_->input(0).valid);
}

// A string of a device in its TPDO 1, in the place of its two numbers.
LineConfig text_config() {
  LineConfig config = devices_config({5});
  auto& objects = config.devices[0].device.objects;
  objects.push_back({.index = 0x2300, .name = "Text", .type = od::ObjectType::variable});
  objects.back().variables.push_back({.type = od::DataType::visible_string,
                                      .access = od::Access::rw,
                                      .mappable = true,
                                      .value = std::vector<std::byte>(4, std::byte{'-'})});
  std::ranges::sort(objects, {}, &od::ObjectDescription::index);
  auto& mapping = *std::ranges::find(objects, 0x1A00, &od::ObjectDescription::index);
  mapping.variables[0].value = {std::byte{1}};
  mapping.variables[1].value = {std::byte{32}, std::byte{0}, std::byte{0x00}, std::byte{0x23}};
  return config;
}

TEST_F(DevicesTest, TheOutputOfAStringIsTransmitted) {
  LineConfig config = text_config();
  config.defaults = {{.entry = 0, .value = 0x6463'6261}};
  make(std::move(config));
  line_->start(now_);
  sent();
  hear(0x000, {0x01, 0x05});
  EXPECT_THAT(sent(), Contains("185#61626364"));
  EXPECT_EQ(write("axis5.Text", 'x', 4), OutputRefusal::none);
  EXPECT_THAT(sent(), ElementsAre("185#78000000"));
  EXPECT_EQ(write("axis5.Text", 'x', 4), OutputRefusal::none);
  EXPECT_THAT(sent(), IsEmpty()) << "the value is the same";
}

TEST(DevicesMake, WhatCannotBeIsToldAtOnce) {
  LineConfig config = devices_config({5, 5, 6});
  config.devices[2].id = 128;
  config.nodes.push_back({.id = 9});
  const auto made = Line::make(std::move(config));
  EXPECT_FALSE(made.ok());
  std::string all;
  for (const Diagnostic& diagnostic : made.diagnostics) {
    all += to_string(diagnostic) + '\n';
  }
  EXPECT_THAT(all,
              HasSubstr("below: error: own devices are for the role device, which has no nodes"));
  EXPECT_THAT(all, HasSubstr("below: error: two devices have the node-ID 5"));
  EXPECT_THAT(all, HasSubstr("below: error: node-ID 128 of a device is not in 1..127"));
}

TEST(DevicesMake, ObjectsThatNoPdoMapsAreInTheImageToo) {
  LineConfig config = devices_config({5});
  auto& objects = config.devices[0].device.objects;
  od::ObjectDescription spare{.index = 0x2010, .name = "Spare"};
  spare.variables.push_back(
      {.type = od::DataType::unsigned8, .access = od::Access::ro, .mappable = true});
  objects.push_back(spare);
  const auto made = Line::make(std::move(config));
  ASSERT_TRUE(made.ok());
  const image::Layout& outputs = (*made.value)->layout(Direction::outputs);
  ASSERT_EQ(outputs.entries.size(), 3U);
  EXPECT_EQ(outputs.entries[2].name, "axis5.Spare");
  EXPECT_EQ(outputs.entries[2].remote_pdo, 0);
  EXPECT_EQ(outputs.entries[2].local_pdo, 2);
  EXPECT_EQ((*made.value)->layout(Direction::inputs).entries.size(), 2U);
}

class IoDevicesTest : public DevicesTest {
 protected:
  static LineConfig io_config() {
    LineConfig config = devices_config({});
    config.stores_parameters = true;
    config.devices.push_back({.id = 5,
                              .name = "io",
                              .device = profile::make_io_device(
                                  {.digital_inputs = 1, .digital_outputs = 1}, "io", 5, true)});
    storage::mark_parameters(config.devices[0].device);
    return config;
  }
  void power_on(storage::Medium* medium) {
    make(io_config());
    line_->set_medium(medium, {.device = 5});
    line_->start(now_);
    hear(0x000, {0x01, 0x00});
    sent();
    events();
  }
  // The response of the device to an expedited transfer of the master.
  std::string ask(std::initializer_list<std::uint8_t> request) {
    hear(0x605, request);
    pass(Duration{});
    const auto frames = sent();
    const auto answer = std::ranges::find_if(
        frames, [](const std::string& frame) { return frame.starts_with("585#"); });
    return answer == frames.end() ? "" : *answer;
  }
  std::uint64_t number(std::uint16_t index, std::uint8_t sub) {
    const Reply reply = command({.request = LocalRead{.node = 5, .what = od::Address{index, sub}}});
    EXPECT_TRUE(reply.ok());
    return load_le(std::span<const std::byte>(reply.bytes()));
  }
};

TEST_F(IoDevicesTest, PolarityStandsBetweenTheImageAndTheBus) {
  power_on(nullptr);
  const std::string in = "io.Read input 8-bit.Inputs 1";
  const std::string out = "io.Write output 8-bit.Outputs 1";
  write(in, 0x0F, 1);
  pass(Duration{});
  EXPECT_THAT(sent(), Contains("185#0F"));
  EXPECT_EQ(ask({0x2F, 0x02, 0x60, 0x01, 0x81, 0, 0, 0}), "585#6002600100000000");
  EXPECT_EQ(number(0x6000, 1), 0x8EU) << "the present value is converted at once";
  write(in, 0x0E, 1);
  pass(Duration{});
  EXPECT_THAT(sent(), Contains("185#8F"));
  const image::Snapshot outputs = snapshot(Direction::outputs);
  EXPECT_EQ(std::to_integer<int>(outputs.bytes[0]), 0x0E) << "the value that the application wrote";
  hear(0x205, {0x3C});
  EXPECT_EQ(input(out), 0x3CU);
  ask({0x2F, 0x02, 0x62, 0x01, 0xF0, 0, 0, 0});
  EXPECT_EQ(input(out), 0xCCU);
  hear(0x205, {0x3F});
  EXPECT_EQ(input(out), 0xCFU);
  EXPECT_EQ(number(0x6200, 1), 0x3FU);
}

// A polarity in an output entry converts another input while the values of the same write are
// applied.
TEST_F(IoDevicesTest, APolarityThatIsWrittenWithInputsHoldsUpNoTpdo) {
  LineConfig config = devices_config({});
  config.devices.push_back(
      {.id = 5, .name = "io", .device = profile::make_io_device({.digital_inputs = 2}, "io", 5)});
  for (od::ObjectDescription& object : config.devices[0].device.objects) {
    const auto give = [&](std::uint8_t sub, std::uint32_t value) {
      object.variables[sub].value.resize(od::byte_size(object.variables[sub].type));
      store_le(std::span(object.variables[sub].value), value);
    };
    if (object.index == 0x6002) {
      object.variables[2].mappable = true;
    } else if (object.index == 0x1A00) {
      give(0, 1);
    } else if (object.index == 0x1A01) {
      give(0, 2);
      give(1, 0x6000'0208);
      give(2, 0x6002'0208);
    } else if (object.index == 0x1801) {
      give(1, 0x285);
    }
  }
  make(std::move(config));
  line_->start(now_);
  hear(0x000, {0x01, 0x00});
  sent();
  OutputWrite together{.layout_id = line_->layout(Direction::outputs).id, .arming = 1};
  for (const char* const name : {"Read input 8-bit.Inputs 1", "Read input 8-bit.Inputs 2",
                                 "Polarity input 8-bit.Polarity 2"}) {
    together.values.push_back(
        {.entry = entry(Direction::outputs, std::string("io.") + name), .length = 1});
  }
  const std::pair<std::byte, std::string> rounds[] = {{std::byte{0x0F}, "0F"},
                                                      {std::byte{0xF0}, "F0"}};
  for (const auto& [value, shown] : rounds) {
    for (auto& one : together.values) {
      one.data[0] = value;
    }
    EXPECT_EQ(line_->write_outputs(together, now_), OutputRefusal::none);
    pass(Duration{});
    const std::vector<std::string> frames = sent();
    EXPECT_THAT(frames, Contains("185#" + shown));
    EXPECT_THAT(frames, Contains("285#00" + shown)) << "the second input is converted";
  }
}

TEST_F(IoDevicesTest, StoreTheirParametersWhereTheLineKeepsThem) {
  storage::MemoryMedium medium;
  power_on(&medium);
  ask({0x2B, 0x17, 0x10, 0x00, 0xFA, 0, 0, 0});
  ask({0x2F, 0x02, 0x60, 0x01, 0x81, 0, 0, 0});
  EXPECT_EQ(ask({0x23, 0x10, 0x10, 0x01, 's', 'a', 'v', 'e'}), "585#6010100100000000");
  ask({0x2B, 0x17, 0x10, 0x00, 0x64, 0, 0, 0});

  power_on(&medium);
  EXPECT_EQ(number(0x1017, 0), 250U);
  EXPECT_EQ(number(0x6002, 1), 0x81U);
  write("io.Read input 8-bit.Inputs 1", 0, 1);
  pass(Duration{});
  EXPECT_THAT(sent(), Contains("185#81"));
  EXPECT_EQ(ask({0x23, 0x11, 0x10, 0x01, 'l', 'o', 'a', 'd'}), "585#6011100100000000");

  power_on(&medium);
  EXPECT_EQ(number(0x1017, 0), 0U) << "the default value";
  EXPECT_EQ(number(0x6002, 1), 0U);
}

TEST_F(IoDevicesTest, WithoutAPlaceToKeepItNothingIsStored) {
  power_on(nullptr);
  EXPECT_THAT(ask({0x23, 0x10, 0x10, 0x01, 's', 'a', 'v', 'e'}), HasSubstr("585#80101001"));
}

}  // namespace
}  // namespace linegate::line

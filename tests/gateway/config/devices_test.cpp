// SPDX-License-Identifier: Apache-2.0
// `devices:` of a line in the role device.
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "gateway/config/plant.h"
#include "stack/line/line.h"

#include "tests/paths.h"

namespace linegate::config {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

const std::string kDevicesRoot = paths::in_repository("");

Loaded<Plant> read_devices(const std::string& text) {
  return read(text, kDevicesRoot + "plant.yaml");
}

std::vector<std::string> device_messages(const Loaded<Plant>& loaded) {
  std::vector<std::string> out;
  for (const auto& diagnostic : loaded.diagnostics) {
    std::string text = to_string(diagnostic);
    for (std::size_t at = text.find(kDevicesRoot); at != std::string::npos;
         at = text.find(kDevicesRoot)) {
      text.erase(at, kDevicesRoot.size());
    }
    out.push_back(std::move(text));
  }
  return out;
}

TEST(Devices, HaveWhatTheLineSaysToBeginWith) {
  const auto loaded = read_devices(R"(schema: 1
lines:
  - name: below
    interface: virtual:plc
    role: device
    devices:
      - {id: 6, eds: bridges/sim/eds/digital-io.eds}
      - id: 5
        name: axis
        eds: bridges/sim/eds/drive.eds
        serial: 77
        heartbeat: 250ms
        objects: {"6081:0": 1234}
        pdos: {tpdo1: {event_timer: 40ms}}
    outputs: {defaults: {"axis.6041:0": 0x250}}
)");
  ASSERT_THAT(device_messages(loaded), IsEmpty());
  const line::LineConfig& config = loaded.value->lines.at(0).config;
  EXPECT_EQ(config.node_id, 0);
  ASSERT_EQ(config.devices.size(), 2U);
  EXPECT_EQ(config.devices[1].name, "device6");
  const line::DeviceConfig& axis = config.devices[0];
  EXPECT_EQ(axis.name, "axis");
  const auto value = [&](od::Address address) { return axis.device.find(address)->value; };
  EXPECT_THAT(value({0x1018, 4}),
              ElementsAre(std::byte{77}, std::byte{}, std::byte{}, std::byte{}));
  EXPECT_THAT(value({0x1017, 0}), ElementsAre(std::byte{250}, std::byte{}));
  EXPECT_THAT(value({0x6081, 0}),
              ElementsAre(std::byte{0xD2}, std::byte{4}, std::byte{}, std::byte{}));
  EXPECT_THAT(value({0x1800, 5}), ElementsAre(std::byte{40}, std::byte{}));
  ASSERT_EQ(config.defaults.size(), 1U);
  const auto made = line::Line::make(config);
  ASSERT_TRUE(made.ok());
  const auto& outputs = (*made.value)->layout(image::Direction::outputs);
  EXPECT_EQ(outputs.entries.at(config.defaults[0].entry).name, "axis.Statusword");
}

TEST(Devices, WhatIsWrongIsToldWithItsPlace) {
  EXPECT_THAT(
      device_messages(read_devices(R"(schema: 1
lines:
  - name: below
    interface: virtual:plc
    role: device
    node_id: 9
    nodes: []
    devices:
      - {id: 5, name: a, eds: bridges/sim/eds/drive.eds}
      - {id: 5, name: a, eds: bridges/sim/eds/drive.eds, objects: {"9999:9": 1}}
      - {id: 7}
)")),
      ElementsAre("plant.yaml:6:14: error: node_id is not for a line with devices: it has no "
                  "node of its own beside them",
                  "plant.yaml:7:12: error: nodes is not for a line with devices: it has no "
                  "node of its own beside them",
                  "plant.yaml:10:9: error: node-ID 5 is that of \"a\" already",
                  "plant.yaml:10:9: error: another device is called \"a\"",
                  "plant.yaml:10:68: error: bridges/sim/eds/drive.eds has no object 9999:09",
                  "plant.yaml:11:9: error: a device needs the key \"eds\" (or \"dcf\")"));
  EXPECT_THAT(device_messages(read_devices(R"(schema: 1
lines:
  - name: above
    interface: virtual:plc
    devices: [{id: 5, eds: bridges/sim/eds/drive.eds}]
)")),
              ElementsAre("plant.yaml:5:14: error: devices are for a line with the role device; a "
                          "manager has nodes"));
}

// The slave mode of the IXXAT manual (8.2).
TEST(Devices, WithoutAnyTheOwnNodeOfTheLineObeysAnotherMaster) {
  const auto loaded = read_devices(R"(schema: 1
lines:
  - name: below
    interface: virtual:plc
    role: device
    node_id: 20
    heartbeat: 250ms
    identity: {vendor: 7}
    storage: .
    own_objects: {2100:1: {type: u16, access: rww, map: true}}
    own_values: {1016:1: 0x007F01F4}
    own_pdos: {rpdo9: {cob_id: 0x222, map: ["2100:1"]}}
    nodes: [{id: 5, name: axis, eds: bridges/sim/eds/drive.eds, heartbeat: 200ms}]
)");
  ASSERT_THAT(device_messages(loaded), IsEmpty());
  const line::LineConfig& config = loaded.value->lines.at(0).config;
  EXPECT_EQ(config.node_id, 20);
  EXPECT_FALSE(config.own_start) << "its NMT master starts it";
  EXPECT_EQ(config.own_values.size(), 1U);
  EXPECT_EQ(config.nodes.size(), 1U);
  const auto made = line::Line::make(config);
  ASSERT_TRUE(made.ok());
  od::Dictionary& dictionary = (*made.value)->dictionary();
  EXPECT_EQ(dictionary.number({0x1018, 1}), 7U);
  EXPECT_EQ(dictionary.number({0x1F80, 0}), 4U) << "not an NMT master, does not start itself";
  EXPECT_EQ(dictionary.number({0x2100, 1}), 0U);
  EXPECT_EQ(dictionary.number({0x1408, 1}), 0x222U | 0x4000'0000U);
}

TEST(Devices, ALineWithoutAnyMayStartByItself) {
  const auto loaded = read_devices(R"(schema: 1
lines:
  - {name: below, interface: virtual:plc, role: device, startup: {own_start: true}}
)");
  ASSERT_THAT(device_messages(loaded), IsEmpty());
  EXPECT_TRUE(loaded.value->lines.at(0).config.own_start);
  EXPECT_THAT(device_messages(read_devices(R"(schema: 1
lines:
  - {name: below, interface: virtual:plc, role: device, devices: []}
)")),
              ElementsAre("plant.yaml:3:66: error: devices is empty: name at least one, or leave "
                          "the key out for a line whose own node, node_id, obeys another master"));
}

TEST(Devices, AnIoModuleNeedsNoFile) {
  const auto loaded = read_devices(R"(schema: 1
lines:
  - name: below
    interface: virtual:plc
    role: device
    devices:
      - {id: 9, name: io, profile: 401, digital_inputs: 2, analogue_outputs: 3, serial: 12}
)");
  ASSERT_THAT(device_messages(loaded), IsEmpty());
  const line::LineConfig& config = loaded.value->lines.at(0).config;
  const auto made = line::Line::make(config);
  ASSERT_TRUE(made.ok());
  EXPECT_EQ((*made.value)->layout(image::Direction::outputs).entries.at(1).name,
            "io.Read input 8-bit.Inputs 2");
  EXPECT_EQ((*made.value)->layout(image::Direction::inputs).entries.size(), 3U);
  EXPECT_EQ((*made.value)->node_state(9).serial, 12U);
  EXPECT_THAT(device_messages(read_devices(R"(schema: 1
lines:
  - name: below
    interface: virtual:plc
    role: device
    devices:
      - {id: 9, profile: 401}
      - {id: 10, profile: 402, digital_inputs: 300}
      - {id: 11, profile: 401, digital_inputs: 1, eds: a.eds}
      - {id: 12, digital_inputs: 1}
)")),
              ElementsAre("plant.yaml:7:26: error: a device with profile: 401 has at least one of "
                          "digital_inputs, digital_outputs, analogue_inputs, analogue_outputs",
                          "plant.yaml:8:27: error: expected 401, got \"402\"; did you mean "
                          "\"401\"?",
                          "plant.yaml:8:48: error: expected a number from 0 to 254, got \"300\"",
                          "plant.yaml:9:56: error: a device has either a profile or a device file",
                          "plant.yaml:10:9: error: a device needs the key \"eds\" (or \"dcf\")",
                          "plant.yaml:10:34: error: digital_inputs is for a device with profile: "
                          "401"));
}

TEST(Devices, StoreInTheFolderOfTheLine) {
  const auto with = [](const std::string& storage) {
    return read_devices(R"(schema: 1
lines:
  - name: below
    interface: virtual:plc
    role: device
)" + storage + R"(    devices:
      - {id: 9, name: io, profile: 401, digital_inputs: 2}
)");
  };
  const auto stores = with("    storage: var/parameters\n");
  ASSERT_THAT(device_messages(stores), IsEmpty());
  const config::LinePlan& line = stores.value->lines.at(0);
  EXPECT_THAT(line.storage, testing::EndsWith("var/parameters"));
  EXPECT_TRUE(line.config.stores_parameters);
  const od::DeviceDescription& device = line.config.devices.at(0).device;
  EXPECT_NE(device.find(0x1010), nullptr);
  EXPECT_TRUE(device.find({0x1017, 0})->store);
  EXPECT_FALSE(device.find({0x6000, 1})->store);
  const auto forgets = with("");
  ASSERT_THAT(device_messages(forgets), IsEmpty());
  EXPECT_EQ(forgets.value->lines.at(0).config.devices.at(0).device.find(0x1010), nullptr);
}

std::string bound_plant(const std::string& bindings) {
  return R"(schema: 1
lines:
  - name: press
    interface: virtual:press
    nodes: [{id: 5, name: axis, eds: bridges/sim/eds/drive.eds}]
    outputs: {groups: [{name: mode, entries: [axis.6060:0]}]}
  - {name: ear, interface: virtual:press, role: observer, nodes: [{id: 5, name: axis, eds: bridges/sim/eds/drive.eds}]}
  - name: below
    interface: virtual:plc
    role: device
    devices:
      - {id: 7, name: io, profile: 401, digital_inputs: 2, digital_outputs: 2}
      - id: 8
        name: ram
        eds: bridges/sim/eds/drive.eds
        bind:
)" + bindings;
}

TEST(Devices, AreBoundToEntriesOfOtherLinesAndTheirOwn) {
  const auto loaded = read_devices(bound_plant(R"(          "6041:0": press/axis.Statusword
          "6040:0": {entry: "press/axis.6040:0", when_lost: zero}
)"));
  ASSERT_THAT(device_messages(loaded), IsEmpty());
  ASSERT_EQ(loaded.value->bindings.size(), 2U);
  const Binding& status = loaded.value->bindings[0];
  EXPECT_EQ(status.from + "/" + status.input_name, "press/axis.Statusword");
  EXPECT_EQ(status.to + "/" + status.output_name, "below/ram.Statusword");
  EXPECT_EQ(status.when_lost, WhenLost::hold);
  const Binding& control = loaded.value->bindings[1];
  EXPECT_EQ(control.from + "/" + control.input_name, "below/ram.Controlword");
  EXPECT_EQ(control.to + "/" + control.output_name, "press/axis.Controlword");
  EXPECT_EQ(control.when_lost, WhenLost::zero);
  EXPECT_THAT(loaded.value->lines.at(0).config.bound, ElementsAre(control.output_entry));
  EXPECT_THAT(loaded.value->lines.at(2).config.bound, ElementsAre(status.output_entry));
  for (const std::size_t line : {0U, 2U}) {
    EXPECT_THAT(loaded.value->lines.at(line).source,
                AllOf(HasSubstr("press 5:6041:00>below"), HasSubstr("below 8:6040:00>press")));
  }
  EXPECT_THAT(loaded.value->lines.at(1).source, Not(HasSubstr(">")));
}

TEST(Devices, WhatCannotBeBoundIsToldWithItsPlace) {
  EXPECT_THAT(
      device_messages(read_devices(bound_plant(R"(          "9999:0": press/axis.Statusword
          "6041:0": pres/axis.Statusword
          "6064:0": press/axis.Statusword
          "6061:0": press/axis.Controlword
          "6040:0": press/axis.Statusword
          "6060:0": press/axis.6060:0
          "607A:0": ear/axis.607A:0
)"))),
      ElementsAre("plant.yaml:17:11: error: the device has no object 9999:00 that a PDO "
                  "could carry",
                  "plant.yaml:18:21: error: there is no line \"pres\"; did you mean "
                  "\"press\"?",
                  "plant.yaml:19:21: error: \"axis.Statusword\" is UNSIGNED16, "
                  "\"ram.Position actual value\" is INTEGER32",
                  "plant.yaml:20:21: error: \"axis.Controlword\" is an output; 6061:00, "
                  "which the device sends, follows an input",
                  "plant.yaml:21:21: error: \"axis.Statusword\" is an input; 6040:00, which "
                  "the device receives, is followed by an output",
                  "plant.yaml:22:21: error: \"axis.Modes of operation\" is in the output "
                  "group \"mode\"",
                  "plant.yaml:23:21: error: line \"ear\" is an observer, which writes no "
                  "outputs"));
  EXPECT_THAT(device_messages(read_devices(
                  bound_plant(R"(          "6041:0": {entry: press/axis.Statusword, when_lost: hide}
          "6040:0": [1]
          "1:2:3": press/axis.Statusword
)"))),
              ElementsAre("plant.yaml:17:63: error: expected hold or zero, got \"hide\"",
                          "plant.yaml:18:21: error: expected an entry such as press/axis.6041:0",
                          "plant.yaml:19:11: error: expected an object such as 6000:1"));
}

TEST(Devices, HaveNodeIdsOfTheirOwnOnABusInsideTheProcess) {
  EXPECT_THAT(device_messages(read_devices(R"(schema: 1
lines:
  - {name: a, interface: "virtual:p", node_id: 7}
  - {name: b, interface: "virtual:p", node_id: 7}
  - {name: c, interface: "virtual:p", role: observer}
  - {name: d, interface: "virtual:q", node_id: 7}
  - name: e
    interface: virtual:q
    role: device
    devices: [{id: 7, profile: 401, digital_inputs: 1}, {id: 8, profile: 401, digital_inputs: 1}]
)")),
              ElementsAre("plant.yaml:4:26: error: node-ID 7 is that of line \"a\" on the same bus "
                          "virtual:p: give one of them another node_id",
                          "plant.yaml:8:16: error: node-ID 7 is that of line \"d\" on the same bus "
                          "virtual:q: give one of them another node_id"));
}

}  // namespace
}  // namespace linegate::config

// SPDX-License-Identifier: Apache-2.0
// Lines in the role device, with a manager on another line of the same gateway.
#include <algorithm>
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "tests/gateway/process/gateway_fixture.h"

namespace linegate::gateway {
namespace {

using namespace std::chrono_literals;

// A manager and the devices below it, on one bus.
TEST_F(GatewayTest, DevicesOfALineAreThoseOfAManager) {
  const std::string more = R"(  - name: plc
    interface: virtual:below-the-plc
    access: all
    nodes:
      - {id: 7, name: lamp, eds: bridges/sim/eds/digital-io.eds, heartbeat: 100ms}
      - {id: 8, name: ram, eds: bridges/sim/eds/drive.eds, heartbeat: 100ms}
  - name: below
    interface: virtual:below-the-plc
    role: device
    access: all
    devices:
      - {id: 7, name: lamp, eds: bridges/sim/eds/digital-io.eds}
      - {id: 8, name: ram, eds: bridges/sim/eds/drive.eds}
      - {id: 9, name: shown, profile: 401, digital_inputs: 1, bind: {"6000:1": "plc/lamp.6000:1"}}
)";
  ASSERT_TRUE(gateway_->reload(make_plant(plant_text() + more)).done);
  ASSERT_TRUE(until([&] {
    return operational("plc/lamp") && operational("plc/ram") && operational("below/lamp") &&
           operational("below/ram") && seen_.layouts.size() == 8;
  }));
  EXPECT_EQ(seen_.lines["below"].role, line::Role::device);
  const auto first_byte = [&](const std::string& image) {
    const image::Snapshot& last = seen_.images[image];
    return last.bytes.empty() || !last.is_valid(0) ? -1 : std::to_integer<int>(last.bytes[0]);
  };
  line::Command write{.request = line::SingleOutput{.data = {std::byte{0x5A}}}};
  EXPECT_TRUE(call(at("below"), write, seen_.layouts["below/outputs"].id).reply.ok());
  EXPECT_TRUE(until([&] { return first_byte("plc/inputs") == 0x5A; }));
  // The object of a device is an input of the manager.
  EXPECT_TRUE(until([&] {
    const auto result = call(at("below"), sdo_read(9, 0x6000, 1));
    return result.reply.ok() && result.reply.bytes() == std::vector{std::byte{0x5A}};
  }));
  line::OutputWrite outputs{.layout_id = seen_.layouts["plc/outputs"].id};
  for (std::uint32_t i = 0; seen_.layouts["plc/outputs"].entries[i].node == 7; ++i) {
    outputs.values.push_back({.entry = i, .length = 1, .data = {std::byte{0xA5}}});
  }
  EXPECT_TRUE(client_->write_outputs(at("plc"), outputs));
  EXPECT_TRUE(until([&] { return first_byte("below/inputs") == 0xA5; }));
  EXPECT_EQ(seen_.gaps, 0);
}

// One of several devices: a name that is longer than in its device file, and a program download
// from its master.
TEST_F(GatewayTest, ADeviceOfALineHasLongValues) {
  ASSERT_TRUE(gateway_
                  ->reload(make_plant(plant_text() + R"(  - name: plc
    interface: virtual:long-values
    access: all
    nodes: [{id: 8, name: ram, eds: bridges/sim/eds/drive.eds}]
  - name: below
    interface: virtual:long-values
    role: device
    access: all
    devices:
      - {id: 7, name: lamp, eds: bridges/sim/eds/digital-io.eds}
      - {id: 8, name: ram, eds: bridges/sim/eds/drive.eds}
)"))
                  .done);
  ASSERT_TRUE(until([&] { return operational("plc/ram") && operational("below/ram"); }));
  const auto ask = [&](const std::string& line, line::Command command) {
    return client_->call(at(line), command, 60s, seen_).reply;
  };
  line::LocalWrite name{
      .address = {0x1008, 0}, .as_owner = true, .data = std::vector(300, std::byte{'x'})};
  EXPECT_EQ(ask("below", {.request = name}).error, line::to_error(line::Refusal::bad_request))
      << "of which?";
  name.node = 8;
  EXPECT_TRUE(ask("below", {.request = name}).ok());
  EXPECT_EQ(ask("plc", sdo_read(8, 0x1008, 0)).bytes(), name.data);
  EXPECT_EQ(ask("below", sdo_read(7, 0x1008, 0)).bytes().size(),
            std::string_view("Linegate digital I/O").size());
  line::SdoWrite program{.node = 8, .address = {0x1F50, 1}};
  for (std::uint32_t i = 0; i < 150'000; ++i) {
    program.data.push_back(static_cast<std::byte>(i * 7));
  }
  EXPECT_TRUE(ask("plc", {.request = program}).ok());
  const line::LocalRead read{.node = 8, .what = od::Address{0x1F50, 1}};
  EXPECT_EQ(ask("below", {.request = read}).bytes(), program.data);
}

TEST_F(GatewayTest, DevicesOfALineStoreTheirParameters) {
  const std::string folder =
      testing::TempDir() + "linegate-stored-" + std::to_string(test::own_domain());
  std::filesystem::remove_all(folder);
  const auto plant = [&](const std::string& more) {
    return make_plant(plant_text() + R"(  - {name: plc, interface: "virtual:plc", access: all}
  - name: below
    interface: virtual:plc
    role: device
    access: all
    storage: )" + folder +
                      R"(
    devices: [{id: 9, name: io, profile: 401, digital_inputs: 1}]
)" + more);
  };
  ASSERT_TRUE(gateway_->reload(plant("")).done);
  ASSERT_TRUE(until([&] { return seen_.happened("below", EventKind::line_started); }));
  const auto write = [&](std::uint16_t index, std::uint8_t sub, std::vector<std::byte> data) {
    return call(at("plc"),
                {.request =
                     line::SdoWrite{.node = 9, .address = {index, sub}, .data = std::move(data)}})
        .reply.ok();
  };
  EXPECT_TRUE(until([&] { return write(0x6002, 1, {std::byte{0x81}}); }));
  EXPECT_TRUE(write(0x1010, 1, {std::byte{'s'}, std::byte{'a'}, std::byte{'v'}, std::byte{'e'}}));
  EXPECT_TRUE(std::filesystem::exists(folder + "/below-9.parameters"));
  ASSERT_TRUE(gateway_->reload(plant("    publish: {period: 50ms}\n")).done);
  EXPECT_TRUE(until([&] {
    const auto result = call(at("below"), sdo_read(9, 0x6002, 1));
    return result.reply.ok() && result.reply.bytes() == std::vector{std::byte{0x81}};
  }));
  std::filesystem::remove_all(folder);
}

}  // namespace
}  // namespace linegate::gateway

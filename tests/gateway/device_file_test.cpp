#include "gateway/device_file.h"

#include <span>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "stack/eds/reader.h"
#include "stack/line/line.h"
#include "stack/manager/concise_dcf.h"
#include "stack/od/dictionary.h"

#include "tests/gateway/plans.h"

namespace linegate::gateway {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;

config::Plant demo() {
  return *config::load(LINEGATE_SOURCE_DIR "/deploy/plants/demo.yaml").value;
}

TEST(DeviceFile, TheEdsOfEachOwnNodeDescribesItsDictionary) {
  const config::Plant plant = demo();
  for (const config::LinePlan& line : plant.lines) {
    const DeviceFile file = write_device_file(plant, line.config.name, DeviceFileKind::eds);
    ASSERT_TRUE(file.ok) << file.content;
    const auto read = eds::load(file.content, "own.eds", line.config.node_id);
    ASSERT_TRUE(read.ok()) << to_string(read.diagnostics.at(0));
    EXPECT_THAT(read.diagnostics, IsEmpty());
    EXPECT_EQ(read.value->product_name, "Linegate line " + line.config.name);

    auto expected = make_line(line)->dictionary().describe();
    auto objects = read.value->objects;
    ASSERT_EQ(objects.size(), expected.size());
    for (std::size_t i = 0; i < objects.size(); ++i) {
      objects[i].line = 0;
      for (auto& variable : objects[i].variables) {
        variable.line = 0;
      }
      for (auto& variable : expected[i].variables) {
        variable.store = false;  // CiA 306 has no word for it
      }
      EXPECT_TRUE(objects[i] == expected[i]) << std::hex << expected[i].index;
    }
  }
}

TEST(DeviceFile, TheEdsOfADeviceOfTheLineIsForItsMaster) {
  const config::Plant plant =
      *config::load(LINEGATE_SOURCE_DIR "/deploy/plants/below-a-plc.yaml").value;
  const DeviceFile file = write_device_file(plant, "plc:panel", DeviceFileKind::eds);
  ASSERT_TRUE(file.ok) << file.content;
  const auto read = eds::load(file.content, "panel.eds", 77);
  ASSERT_TRUE(read.ok()) << to_string(read.diagnostics.at(0));
  EXPECT_THAT(read.diagnostics, IsEmpty());
  const od::Dictionary device(*read.value);
  EXPECT_EQ(device.number({0x1800, 1}), 0x180U + 77);
  EXPECT_EQ(device.number({0x1017, 0}), 500U);
  EXPECT_TRUE(device.has_object(0x6401));
  EXPECT_TRUE(write_device_file(plant, "plc:11", DeviceFileKind::eds).ok);
  EXPECT_THAT(write_device_file(plant, "plc:nobody", DeviceFileKind::eds).content,
              HasSubstr("line plc has no device nobody"));
  EXPECT_THAT(write_device_file(plant, "plc", DeviceFileKind::eds).content,
              HasSubstr("has devices instead of an own node"));
}

TEST(DeviceFile, TheDcfOfANodeHasWhatIsWrittenToIt) {
  const config::Plant plant = demo();
  const DeviceFile file = write_device_file(plant, "pack:belt", DeviceFileKind::dcf);
  ASSERT_TRUE(file.ok) << file.content;
  const auto read = eds::read(file.content, "belt.dcf", 0);
  ASSERT_TRUE(read.ok()) << to_string(read.diagnostics.at(0));
  EXPECT_EQ(read.value->device.node_id, 20);
  EXPECT_EQ(read.value->device.node_name, "belt");
  EXPECT_EQ(read.value->commissioning->network_name, "pack");
  const od::VariableDescription* acceleration = read.value->device.find({0x6083, 0});
  EXPECT_TRUE(acceleration->configured);
  EXPECT_THAT(file.content, HasSubstr("ParameterValue=0x7D0\n"));
  EXPECT_EQ(write_device_file(plant, "pack:20", DeviceFileKind::dcf).content, file.content);
}

TEST(DeviceFile, TheConciseDcfHasThatAlone) {
  const DeviceFile file = write_device_file(demo(), "pack:20", DeviceFileKind::concise);
  ASSERT_TRUE(file.ok) << file.content;
  const auto writes = manager::read_concise_dcf(std::as_bytes(std::span(file.content)));
  ASSERT_TRUE(writes.ok());
  const auto acceleration =
      std::ranges::find(*writes, od::Address{0x6083, 0}, &manager::ObjectWrite::address);
  ASSERT_NE(acceleration, writes->end());
  EXPECT_EQ(acceleration->data,
            (std::vector<std::byte>{std::byte{0xD0}, std::byte{7}, std::byte{0}, std::byte{0}}));
}

TEST(DeviceFile, WhatIsNotThereIsSaid) {
  const config::Plant plant = demo();
  const auto why = [&](const char* of, DeviceFileKind kind) {
    const DeviceFile file = write_device_file(plant, of, kind);
    return file.ok ? "it is there" : file.content;
  };
  EXPECT_EQ(why("attic", DeviceFileKind::eds), "there is no line attic");
  EXPECT_EQ(why("press:5", DeviceFileKind::eds), "expected a line, got press:5");
  EXPECT_EQ(why("press", DeviceFileKind::dcf), "expected LINE:NODE, got press");
  EXPECT_EQ(why("press:99", DeviceFileKind::dcf), "line press has no node 99");
}

}  // namespace
}  // namespace linegate::gateway

// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/device_file.h"

#include <filesystem>
#include <fstream>
#include <span>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "stack/eds/reader.h"
#include "stack/line/line.h"
#include "stack/manager/plan.h"
#include "stack/od/dictionary.h"

#include "tests/gateway/plans.h"
#include "tests/paths.h"

namespace linegate::gateway {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;

config::Plant demo() {
  return *config::load(paths::in_repository("deploy/plants/demo.yaml")).value;
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
        variable.store = false;  // CiA 306 has no keyword for it
      }
      EXPECT_TRUE(objects[i] == expected[i]) << std::hex << expected[i].index;
    }
  }
}

TEST(DeviceFile, TheEdsOfADeviceOfTheLineIsForItsMaster) {
  const config::Plant plant =
      *config::load(paths::in_repository("deploy/plants/below-a-plc.yaml")).value;
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

// The configuration tool of a PLC reads the manufacturer's statements about the device from its
// EDS.
TEST(DeviceFile, TheEdsOfADeviceCarriesOverWhatItsSourceSays) {
  const std::string folder = testing::TempDir() + "/linegate-device-eds";
  std::filesystem::create_directories(folder);
  std::ofstream(folder + "/io.eds")
      << "[FileInfo]\nFileName=io.eds\nFileVersion=7\nCreatedBy=Somebody\nDescription=An I/O\n"
         "[DeviceInfo]\nVendorName=House\nOrderCode=IO-17\nBaudRate_125=1\nBaudRate_500=1\n"
         "SimpleBootUpSlave=1\nGranularity=1\nLSS_Supported=0\n"
         "[DummyUsage]\nDummy0001=0\nDummy0002=0\nDummy0003=0\nDummy0004=0\nDummy0005=1\n"
         "Dummy0006=0\nDummy0007=0\n[Comments]\nLines=1\nLine1=Mind the gap\n"
         "[MandatoryObjects]\nSupportedObjects=1\n1=0x1000\n"
         "[OptionalObjects]\nSupportedObjects=3\n1=0x1010\n2=0x6000\n3=0x6200\n"
         "[1000]\nParameterName=Type\nDataType=7\nAccessType=ro\nDefaultValue=0x30191\n"
         "[1010]\nParameterName=Store\nObjectType=8\nSubNumber=2\n"
         "[1010sub0]\nParameterName=n\nDataType=5\nAccessType=ro\nDefaultValue=1\n"
         "[1010sub1]\nParameterName=all\nDataType=7\nAccessType=rw\nDefaultValue=3\n"
         "[6000]\nParameterName=In\nDataType=5\nAccessType=ro\nPDOMapping=1\nDefaultValue=9\n"
         "[6200]\nParameterName=Out\nDataType=5\nAccessType=rww\nPDOMapping=1\nDefaultValue=8\n";
  for (const bool stores : {false, true}) {
    const auto loaded = config::read(
        "schema: 1\nlines:\n  - {name: plc, interface: 'virtual:p', role: device, " +
            std::string(stores ? "storage: store, " : "") +
            "devices: [{id: 7, name: io, eds: io.eds, lss: true, objects: {6200: 5}}]}\n",
        folder + "/plant.yaml");
    ASSERT_TRUE(loaded.ok()) << to_string(loaded.diagnostics.at(0));
    const DeviceFile file = write_device_file(*loaded.value, "plc:io", DeviceFileKind::eds);
    ASSERT_TRUE(file.ok) << file.content;
    const auto read = eds::read(file.content, "io.eds", 7);
    ASSERT_TRUE(read.ok()) << to_string(read.diagnostics.at(0));
    const eds::DataSheet& sheet = *read.value;
    EXPECT_EQ(sheet.file.file_version, "7");
    EXPECT_EQ(sheet.file.created_by, "Somebody");
    EXPECT_EQ(sheet.file.description, "An I/O");
    EXPECT_EQ(sheet.info.order_code, "IO-17");
    EXPECT_EQ(sheet.info.bit_rates, (std::vector<std::uint16_t>{125, 500}));
    EXPECT_TRUE(sheet.info.boot_up_slave);
    EXPECT_EQ(sheet.info.granularity, 1);
    EXPECT_TRUE(sheet.info.lss) << "the simulated device supports LSS";
    EXPECT_EQ(sheet.device.dummy_types, 1U << 5U);
    EXPECT_EQ(sheet.comments, std::vector<std::string>{"Mind the gap"});
    const od::Dictionary device(sheet.device);
    EXPECT_EQ(device.number({0x1010, 1}), stores ? 1U : 0U) << "the value that a client reads";
    EXPECT_TRUE(sheet.device.find(od::Address{0x6000, 0})->value.empty())
        << "process data have no default value";
    EXPECT_EQ(device.number({0x6200, 0}), 5U) << "the initial value is kept";
  }
  std::filesystem::remove_all(folder);
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

TEST(DeviceFile, TheEdsOfADeviceNeedsNoFileOfAnotherLine) {
  const std::string path = testing::TempDir() + "/two-lines.yaml";
  std::ofstream(path) << "schema: 1\n"
                         "forward: [{from: hall.x.6000:1, to: plc.panel.6200:1}]\n"
                         "lines:\n"
                         "  - name: hall\n    interface: 'virtual:hall'\n"
                         "    nodes: [{id: 5, name: x, eds: missing.eds}]\n"
                         "  - name: plc\n    interface: 'virtual:plc'\n    role: device\n"
                         "    enter: hall\n"
                         "    devices: [{id: 11, name: panel, eds: " +
                             paths::in_repository("bridges/sim/eds/digital-io.eds}]\n");
  testing::internal::CaptureStdout();
  const int code = print_device_file(path, "plc:panel", DeviceFileKind::eds);
  const std::string printed = testing::internal::GetCapturedStdout();
  EXPECT_EQ(code, 0);
  EXPECT_THAT(printed, HasSubstr("[DeviceInfo]"));
  testing::internal::CaptureStderr();
  EXPECT_EQ(print_device_file(path, "hall:x", DeviceFileKind::eds), 2)
      << "the node's own device file is missing";
  EXPECT_EQ(print_device_file(path, "attic:x", DeviceFileKind::eds), 2) << "no such line";
  EXPECT_THAT(testing::internal::GetCapturedStderr(), HasSubstr("missing.eds"));
  std::filesystem::remove(path);
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

TEST(DeviceFile, OfAnOwnDeviceIsNoDcf) {
  const config::Plant plant =
      *config::load(paths::in_repository("deploy/plants/below-a-plc.yaml")).value;
  for (const std::string name : {"10", "panel"}) {
    const DeviceFile file = write_device_file(plant, "plc:" + name, DeviceFileKind::dcf);
    EXPECT_FALSE(file.ok);
    EXPECT_EQ(file.content, name +
                                " is an own device of line plc, which the gateway does not "
                                "configure: linegate eds prints its EDS");
  }
}

}  // namespace
}  // namespace linegate::gateway

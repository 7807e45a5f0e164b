// SPDX-License-Identifier: Apache-2.0
// The files that `eds` and `dcf` of a node may name, and the files that these name in turn.
#include <filesystem>
#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "gateway/config/plant.h"

namespace linegate::config {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

class DownloadFile : public testing::Test {
 protected:
  DownloadFile() : folder_(testing::TempDir() + "linegate_device_file_" + test_name()) {
    std::filesystem::create_directories(folder_);
  }
  ~DownloadFile() override { std::filesystem::remove_all(folder_); }

  static std::string test_name() {
    return testing::UnitTest::GetInstance()->current_test_info()->name();
  }
  void write(const std::string& name, const std::string& content) const {
    std::ofstream(folder_ + "/" + name, std::ios::binary) << content;
  }
  // A plant with one node that has this device file.
  Loaded<Plant> plant(const std::string& file) const {
    return read(
        "schema: 1\nlines:\n  - name: press\n    interface: \"simulated:\"\n    nodes:\n"
        "      - {id: 5, name: x, dcf: " +
            file + "}\n",
        folder_ + "/plant.yaml");
  }

  std::string folder_;
};

constexpr std::string_view kDcf = R"([FileInfo]
[DeviceInfo]
[DeviceCommissioning]
NodeID=5
[OptionalObjects]
SupportedObjects=2
1=0x1000
2=0x2001
[1000]
ParameterName=Device type
DataType=7
AccessType=ro
[2001]
ParameterName=Program
ObjectType=2
DownloadFile=program.bin
)";

TEST_F(DownloadFile, IsWhatIsWrittenToTheDevice) {
  write("x.dcf", std::string(kDcf));
  write("program.bin", "four");
  const auto loaded = plant("x.dcf");
  ASSERT_TRUE(loaded.ok()) << to_string(loaded.diagnostics.at(0));
  const auto* program = loaded.value->lines.at(0).config.nodes.at(0).device.find({0x2001, 0});
  EXPECT_TRUE(program->configured);
  EXPECT_THAT(program->value,
              ElementsAre(std::byte{'f'}, std::byte{'o'}, std::byte{'u'}, std::byte{'r'}));
}

TEST_F(DownloadFile, ThatIsMissingOrDoesNotFitIsAnErrorInTheDeviceFile) {
  write("x.dcf", std::string(kDcf));
  auto loaded = plant("x.dcf");
  EXPECT_FALSE(loaded.ok());
  ASSERT_FALSE(loaded.diagnostics.empty());
  EXPECT_THAT(to_string(loaded.diagnostics.at(1)),
              HasSubstr("x.dcf:13: error: DownloadFile: there is no file"));

  std::string number(kDcf);
  number.replace(number.find("ObjectType=2"), 12, "AccessType=rw\nDataType=6");
  write("x.dcf", number);
  write("program.bin", "four");
  loaded = plant("x.dcf");
  EXPECT_FALSE(loaded.ok());
  EXPECT_THAT(to_string(loaded.diagnostics.at(1)),
              HasSubstr("program.bin has 4 bytes, UNSIGNED16 has 2"));
}

// A file of the kernel that can be opened, and whose reading fails with EIO as on a bad disk.
constexpr const char* kBadDisk = "/proc/self/mem";

TEST_F(DownloadFile, ThatFailsWhileItIsReadIsNoShortFile) {
  write("x.dcf", std::string(kDcf));
  std::filesystem::create_symlink(kBadDisk, folder_ + "/program.bin");
  auto loaded = plant("x.dcf");
  EXPECT_FALSE(loaded.ok());
  ASSERT_EQ(loaded.diagnostics.size(), 2U);
  EXPECT_THAT(to_string(loaded.diagnostics.at(1)), HasSubstr("x.dcf:13: error: DownloadFile: "));
  EXPECT_THAT(to_string(loaded.diagnostics.at(1)), HasSubstr("program.bin cannot be read"));

  loaded = plant(kBadDisk);
  EXPECT_FALSE(loaded.ok());
  ASSERT_FALSE(loaded.diagnostics.empty());
  EXPECT_THAT(to_string(loaded.diagnostics.at(0)), HasSubstr("/proc/self/mem cannot be read"));
}

TEST(PlantFile, ThatFailsWhileItIsReadIsNamed) {
  for (const std::string& path : {std::string(kBadDisk), testing::TempDir()}) {
    const auto loaded = load(path);
    EXPECT_FALSE(loaded.ok());
    ASSERT_EQ(loaded.diagnostics.size(), 1U);
    EXPECT_EQ(
        to_string(loaded.diagnostics.at(0)),
        path + ": error: cannot be read" + (path == kBadDisk ? "" : ": it is no regular file"));
  }
}

TEST_F(DownloadFile, OrAnXddOrXdcMayBeTheDeviceFile) {
  constexpr std::string_view kXdc = R"(<ISO15745ProfileContainer>
<ISO15745Profile><ProfileBody><DeviceIdentity><vendorName>L</vendorName></DeviceIdentity></ProfileBody></ISO15745Profile>
<ISO15745Profile><ProfileBody><ApplicationLayers><CANopenObjectList>
<CANopenObject index="1017" name="Heartbeat" objectType="7" dataType="0006" accessType="rw" actualValue="VALUE"/>
</CANopenObjectList></ApplicationLayers></ProfileBody></ISO15745Profile>
</ISO15745ProfileContainer>)";
  std::string text(kXdc);
  write("x.XDC", text.replace(text.find("VALUE"), 5, "500"));
  auto loaded = plant("x.XDC");
  ASSERT_TRUE(loaded.ok()) << to_string(loaded.diagnostics.at(0));
  EXPECT_TRUE(loaded.value->lines.at(0).config.nodes.at(0).device.find({0x1017, 0})->configured);

  write("x.XDC", std::string(kXdc));
  loaded = plant("x.XDC");
  EXPECT_FALSE(loaded.ok());
  EXPECT_THAT(to_string(loaded.diagnostics.at(1)),
              HasSubstr("x.XDC:4:93: error: ParameterValue: 'VALUE' is not a number"));
}

class NodeListOfALine : public DownloadFile {
 protected:
  Loaded<Plant> plant_with(const std::string& keys) const {
    return read("schema: 1\nlines:\n  - name: press\n    interface: \"simulated:\"\n" + keys,
                folder_ + "/plant.yaml");
  }
};

TEST_F(NodeListOfALine, GivesItsNodesWithTheirDcfs) {
  std::filesystem::create_directories(folder_ + "/devices");
  write("plant.cpj",
        "[Topology]\nNodes=9\n[Topology2]\nNodes=3\nEDSBaseName=devices\n"
        "Node7Present=1\nNode7Name=gear\nNode7DCFName=x.dcf\n"
        "Node6Present=1\nNode6Name=Pr\xE4zision\nNode6DCFName=x.dcf\n"
        "Node5Present=1\nNode5Name=other\nNode5DCFName=none.dcf\n");
  write("devices/x.dcf", std::string(kDcf));
  write("devices/program.bin", "four");
  const auto loaded = plant_with(
      "    node_list: {file: plant.cpj, network: 2}\n    nodes: [{id: 7, name: mine, dcf: "
      "devices/x.dcf}]\n");
  EXPECT_FALSE(loaded.ok()) << "node 5 has no DCF there";
  write("devices/none.dcf", std::string(kDcf));
  const auto second = plant_with(
      "    node_list: {file: plant.cpj, network: 2}\n    nodes: [{id: 7, name: mine, dcf: "
      "devices/x.dcf}]\n");
  ASSERT_TRUE(second.ok()) << to_string(second.diagnostics.at(0));
  const auto& nodes = second.value->lines.at(0).config.nodes;
  ASSERT_EQ(nodes.size(), 3U);
  EXPECT_EQ(nodes[0].name, "other");
  EXPECT_EQ(nodes[1].name, "node6");
  EXPECT_EQ(nodes[2].name, "mine") << "the key below nodes: takes precedence";
  EXPECT_EQ(nodes[1].device.node_id, 6);
  std::vector<std::string> said;
  for (const Diagnostic& diagnostic : second.diagnostics) {
    said.push_back(to_string(diagnostic));
  }
  EXPECT_THAT(said, testing::Contains(HasSubstr(
                        "plant.cpj:9: warning: \"Pr\xC3\xA4zision\" cannot be the name of a node; "
                        "node6 is used")));
}

TEST_F(NodeListOfALine, WhatIsWrongIsToldWithItsPlace) {
  const auto errors = [&](const std::string& keys) {
    const auto loaded = plant_with(keys);
    EXPECT_FALSE(loaded.ok()) << keys;
    std::string out;
    for (const Diagnostic& diagnostic : loaded.diagnostics) {
      out += diagnostic.severity == Severity::error ? to_string(diagnostic) + '\n' : "";
    }
    return out;
  };
  EXPECT_THAT(errors("    node_list: plant.cpj\n"),
              HasSubstr("plant.yaml:5:16: error: there is no file"));
  write("plant.cpj", "[Topology]\nNode5Present=1\n");
  EXPECT_THAT(errors("    node_list: plant.cpj\n"),
              HasSubstr("plant.cpj:2: error: node 5 has no DCFName"));
  EXPECT_THAT(errors("    node_list: {file: plant.cpj, network: 2}\n"),
              HasSubstr("plant.cpj has no network 2"));
  write("plant.cpj", "[Topology]\nNode5Present=x\n");
  EXPECT_THAT(errors("    node_list: plant.cpj\n"),
              HasSubstr("plant.cpj:2:14: error: Node5Present: 'x' is not a number"));
}

}  // namespace
}  // namespace linegate::config

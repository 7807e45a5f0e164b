// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/idl.h"

#include <filesystem>
#include <fstream>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include "bridges/named/ros2_types.h"
#include "gateway/config/whole_file.h"

#include "tests/gateway/plans.h"
#include "tests/paths.h"

namespace linegate::gateway {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

const std::string kFolder = paths::in_repository("tests/bridges/named/");

config::Plant plant_in(const std::string& file) {
  auto loaded = config::load(file);
  EXPECT_TRUE(loaded.value);
  return loaded.value ? *std::move(loaded.value) : config::Plant{};
}

std::string content_of(const std::string& file) {
  std::string why;
  return config::whole_file(file, why).value_or("");
}

// The file, which has its licence before the text, is compiled by fastddsgen (tests/dds) and by
// idlc (tests/interop). If a change is intended: `linegate idl every_type.yaml press`.
TEST(Idl, OfAPlantWithEveryTypeIsTheStoredOne) {
  const PlantIdl idl = idl_of(plant_in(kFolder + "every_type.yaml"), "press");
  EXPECT_THAT(idl.errors, IsEmpty());
  EXPECT_EQ("// SPDX-License-Identifier: Apache-2.0\n" + idl.text,
            content_of(kFolder + "every_type.idl"));
}

class Ros2Folder : public testing::Test {
 protected:
  Ros2Folder() : folder(testing::TempDir() + "linegate_ros2_" + std::to_string(::getpid())) {
    std::filesystem::remove_all(folder);
  }
  ~Ros2Folder() override { std::filesystem::remove_all(folder); }
  int write(const std::string& of = "press") const {
    return write_ros2_package(kFolder + "every_type.yaml", of, folder);
  }

  const std::string folder;
};

TEST_F(Ros2Folder, IsMadeAndReplaced) {
  EXPECT_EQ(write(), 0);
  EXPECT_THAT(content_of(folder + "/package.xml"), HasSubstr("<name>linegate_plant</name>"));
  const auto messages = named::ros2_messages_of(content_of(folder + "/CMakeLists.txt"));
  EXPECT_EQ(messages.size(), 10U);
  const std::string mine = folder + "/msg/Mine.msg";
  std::ofstream(mine) << "bool mine\n";
  std::ofstream(folder + "/package.xml", std::ios::app) << "<!-- edited -->\n";
  EXPECT_EQ(write("device"), 0);
  for (const std::string& message : messages) {
    EXPECT_FALSE(std::filesystem::exists(folder + '/' + message)) << message;
  }
  EXPECT_THAT(content_of(folder + "/CMakeLists.txt"), Not(HasSubstr("Press")));
  EXPECT_EQ(content_of(mine), "bool mine\n");
}

TEST_F(Ros2Folder, WithOtherFilesIsLeftAsItIs) {
  std::filesystem::create_directories(folder + "/msg");
  std::ofstream(folder + "/msg/Mine.msg") << "bool mine\n";
  EXPECT_EQ(write(), 2);
  EXPECT_EQ(content_of(folder + "/msg/Mine.msg"), "bool mine\n");
  EXPECT_FALSE(std::filesystem::exists(folder + "/package.xml"));
}

TEST_F(Ros2Folder, ThatCannotBeWrittenIsAFailure) {
  std::ofstream(folder) << "a file";
  EXPECT_EQ(write_ros2_package(kFolder + "every_type.yaml", "press", folder + "/x"), 1);
  EXPECT_EQ(content_of(folder), "a file");
}

TEST_F(Ros2Folder, OfAGroupAloneIsAnError) {
  EXPECT_EQ(write("press:all"), 2);
  EXPECT_FALSE(std::filesystem::exists(folder));
}

TEST(Idl, IsOfOneDeviceOrLineOrAll) {
  const config::Plant plant = plant_in(paths::in_repository("deploy/plants/demo.yaml"));
  const std::string ram = idl_of(plant, "press:ram").text;
  EXPECT_THAT(ram, HasSubstr("// plant/press/ram/inputs\n"));
  EXPECT_THAT(ram, HasSubstr("// plant/press/ram/outputs\n"));
  EXPECT_THAT(ram, Not(HasSubstr("feeder")));
  EXPECT_EQ(idl_of(plant, "1:5").text, ram);
  const std::string press = idl_of(plant, "press").text;
  EXPECT_THAT(press, HasSubstr("// plant/press/feeder/inputs\n"));
  EXPECT_THAT(press, HasSubstr("// plant/press/angle/inputs\n"));
  EXPECT_THAT(press, Not(HasSubstr("plant/hall")));
  EXPECT_THAT(idl_of(plant, "").text, HasSubstr("// plant/hall/doors/outputs\n"));
}

TEST(Idl, IsOfOneGroupThatIsWrittenByName) {
  const config::Plant plant = plant_in(kFolder + "every_type.yaml");
  const std::string text = idl_of(plant, "press:all").text;
  EXPECT_THAT(text, HasSubstr("\n// plant/press/all/outputs/set: group 1\n"));
  EXPECT_THAT(text, Not(HasSubstr("plant/press/every/")));
  EXPECT_THAT(idl_of(plant, "press:every").text, Not(HasSubstr("outputs/set")));
}

// The text of a device does not depend on other devices, lines and settings.
TEST(Idl, IsTheSameAfterUnrelatedEdits) {
  const std::string before = R"(schema: 1
lines:
  - name: press
    interface: "simulated:"
    nodes:
      - {id: 5, name: ram, eds: bridges/sim/eds/drive.eds}
)";
  const std::string after = R"(schema: 1
gateway: {name: other}
lines:
  - {name: hall, interface: "simulated:"}
  - name: press
    interface: "simulated:"
    network_id: 9
    node_id: 9
    publish: on_sync
    nodes:
      - {id: 3, name: doors, eds: bridges/sim/eds/digital-io.eds}
      - {id: 6, name: ram, eds: bridges/sim/eds/drive.eds, heartbeat: 1s}
)";
  const std::string text = idl_of(make_plant(before), "press:ram").text;
  EXPECT_THAT(text, HasSubstr("@final struct press_ram_inputs_"));
  EXPECT_EQ(idl_of(make_plant(after), "press:ram").text, text);
}

TEST(Idl, HasTheAliasesOfThePlant) {
  const config::Plant plant = make_plant(R"(schema: 1
lines:
  - name: press
    interface: "simulated:"
    named: {aliases: {ram.6041: State}}
    nodes: [{id: 5, name: ram, eds: bridges/sim/eds/drive.eds}]
)");
  EXPECT_THAT(idl_of(plant, "press:ram").text,
              HasSubstr("  unsigned short State;  // 6041:00 UNSIGNED16, PDO 1: Statusword\n"));
}

TEST(Idl, ReportsWhatThePlantDoesNotHave) {
  const config::Plant plant = plant_in(paths::in_repository("deploy/plants/demo.yaml"));
  EXPECT_THAT(idl_of(plant, "hull").errors, ElementsAre("there is no line hull"));
  EXPECT_THAT(idl_of(plant, "press:rum").errors,
              ElementsAre("press:rum has no process data in this plant"));
}

}  // namespace
}  // namespace linegate::gateway

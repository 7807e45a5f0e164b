// SPDX-License-Identifier: Apache-2.0
#include "bridges/named/ros2_types.h"

#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "bridges/named/sample_plan.h"

#include "tests/bridges/named/layouts.h"

namespace linegate::named {
namespace {

using od::DataType;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::MatchesRegex;
using testing::SizeIs;

Ros2Types messages_of(const std::string& line, const std::vector<TestEntry>& entries) {
  const DeviceTypes made = device_types(line, layout_of(entries));
  EXPECT_THAT(made.collisions, IsEmpty());
  return ros2_types(made.types);
}

struct NameRow {
  const char* line;
  const char* device;
  const char* topic;
  const char* message;  // without its hash
};

// What ROS 2 permits: tokens of letters, digits and single underscores that begin with a letter,
// messages of letters and digits that begin with a capital letter.
constexpr NameRow kNames[] = {
    {"press", "ram", "rt/plant/press/ram/inputs", "PressRamInputs"},
    {"hall-b", "mixing_station", "rt/plant/hall_b/mixing_station/inputs",
     "HallBMixingStationInputs"},
    {"1", "2-axis--drive_", "rt/plant/n1/n2_axis_drive/inputs", "N1N2AxisDriveInputs"},
    {"line", "class", "rt/plant/line/class_/inputs", "LineClassInputs"},
    {"LINE", "IO4", "rt/plant/LINE/IO4/inputs", "LINEIO4Inputs"},
};

TEST(Ros2Types, NamesOfTopicsAndMessages) {
  for (const NameRow& row : kNames) {
    SCOPED_TRACE(row.topic);
    const Ros2Types made = messages_of(
        row.line, {{.name = std::string(row.device) + ".A", .type = DataType::unsigned8}});
    EXPECT_THAT(made.collisions, IsEmpty());
    ASSERT_THAT(made.types, SizeIs(1));
    const DeviceType& message = made.types[0];
    EXPECT_EQ(message.topic(), row.topic);
    EXPECT_THAT(message.name, MatchesRegex(std::string(row.message) + "[0-9a-f]{16}"));
    EXPECT_EQ(message.type_name(), "linegate_plant::msg::dds_::" + message.name + "_");
  }
}

TEST(Ros2Types, NamesOfFields) {
  EXPECT_EQ(ros2_field("Position"), "position");
  EXPECT_EQ(ros2_field("Real_32_m_s"), "real_32_m_s");
  EXPECT_EQ(ros2_field("n24V_supply"), "n24v_supply");
  EXPECT_EQ(ros2_field("class_"), "class_value") << "a field does not end with an underscore";
}

// A reader of another layout has another type, as with named topics.
TEST(Ros2Types, TheHashIsThatOfTheNamedType) {
  const std::vector<TestEntry> entries{{.name = "ram.A", .type = DataType::unsigned8}};
  const DeviceTypes named = device_types("press", layout_of(entries));
  const std::string& name = named.types[0].name;
  EXPECT_THAT(messages_of("press", entries).types[0].name,
              testing::EndsWith(name.substr(name.size() - 16)));
}

TEST(Ros2Types, TwoDevicesWithOneTopicCollide) {
  const Ros2Types made =
      messages_of("press", {{.name = "a-b.A", .type = DataType::unsigned8},
                            {.name = "a_b.A", .type = DataType::unsigned8, .node = 6}});
  EXPECT_THAT(made.types, SizeIs(1));
  EXPECT_THAT(made.collisions,
              ElementsAre("inputs of line press, device a_b: another device has the topic "
                          "rt/plant/press/a_b/inputs of ROS 2, too: give it another name"));
}

TEST(Ros2Types, TwoFieldsWithOneNameCollide) {
  const Ros2Types made =
      messages_of("press", {{.name = "ram.class", .type = DataType::unsigned8},
                            {.name = "ram.Class value", .type = DataType::unsigned8}});
  EXPECT_THAT(made.types, IsEmpty());
  EXPECT_THAT(made.collisions,
              ElementsAre("inputs of line press, device ram: two members are called class_value in "
                          "ROS 2: give one of them an alias"));
}

TEST(Ros2Types, ANameWithoutLettersAndDigitsHasNoTopic) {
  const Ros2Types made = messages_of("press", {{.name = "_-.A", .type = DataType::unsigned8}});
  EXPECT_THAT(made.types, IsEmpty());
  EXPECT_THAT(made.collisions, ElementsAre(HasSubstr("ROS 2 needs names with letters or digits")));
}

// The same octets, without a key.
TEST(Ros2Types, ASampleIsThatOfTheNamedType) {
  const image::Layout layout =
      layout_of({{.name = "ram.A", .type = DataType::unsigned16, .bits = 16}});
  const DeviceTypes named = device_types("press", layout);
  const SamplePlan one(named.types[0], "plant");
  const SamplePlan other(ros2_types(named.types).types[0], "plant");
  EXPECT_FALSE(one.key().empty());
  EXPECT_TRUE(other.key().empty());
  image::Snapshot snapshot;
  snapshot.bytes = {std::byte{1}, std::byte{2}};
  snapshot.valid = {1};
  const std::int64_t time = 5;
  const SampleHead head{.incarnation = 7, .sequence_number = 1, .time = 9, .pdo_times = {&time, 1}};
  std::vector<std::byte> a(one.max_size());
  std::vector<std::byte> b(other.max_size());
  a.resize(one.write(head, snapshot, a));
  b.resize(other.write(head, snapshot, b));
  EXPECT_EQ(a, b);
}

TEST(Ros2Package, AnOutputHasItsReason) {
  image::Layout layout = layout_of({{.name = "ram.A", .type = DataType::unsigned16, .bits = 16}});
  layout.direction = image::Direction::outputs;
  const Ros2Types made = ros2_types(device_types("press", layout).types);
  const std::string name = made.types.at(0).name;
  const auto files = ros2_package(made.types);
  EXPECT_EQ(files.at("msg/" + name + "Waits.msg"), "uint8 a\n");
  EXPECT_THAT(files.at("msg/" + name + ".msg"),
              HasSubstr("Known known  # written, or has a default\n" + name + "Waits waits  #"));
}

TEST(Ros2Package, HasAMessageForEachStruct) {
  const Ros2Types made =
      messages_of("press", {{.name = "ram.Position", .type = DataType::integer32, .bits = 32},
                            {.name = "ram.Text", .type = DataType::visible_string, .bits = 64}});
  const std::string name = made.types[0].name;
  const auto files = ros2_package(made.types);
  EXPECT_THAT(files, SizeIs(6));
  EXPECT_EQ(files.at("msg/" + name + "Values.msg"),
            "int32 position  # 2000:00 INTEGER32, PDO 1: Position\n"
            "string<=16 text  # 2000:00 VISIBLE_STRING, 64 bits, PDO 1: Text\n");
  EXPECT_EQ(files.at("msg/" + name + "Valid.msg"), "bool position\nbool text\n");
  EXPECT_EQ(files.at("msg/" + name + "Received.msg"), "int64 pdo1\n");
  EXPECT_THAT(files.at("msg/" + name + ".msg"), HasSubstr("\n" + name + "Values values  #"));
  EXPECT_THAT(files.at("CMakeLists.txt"), HasSubstr("\n  \"msg/" + name + ".msg\"\n"));
  EXPECT_THAT(files.at("package.xml"), HasSubstr("<name>linegate_plant</name>"));
}

}  // namespace
}  // namespace linegate::named

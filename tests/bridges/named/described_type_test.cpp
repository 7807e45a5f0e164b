// SPDX-License-Identifier: Apache-2.0
#include "bridges/named/described_type.h"

#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "bridges/named/idl_text.h"
#include "bridges/named/ros2_types.h"

#include "tests/bridges/named/layouts.h"

namespace linegate::named {
namespace {

using od::DataType;
using testing::ElementsAre;
using testing::HasSubstr;

DeviceType type_of(image::Direction direction, const std::vector<TestEntry>& entries) {
  image::Layout layout = layout_of(entries);
  layout.direction = direction;
  return device_types("press", layout).types.at(0);
}

std::vector<std::string> names_of(const DeviceType& type) {
  std::vector<std::string> out;
  for (const DescribedMember& member : described_members(type)) {
    out.push_back(member.name);
  }
  return out;
}

const std::vector<TestEntry> kEntries = {
    {.name = "ram.Speed", .type = DataType::integer16, .bits = 16, .pdo = 1},
    {.name = "ram.Name", .type = DataType::visible_string, .bits = 32, .pdo = 3}};

// The order of the members in bridges/named/idl_text.cpp, without the structs.
TEST(DescribedType, HasTheMembersOfTheSampleWithoutStructs) {
  EXPECT_THAT(names_of(type_of(image::Direction::inputs, kEntries)),
              ElementsAre("gateway", "line", "incarnation", "sequence_number", "time", "clock",
                          "received_pdo1", "received_pdo3", "valid_Speed", "valid_Name",
                          "values_Speed", "values_Name"));
  EXPECT_THAT(
      names_of(type_of(image::Direction::outputs, kEntries)),
      ElementsAre("gateway", "line", "incarnation", "sequence_number", "time", "clock", "sent_pdo1",
                  "sent_pdo3", "valid_Speed", "valid_Name", "known_Speed", "known_Name",
                  "waits_Speed", "waits_Name", "values_Speed", "values_Name"));
}

// In each form of the type.
TEST(DescribedType, NamesSrdosAsSuch) {
  const DeviceType type =
      type_of(image::Direction::inputs, {{.name = "ram.Door", .bits = 8, .pdo = image::kFirstSrdo},
                                         {.name = "ram.Lock", .bits = 8, .pdo = image::kLastSrdo}});
  const std::vector<std::string> names = names_of(type);
  EXPECT_EQ(names.at(6), "received_srdo1");
  EXPECT_EQ(names.at(7), "received_srdo64");
  EXPECT_THAT(idl_text(std::span(&type, 1)),
              HasSubstr("_received {\n  long long srdo1;\n  long long srdo64;\n}"));
  std::string ros2;
  for (const auto& [file, text] : ros2_package(std::span(&type, 1))) {
    ros2 += text;
  }
  EXPECT_THAT(ros2, HasSubstr("int64 srdo1\nint64 srdo64\n"));
}

TEST(DescribedType, HasTheFormsOfTheMembers) {
  const auto members = described_members(type_of(image::Direction::inputs, kEntries));
  EXPECT_EQ(members[0], (DescribedMember{"gateway", Form::text, 64}));
  EXPECT_EQ(members[10], (DescribedMember{"values_Speed", Form::int16, 0}));
  EXPECT_EQ(members[11], (DescribedMember{"values_Name", Form::text, 8})) << "in UTF-8";
}

TEST(DescribedType, IsBoundedByWhatFitsADatagram) {
  std::vector<TestEntry> entries;
  for (int i = 0; i < 200; ++i) {
    entries.push_back({.name = "ram.Object " + std::to_string(i), .bits = 8});
  }
  EXPECT_TRUE(can_be_described(type_of(image::Direction::inputs, entries)));
  for (TestEntry& entry : entries) {
    entry.name += std::string(100, 'x');
  }
  EXPECT_FALSE(can_be_described(type_of(image::Direction::inputs, entries)));
}

TEST(DescribedType, IsNotThatOfAMessageOfRos2) {
  std::vector<DeviceType> types = {type_of(image::Direction::inputs, kEntries)};
  types[0].described = true;
  const Ros2Types made = ros2_types(types);
  ASSERT_EQ(made.types.size(), 1U);
  EXPECT_FALSE(made.types[0].described);
}

}  // namespace
}  // namespace linegate::named

// SPDX-License-Identifier: Apache-2.0
// The types of groups that are written by name: their members and their names.
#include "bridges/named/group_types.h"

#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "bridges/named/idl_text.h"

#include "tests/bridges/named/layouts.h"

namespace linegate::named {
namespace {

using od::DataType;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

// Outputs of two devices.
image::Layout outputs() {
  image::Layout layout = layout_of({{"ram.Controlword", DataType::unsigned16, 16, 5, 1, 0x6040},
                                    {"ram.Target", DataType::integer32, 32, 5, 1, 0x607A},
                                    {"io-1.Lamp", DataType::boolean, 1, 6, 2, 0x6200, 1}});
  layout.direction = image::Direction::outputs;
  layout.id = 0xABC;
  return layout;
}

GroupType type_of(const image::Layout& layout, const Group& group) {
  GroupTypes made = group_types("press", layout, std::span(&group, 1));
  EXPECT_THAT(made.collisions, IsEmpty());
  return made.types.empty() ? GroupType{} : made.types.front();
}

TEST(GroupTypes, HaveAMemberForEachOutputInTheOrderOfTheLayout) {
  const GroupType type = type_of(outputs(), {"drives", 3, {2, 0}});
  EXPECT_EQ(type.topic(), "plant/press/drives/outputs/set");
  EXPECT_TRUE(type.type_name().starts_with("plant::press_drives_set_")) << type.type_name();
  EXPECT_EQ(type.number, 3);
  EXPECT_EQ(type.layout_id, 0xABCU);
  ASSERT_EQ(type.members.size(), 2U);
  EXPECT_EQ(type.members[0].identifier, "ram_Controlword");
  EXPECT_EQ(type.members[0].entry, 0U);
  EXPECT_EQ(type.members[0].form, Form::uint16);
  EXPECT_EQ(type.members[1].identifier, "io_1_Lamp");
  EXPECT_EQ(type.members[1].form, Form::boolean);
}

TEST(GroupTypes, HaveTheAliasesOfTheLine) {
  const Group group{"drives", 3, {0}};
  const std::vector<Alias> aliases{{image::Direction::outputs, "ram.Controlword", "Control"}};
  const GroupTypes made = group_types("press", outputs(), std::span(&group, 1), aliases);
  ASSERT_EQ(made.types.size(), 1U);
  EXPECT_EQ(made.types[0].members[0].identifier, "ram_Control");
}

TEST(GroupTypes, HaveANameThatDependsOnWhatAWriterMustKnow) {
  const std::string name = type_of(outputs(), {"drives", 3, {0, 1}}).name;
  EXPECT_EQ(type_of(outputs(), {"drives", 3, {1, 0}}).name, name);
  EXPECT_NE(type_of(outputs(), {"drives", 3, {0}}).name, name);
  EXPECT_NE(type_of(outputs(), {"drives", 4, {0, 1}}).name, name);
  image::Layout moved = outputs();
  moved.id = 7;
  moved.entries.insert(moved.entries.begin(), moved.entries.back());
  moved.entries.front().name = "lamp.Other";
  EXPECT_EQ(type_of(moved, {"drives", 3, {1, 2}}).name, name);
  image::Layout other = outputs();
  other.entries[1].type = DataType::unsigned32;
  EXPECT_NE(type_of(other, {"drives", 3, {0, 1}}).name, name);
}

TEST(GroupTypes, DoNotExistForOutputsThatCannotBeMembers) {
  image::Layout layout = layout_of({{"a-b.X", DataType::unsigned8, 8, 5},
                                    {"a_b.x", DataType::unsigned8, 8, 6},
                                    {"ram.++", DataType::unsigned8, 8, 7},
                                    {"ram.Long", DataType::domain, 8 * 33, 7}});
  layout.direction = image::Direction::outputs;
  const std::vector<Group> groups{{"none", 1, {}}, {"all", 2, {0, 1, 2, 3}}, {"good", 3, {0}}};
  const GroupTypes made = group_types("press", layout, groups);
  EXPECT_THAT(
      made.collisions,
      ElementsAre("group none has no named topic: it has no outputs",
                  "group all has no named topic: \"a_b.x\" and \"a-b.X\" make the same identifier "
                  "a_b_x: give one of them an alias",
                  "group all has no named topic: \"ram.++\" makes no identifier: give it an alias",
                  "group all has no named topic: \"ram.Long\" is longer than 32 octets"));
  ASSERT_EQ(made.types.size(), 1U);
  EXPECT_EQ(made.types[0].group, "good");
}

TEST(GroupTypes, AreStructsOfIdl) {
  const GroupType type = type_of(outputs(), {"drives", 3, {0, 2}});
  const std::string text = idl_text({}, std::span(&type, 1));
  EXPECT_THAT(text, HasSubstr("module plant {\n\n// plant/press/drives/outputs/set: group 3\n\n"
                              "@final struct " +
                              type.name +
                              "_values {\n"
                              "  unsigned short ram_Controlword;  // 6040:00 UNSIGNED16, PDO 1: "
                              "ram.Controlword\n"
                              "  boolean io_1_Lamp;  // 6200:01 BOOLEAN, PDO 2: io-1.Lamp\n};\n"));
  EXPECT_THAT(text, HasSubstr("_given {\n  boolean ram_Controlword;\n  boolean io_1_Lamp;\n};\n"));
  EXPECT_THAT(text, HasSubstr("@final struct " + type.name + " {\n  @key string<64> gateway;\n"));
  EXPECT_THAT(text, HasSubstr("  @key unsigned short group;  // 3\n"));
}

}  // namespace
}  // namespace linegate::named

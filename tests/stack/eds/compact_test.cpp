// SPDX-License-Identifier: Apache-2.0
// CompactSubObj of CiA 306: many equal sub-indices in few lines.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/stack/eds/files.h"

namespace linegate::eds {
namespace {

using od::Access;
using od::DataType;
using test::bytes;
using testing::IsEmpty;

constexpr std::string_view kConsumers =
    "[OptionalObjects]\n"
    "SupportedObjects=1\n"
    "1=0x1016\n"
    "[1016]\n"
    "ParameterName=Heartbeat consumer\n"
    "ObjectType=8\n"
    "DataType=0x0007\n"
    "AccessType=rw\n"
    "DefaultValue=0x10\n"
    "PDOMapping=1\n"
    "CompactSubObj=3\n"
    "[1016Name]\n"
    "NrOfEntries=1\n"
    "2=of the master\n"
    "[1016Value]\n"
    "NrOfEntries=1\n"
    "3=0x00010064\n";

TEST(CompactSubObj, EverySubIndexIsAsTheObjectSays) {
  const auto loaded = load(test::file_with(kConsumers), "x.eds", 5);
  ASSERT_TRUE(loaded.ok());
  EXPECT_THAT(test::messages(loaded.diagnostics), IsEmpty());
  const od::ObjectDescription* object = loaded.value->find(0x1016);
  ASSERT_EQ(object->variables.size(), 4U);
  EXPECT_EQ(object->variables[0].type, DataType::unsigned8);
  EXPECT_EQ(object->variables[0].access, Access::ro);
  EXPECT_EQ(object->variables[0].value, bytes({3}));
  EXPECT_FALSE(object->variables[0].mappable);
  for (unsigned sub = 1; sub <= 3; ++sub) {
    EXPECT_EQ(object->variables[sub].sub, sub);
    EXPECT_EQ(object->variables[sub].type, DataType::unsigned32);
    EXPECT_EQ(object->variables[sub].access, Access::rw);
    EXPECT_TRUE(object->variables[sub].mappable);
    EXPECT_FALSE(object->variables[sub].configured);
  }
  EXPECT_EQ(object->variables[1].name, "Heartbeat consumer1");
  EXPECT_EQ(object->variables[2].name, "of the master");
  EXPECT_EQ(object->variables[1].value, bytes({0x10, 0, 0, 0}));
  EXPECT_EQ(object->variables[3].value, bytes({0x64, 0, 1, 0}));
}

TEST(CompactSubObj, ValuesOfADcfAreConfigured) {
  const auto loaded = load(
      test::file_with(std::string(kConsumers) + "[DeviceCommissioning]\nNodeID=5\n"), "x.dcf", 0);
  ASSERT_TRUE(loaded.ok());
  EXPECT_FALSE(loaded.value->find({0x1016, 2})->configured);
  EXPECT_TRUE(loaded.value->find({0x1016, 3})->configured);
}

TEST(CompactSubObj, ASectionOfItsOwnCountsMore) {
  const auto loaded =
      load(test::file_with(std::string(kConsumers) +
                           "[1016sub2]\nParameterName=own\nDataType=6\nAccessType=ro\n"),
           "x.eds", 5);
  ASSERT_TRUE(loaded.ok());
  EXPECT_EQ(loaded.value->find({0x1016, 2})->name, "own");
  EXPECT_EQ(loaded.value->find({0x1016, 2})->type, DataType::unsigned16);
}

TEST(CompactSubObj, KeysThatAreNoSubIndexAreTold) {
  EXPECT_THAT(test::messages(test::file_with(std::string(kConsumers) + "4=1\n0=1\nx=1\n")),
              testing::ElementsAre(
                  "x.eds:31:1: warning: key '4' is not a sub-index of the object; ignored",
                  "x.eds:32:1: warning: key '0' is not a sub-index of the object; ignored",
                  "x.eds:33:1: warning: key 'x' is not a sub-index of the object; ignored"));
}

TEST(CompactSubObj, MoreThan254SubIndicesAreRefused) {
  std::string text = test::file_with(kConsumers);
  text.replace(text.find("CompactSubObj=3"), 15, "CompactSubObj=255");
  EXPECT_THAT(test::messages(text),
              testing::ElementsAre(
                  "x.eds:17:1: warning: '1016' has no sub-indices; it is left out",
                  "x.eds:24:15: warning: CompactSubObj: '255' is not in 0 to 254; ignored"));
}

// A file of a few megabytes could describe gigabytes of objects.
TEST(CompactSubObj, WhatTheyMakeOfAFileIsBounded) {
  std::string objects;
  for (const char* index : {"2001", "2002", "2003"}) {
    objects += std::string("[") + index + "]\nParameterName=" + std::string(150'000, 'n') +
               "\nObjectType=8\nDataType=5\nAccessType=rw\nCompactSubObj=254\n";
  }
  const auto loaded = load(test::file_with(objects), "x.eds", 5);
  EXPECT_FALSE(loaded.ok());
  const auto is_error = [](const Diagnostic& d) { return d.severity == Severity::error; };
  EXPECT_EQ(std::ranges::count_if(loaded.diagnostics, is_error), 1);
  const auto error = std::ranges::find_if(loaded.diagnostics, is_error);
  ASSERT_NE(error, loaded.diagnostics.end());
  EXPECT_EQ(error->line, 25U) << "the line of the second object";
  EXPECT_EQ(error->file, "x.eds");
  EXPECT_THAT(error->text, testing::HasSubstr("more than 64 MB"));
}

}  // namespace
}  // namespace linegate::eds

// SPDX-License-Identifier: Apache-2.0
// Short descriptions of many objects: modular devices, and CompactPDO.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/stack/eds/files.h"

namespace linegate::eds {
namespace {

using od::Access;
using od::DataType;
using test::bytes;
using test::file_with;
using test::messages;
using testing::ElementsAre;
using testing::IsEmpty;

// Two types of module: eight inputs, and two inputs that share a byte with the inputs of other
// modules. Lines 14 to 54.
constexpr std::string_view kModules = R"([SupportedModules]
NrOfEntries=2
[M1ModuleInfo]
ProductName=DI8
ProductVersion=1
ProductRevision=2
OrderCode=4711
[M1Comments]
Lines=2
Line1=Eight inputs,
Line2=one filter
[M1FixedObjects]
NrOfEntries=1
1=0x6003
[M1Fixed6003]
ParameterName=Filter
ObjectType=8
SubNumber=2
[M1Fixed6003sub0]
ParameterName=Number
DataType=5
AccessType=ro
DefaultValue=1
[M1Fixed6003sub1]
ParameterName=Filter of all
DataType=5
AccessType=rw
[M1SubExtends]
NrOfEntries=1
1=0x6000
[M1SubExt6000]
ParameterName=Inputs
DataType=5
AccessType=ro
PDOMapping=1
Count=1
[M2ModuleInfo]
ProductName=DI2
[M2SubExt6010]
ParameterName=Pairs
DataType=5
AccessType=ro
Count=0;2
ObjExtend=2
)";

std::string dcf(std::string_view connected) {
  return file_with(std::string(kModules) + "[DeviceCommissioning]\nNodeID=5\n[ConnectedModules]\n" +
                   std::string(connected));
}

TEST(Modules, AreKeptAsDescribed) {
  const auto sheet = read(file_with(kModules), "x.eds", 5);
  ASSERT_TRUE(sheet.ok());
  EXPECT_THAT(messages(sheet.diagnostics), IsEmpty());
  ASSERT_EQ(sheet.value->modules.size(), 2U);
  const Module& module = sheet.value->modules[0];
  EXPECT_EQ(module.number, 1);
  EXPECT_EQ(module.product_name, "DI8");
  EXPECT_EQ(module.product_version, "1");
  EXPECT_EQ(module.product_revision, "2");
  EXPECT_EQ(module.order_code, "4711");
  EXPECT_THAT(module.comments, ElementsAre("Eight inputs,", "one filter"));
  ASSERT_EQ(module.fixed_objects.size(), 1U);
  EXPECT_EQ(module.fixed_objects[0].index, 0x6003);
  EXPECT_EQ(module.fixed_objects[0].variables.size(), 2U);
  ASSERT_EQ(module.extensions.size(), 1U);
  EXPECT_EQ(module.extensions[0].index, 0x6000);
  EXPECT_EQ(module.extensions[0].count, 1);
  EXPECT_TRUE(module.extensions[0].pattern.mappable);
  EXPECT_EQ(sheet.value->modules[1].extensions.at(0).count, 0);
  EXPECT_EQ(sheet.value->modules[1].extensions.at(0).bits, 2);
  EXPECT_EQ(sheet.value->modules[1].extensions.at(0).extend, 2);
  EXPECT_EQ(sheet.value->device.objects.size(), 1U) << "no module is connected";
}

TEST(Modules, EachConnectedOneExtendsTheObjectAndFixedOnesComeOnce) {
  const auto sheet = read(dcf("NrOfEntries=3\n3=1\n1=1\n2=2\n"), "x.dcf", 5);
  ASSERT_TRUE(sheet.ok());
  EXPECT_THAT(messages(sheet.diagnostics), IsEmpty());
  EXPECT_THAT(sheet.value->connected_modules, ElementsAre(1, 2, 1));
  const od::DeviceDescription& device = sheet.value->device;
  ASSERT_NE(device.find(0x6000), nullptr);
  EXPECT_EQ(device.find(0x6000)->type, od::ObjectType::array);
  EXPECT_EQ(device.find(0x6000)->name, "Inputs");
  ASSERT_EQ(device.find(0x6000)->variables.size(), 3U);
  EXPECT_EQ(device.find({0x6000, 0})->value, bytes({2}));
  EXPECT_EQ(device.find({0x6000, 1})->name, "Inputs1");
  EXPECT_EQ(device.find({0x6000, 2})->type, DataType::unsigned8);
  EXPECT_EQ(device.find({0x6000, 2})->access, Access::ro);
  EXPECT_TRUE(device.find({0x6000, 2})->mappable);
  EXPECT_EQ(device.find(0x6003)->variables.size(), 2U);
}

TEST(Modules, ShareASubIndexByBitsAndGoOnInTheNextObject) {
  // Four modules of two bits fill a byte; after two bytes the next object begins.
  std::string nine = "NrOfEntries=9\n";
  for (int n = 1; n <= 9; ++n) {
    nine += std::to_string(n) + "=2\n";
  }
  const auto sheet = read(dcf(nine), "x.dcf", 5);
  ASSERT_TRUE(sheet.ok());
  EXPECT_EQ(sheet.value->device.find({0x6010, 0})->value, bytes({2}));
  EXPECT_NE(sheet.value->device.find({0x6010, 2}), nullptr);
  EXPECT_EQ(sheet.value->device.find({0x6010, 3}), nullptr);
  EXPECT_EQ(sheet.value->device.find({0x6011, 0})->value, bytes({1}));
  EXPECT_NE(sheet.value->device.find({0x6011, 1}), nullptr);
}

TEST(Modules, ASectionOfItsOwnCountsMore) {
  const auto sheet =
      read(dcf("NrOfEntries=2\n1=1\n2=1\n[6000]\nParameterName=In\nObjectType=8\nSubNumber=2\n"
               "[6000sub0]\nParameterName=n\nDataType=5\nAccessType=ro\n"
               "[6000sub1]\nParameterName=Gate\nDataType=5\nAccessType=ro\n"),
           "x.dcf", 5);
  ASSERT_TRUE(sheet.ok());
  EXPECT_EQ(sheet.value->device.find({0x6000, 1})->name, "Gate");
  EXPECT_EQ(sheet.value->device.find({0x6000, 2})->name, "Inputs2");
  EXPECT_EQ(sheet.value->device.find({0x6000, 0})->value, bytes({2}));
}

TEST(Modules, WhatIsWrongIsToldWithItsLine) {
  EXPECT_THAT(messages(dcf("NrOfEntries=1\n1=7\n")),
              ElementsAre("x.eds:60:1: error: module 7 is connected, but not described"));
  EXPECT_THAT(messages(file_with("[SupportedModules]\nNrOfEntries=1\n[M1Fixed600]\n[M1SubExtxx]\n"
                                 "[M1FixedObjects]\n1=0x6003\n[M0ModuleInfo]\n[M1Whatever]\n"
                                 "[M1SubExt6000]\nParameterName=a\nDataType=5\nAccessType=ro\n"
                                 "Count=0\n")),
              ElementsAre("x.eds:16:1: warning: section 'M1Fixed600' is ignored: its name is not "
                          "known",
                          "x.eds:17:1: warning: section 'M1SubExtxx' is ignored: its index is not "
                          "in 1h to FFFFh",
                          "x.eds:19:3: warning: object 6003h of the module is listed, but has no "
                          "section",
                          "x.eds:20:1: warning: section 'M0ModuleInfo' is ignored: its number is "
                          "not in 1 to 65535",
                          "x.eds:21:1: warning: section 'M1Whatever' is ignored: its name is not "
                          "known",
                          "x.eds:26:7: warning: Count: '0' is neither a number of sub-indices nor "
                          "0;bits; taken as 1"));
}

std::string with_compact_pdos(std::string_view keys, std::string_view more = "") {
  std::string text = file_with(more);
  text.insert(text.find("[MandatoryObjects]"), keys);
  return text;
}

TEST(CompactPdo, MakesTheRecordsThatNobodyDescribes) {
  const auto loaded =
      load(with_compact_pdos("NrOfRXPDO=5\nNrOfTXPDO=1\nCompactPDO=0x13\n"), "x.eds", 5);
  EXPECT_THAT(messages(loaded.diagnostics), IsEmpty());
  ASSERT_TRUE(loaded.ok());
  const od::DeviceDescription& device = *loaded.value;
  std::vector<std::uint16_t> indices;
  for (const od::ObjectDescription& object : device.objects) {
    indices.push_back(object.index);
  }
  EXPECT_THAT(indices, ElementsAre(0x1000, 0x1400, 0x1401, 0x1402, 0x1403, 0x1404, 0x1600, 0x1601,
                                   0x1602, 0x1603, 0x1604, 0x1800, 0x1A00));
  // The mask selects COB-ID, transmission type and event timer.
  std::vector<unsigned> subs;
  for (const od::VariableDescription& variable : device.find(0x1800)->variables) {
    subs.push_back(variable.sub);
  }
  EXPECT_THAT(subs, ElementsAre(0, 1, 2, 5));
  EXPECT_EQ(device.find({0x1800, 0})->value, bytes({5}));
  EXPECT_EQ(device.find({0x1800, 1})->value, bytes({0x85, 0x01, 0, 0}));
  EXPECT_EQ(device.find({0x1403, 1})->value, bytes({0x05, 0x05, 0, 0}));
  EXPECT_EQ(device.find({0x1404, 1})->value, bytes({0, 0, 0, 0x80}));
  EXPECT_EQ(device.find({0x1800, 5})->type, DataType::unsigned16);
  EXPECT_EQ(device.find(0x1A00)->variables.size(), 65U);
  EXPECT_EQ(device.find({0x1A00, 0})->value, bytes({0}));
  EXPECT_EQ(device.find({0x1A00, 64})->type, DataType::unsigned32);
}

TEST(CompactPdo, CountsAndCompletesThoseThatAreDescribed) {
  const auto loaded = load(
      with_compact_pdos("NrOfTXPDO=2\nCompactPDO=3\n",
                        "[1A02]\nParameterName=m\nObjectType=9\nSubNumber=1\n"
                        "[1A02sub0]\nParameterName=n\nDataType=5\nAccessType=rw\nDefaultValue=0\n"),
      "x.eds", 5);
  ASSERT_TRUE(loaded.ok());
  EXPECT_NE(loaded.value->find(0x1800), nullptr);
  EXPECT_EQ(loaded.value->find(0x1801), nullptr);
  EXPECT_NE(loaded.value->find(0x1802), nullptr);
  EXPECT_EQ(loaded.value->find(0x1A02)->variables.size(), 1U);
}

TEST(CompactPdo, NeedsANodeId) {
  EXPECT_THAT(messages(with_compact_pdos("NrOfRXPDO=1\nCompactPDO=1\n"), 0),
              ElementsAre("x.eds:7:12: error: CompactPDO: the COB-IDs depend on the node-ID, but "
                          "none is given"));
}

}  // namespace
}  // namespace linegate::eds

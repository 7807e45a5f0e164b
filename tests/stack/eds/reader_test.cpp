// SPDX-License-Identifier: Apache-2.0
#include "stack/eds/reader.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "stack/od/dictionary.h"

#include "tests/stack/eds/files.h"

namespace linegate::eds {
namespace {

using od::Access;
using od::DataType;
using od::ObjectType;
using test::bytes;
using testing::ElementsAre;
using testing::IsEmpty;

constexpr std::string_view kEncoder = R"([FileInfo]
FileName=encoder.eds
FileVersion=1
EDSVersion=4.0

[DeviceInfo]
VendorName=Linegate
VendorNumber=0x0000AFFE
ProductName=Encoder
ProductNumber=0x10
RevisionNumber=3
Granularity=8
NrOfTXPDO=1

[DummyUsage]
Dummy0001=0
Dummy0002=0
Dummy0003=0
Dummy0004=0
Dummy0005=1
Dummy0006=1
Dummy0007=0

[Comments]
Lines=1
Line1=one line

[MandatoryObjects]
SupportedObjects=2
1=0x1000
2=0x1018

[OptionalObjects]
SupportedObjects=3
1=0x1800
2=0x1A00
3=0x6004

[ManufacturerObjects]
SupportedObjects=1
1=0x2000

[1000]
ParameterName=Device type
ObjectType=0x7
DataType=0x0007
AccessType=ro
DefaultValue=0x00010196
PDOMapping=0

[1018]
ParameterName=Identity object
ObjectType=0x9
SubNumber=2

[1018sub0]
ParameterName=Highest sub-index
ObjectType=0x7
DataType=0x0005
AccessType=const
DefaultValue=1
PDOMapping=0

[1018sub1]
ParameterName=Vendor-ID
ObjectType=0x7
DataType=0x0007
AccessType=ro
DefaultValue=0xAFFE
PDOMapping=0

[1800]
ParameterName=TPDO 1 communication
ObjectType=0x9
SubNumber=3

[1800sub0]
ParameterName=Highest sub-index
DataType=0x0005
AccessType=ro

[1800sub1]
ParameterName=COB-ID
DataType=0x0007
AccessType=rw
DefaultValue=$NODEID+0x180
LowLimit=0x181
HighLimit=0xFFFFFFFF

[1800sub5]
ParameterName=Event timer
DataType=0x0006
AccessType=rw
LowLimit=10
HighLimit=60000
DefaultValue=1000

[1A00]
ParameterName=TPDO 1 mapping
ObjectType=0x9
SubNumber=2

[1A00sub0]
ParameterName=Number of mapped objects
DataType=0x0005
AccessType=rw

[1A00sub1]
ParameterName=First
DataType=0x0007
AccessType=rw
DefaultValue=0x60040020

[6004]
ParameterName=Position value
ObjectType=7
DataType=0x0004
AccessType=rwr
DefaultValue=-5
LowLimit=-100
HighLimit=100
PDOMapping=1

[2000]
ParameterName=Firmware
ObjectType=2
)";

const od::DeviceDescription& encoder() {
  static const Loaded<od::DeviceDescription> loaded = load(kEncoder, "encoder.eds", 5);
  return loaded.value.value();
}

TEST(Reader, AFileInOrderGivesNoMessages) {
  const auto loaded = load(kEncoder, "encoder.eds", 5);
  EXPECT_TRUE(loaded.ok());
  EXPECT_THAT(test::messages(loaded.diagnostics), IsEmpty());
}

TEST(Reader, TellsWhoTheDeviceIs) {
  const od::DeviceDescription& device = encoder();
  EXPECT_EQ(device.file, "encoder.eds");
  EXPECT_EQ(device.vendor_name, "Linegate");
  EXPECT_EQ(device.product_name, "Encoder");
  EXPECT_EQ(device.vendor_number, 0xAFFEU);
  EXPECT_EQ(device.product_number, 0x10U);
  EXPECT_EQ(device.revision_number, 3U);
  EXPECT_EQ(device.node_id, 5);
  EXPECT_TRUE(device.dynamic_mapping);
  EXPECT_EQ(device.dummy_types, 0x60U);
}

TEST(Reader, ObjectsComeAscendingWithNamesTypesAndLines) {
  std::vector<std::uint16_t> indices;
  for (const od::ObjectDescription& object : encoder().objects) {
    indices.push_back(object.index);
  }
  EXPECT_THAT(indices, ElementsAre(0x1000, 0x1018, 0x1800, 0x1A00, 0x2000, 0x6004));
  const od::ObjectDescription* identity = encoder().find(0x1018);
  EXPECT_EQ(identity->name, "Identity object");
  EXPECT_EQ(identity->type, ObjectType::record);
  EXPECT_EQ(identity->line, 51U);
  EXPECT_EQ(identity->variables.at(1).line, 64U);
  EXPECT_EQ(encoder().find(0x1000)->type, ObjectType::variable);
}

TEST(Reader, VariablesHaveTypeAccessMappingValueAndLimits) {
  const od::VariableDescription* position = encoder().find({0x6004, 0});
  ASSERT_NE(position, nullptr);
  EXPECT_EQ(position->name, "Position value");
  EXPECT_EQ(position->type, DataType::integer32);
  EXPECT_EQ(position->access, Access::rwr);
  EXPECT_TRUE(position->mappable);
  EXPECT_EQ(position->value, bytes({0xFB, 0xFF, 0xFF, 0xFF}));
  EXPECT_EQ(position->low_limit, bytes({0x9C, 0xFF, 0xFF, 0xFF}));
  EXPECT_EQ(position->high_limit, bytes({100, 0, 0, 0}));
  EXPECT_FALSE(position->configured);
  EXPECT_FALSE(encoder().find({0x1000, 0})->mappable);
  EXPECT_EQ(encoder().find({0x1018, 0})->access, Access::constant);
}

TEST(Reader, FormulasAreResolvedWithTheNodeId) {
  EXPECT_EQ(encoder().find({0x1800, 1})->value, bytes({0x85, 1, 0, 0}));
}

TEST(Reader, SubZeroWithoutAValueIsTheHighestSubIndexButMappingsStartEmpty) {
  EXPECT_EQ(encoder().find({0x1800, 0})->value, bytes({5}));
  EXPECT_THAT(encoder().find({0x1A00, 0})->value, IsEmpty());
}

TEST(Reader, ADomainNeedsNoDataTypeAndNoAccessType) {
  const od::VariableDescription* firmware = encoder().find({0x2000, 0});
  ASSERT_NE(firmware, nullptr);
  EXPECT_EQ(firmware->type, DataType::domain);
  EXPECT_EQ(firmware->access, Access::rw);
}

TEST(Reader, WhatIsReadMakesADictionary) {  // 1002h, 1008h, 1027h
  const od::Dictionary dictionary(encoder());
  EXPECT_EQ(dictionary.indices().size(), encoder().objects.size());
  EXPECT_EQ(dictionary.number({0x1800, 5}), 1000U);
}

TEST(Reader, GranularityZeroIsStaticMapping) {
  std::string text(kEncoder);
  text.replace(text.find("Granularity=8"), 13, "Granularity=0");
  EXPECT_FALSE(load(text, "x.eds", 5).value.value().dynamic_mapping);
}

TEST(Reader, TheIdentityObjectStandsInForDeviceInfo) {
  std::string text(kEncoder);
  text.replace(text.find("VendorNumber=0x0000AFFE"), 23, "VendorNumber=");
  EXPECT_EQ(load(text, "x.eds", 5).value.value().vendor_number, 0xAFFEU);
}

TEST(Reader, UnderstandsEveryAccessType) {
  const std::pair<const char*, Access> table[] = {
      {"ro", Access::ro},   {"wo", Access::wo},   {"rw", Access::rw},
      {"rwr", Access::rwr}, {"rww", Access::rww}, {"const", Access::constant}};
  for (const auto& [word, access] : table) {
    const auto loaded = load(
        test::file_with("[2000]\nParameterName=a\nDataType=5\nAccessType=" + std::string(word)),
        "x.eds", 5);
    EXPECT_EQ(loaded.value.value().find({0x2000, 0})->access, access) << word;
  }
}

constexpr std::string_view kCommissioning =
    "ParameterValue=7\n"
    "[DeviceCommissioning]\n"
    "NodeID=9\n"
    "NodeName=Press\n"
    "[1014]\n"
    "ParameterName=COB-ID EMCY\n"
    "DataType=7\n"
    "AccessType=rw\n"
    "DefaultValue=$NODEID+0x80\n"
    "[1017]\n"
    "ParameterName=Heartbeat\n"
    "DataType=6\n"
    "AccessType=rw\n"
    "DefaultValue=0\n"
    "ParameterValue=500\n";

TEST(ReaderOfDcf, TakesNodeIdAndNameFromTheCommissioning) {
  const auto loaded = load(test::file_with(kCommissioning), "x.dcf", 0);
  ASSERT_TRUE(loaded.ok());
  EXPECT_EQ(loaded.value->node_id, 9);
  EXPECT_EQ(loaded.value->node_name, "Press");
  EXPECT_EQ(loaded.value->find({0x1014, 0})->value, bytes({0x89, 0, 0, 0}));
}

TEST(ReaderOfDcf, UnderstandsTheOtherSpellingOfCommissioning) {
  std::string text = test::file_with(kCommissioning);
  text.replace(text.find("DeviceCommissioning"), 19, "DeviceComissioning");
  EXPECT_EQ(load(text, "x.dcf", 0).value.value().node_id, 9);
}

TEST(ReaderOfDcf, ParameterValuesAreConfigured) {
  const auto loaded = load(test::file_with(kCommissioning), "x.dcf", 9);
  ASSERT_TRUE(loaded.ok());
  const od::VariableDescription* heartbeat = loaded.value->find({0x1017, 0});
  EXPECT_EQ(heartbeat->value, bytes({0xF4, 0x01}));
  EXPECT_TRUE(heartbeat->configured);
  EXPECT_FALSE(loaded.value->find({0x1014, 0})->configured);
}

TEST(ReaderOfDcf, TheNodeIdOfTheCallerCountsMore) {
  const auto loaded = load(test::file_with(kCommissioning), "x.dcf", 5);
  ASSERT_TRUE(loaded.ok());
  EXPECT_EQ(loaded.value->node_id, 5);
  EXPECT_EQ(loaded.value->find({0x1014, 0})->value, bytes({0x85, 0, 0, 0}));
  EXPECT_THAT(
      test::messages(loaded.diagnostics),
      testing::Contains("x.dcf:16:8: warning: NodeID: the file is made for node 9, but is used for "
                        "node 5"));
}

}  // namespace
}  // namespace linegate::eds

// SPDX-License-Identifier: Apache-2.0
// The parts of a device file besides its objects, and the additional entries of a DCF.
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

constexpr std::string_view kHeadOfDcf = R"([FileInfo]
FileName=press.dcf
FileVersion=2
FileRevision=3
EDSVersion=4.0
Description=The press
CreationTime=10:00AM
CreationDate=01-15-2026
CreatedBy=somebody
ModificationTime=11:00AM
ModificationDate=01-16-2026
ModifiedBy=somebody else
LastEDS=press.eds
[DeviceInfo]
VendorName=Linegate
VendorNumber=7
ProductName=Press
ProductNumber=8
RevisionNumber=9
OrderCode=P-1
BaudRate_10=0
BaudRate_125=1
BaudRate_1000=1
SimpleBootUpMaster=0
SimpleBootUpSlave=1
Granularity=1
DynamicChannelsSupported=2
GroupMessaging=1
NrOfRXPDO=4
NrOfTXPDO=3
LSS_Supported=1
CANopenSafetySupported=1
[DeviceCommissioning]
NodeID=0x10
NodeName=Press 1
NodeRefd=+A1-K1
Baudrate=500
NetNumber=3
NetworkName=Hall
NetRefd=+A1
CANopenManager=0
LSS_SerialNumber=4711
[Comments]
Lines=3
Line1=first
Line3=third
Line2=second
[Tools]
Items=1
[Tool1]
Name=Scope
Command=scope.exe $DCF
[DynamicChannels]
NrOfSeg=2
Type1=0x0007
Dir1=ro
Range1=0xA080-0xA0BF
PPOffset1=0
Type2=0x0001
Dir2=rww
Range2=0xA500
PPOffset2=64, 1
[MandatoryObjects]
SupportedObjects=1
1=0x1000
[1000]
ParameterName=Device type
DataType=7
AccessType=ro
[1000ObjectLinks]
ObjectLinks=2
1=0x1001
2=0x1018
)";

TEST(DataSheet, HoldsWhatTheFileSaysBesideItsObjects) {
  const auto read_sheet = read(kHeadOfDcf, "press.dcf", 0);
  EXPECT_THAT(messages(read_sheet.diagnostics), IsEmpty());
  ASSERT_TRUE(read_sheet.ok());
  const DataSheet& sheet = *read_sheet.value;
  EXPECT_EQ(sheet.file,
            (FileInfo{"press.dcf", "2", "3", "4.0", "The press", "10:00AM", "01-15-2026",
                      "somebody", "11:00AM", "01-16-2026", "somebody else", "press.eds"}));
  EXPECT_EQ(sheet.info.order_code, "P-1");
  EXPECT_THAT(sheet.info.bit_rates, ElementsAre(125, 1000));
  EXPECT_FALSE(sheet.info.boot_up_master);
  EXPECT_TRUE(sheet.info.boot_up_slave);
  EXPECT_EQ(sheet.info.granularity, 1);
  EXPECT_EQ(sheet.info.dynamic_channels, 2);
  EXPECT_TRUE(sheet.info.group_messaging);
  EXPECT_EQ(sheet.info.rpdos, 4);
  EXPECT_EQ(sheet.info.tpdos, 3);
  EXPECT_TRUE(sheet.info.lss);
  EXPECT_TRUE(sheet.info.safety);
  EXPECT_THAT(sheet.comments, ElementsAre("first", "second", "third"));
  ASSERT_EQ(sheet.tools.size(), 1U);
  EXPECT_EQ(sheet.tools[0], (Tool{"Scope", "scope.exe $DCF"}));
  EXPECT_THAT(sheet.object_links.at(0x1000), ElementsAre(0x1001, 0x1018));
}

TEST(DataSheet, Commissioning) {
  const auto sheet = read(kHeadOfDcf, "press.dcf", 0);
  ASSERT_TRUE(sheet.ok());
  EXPECT_EQ(sheet.value->commissioning.value(),
            (Commissioning{0x10, "Press 1", "+A1-K1", 500, 3, "Hall", "+A1", false, 4711}));
  EXPECT_EQ(sheet.value->device.node_id, 0x10);
  EXPECT_EQ(sheet.value->device.node_name, "Press 1");
}

TEST(DataSheet, DynamicChannels) {
  const auto sheet = read(kHeadOfDcf, "press.dcf", 0);
  ASSERT_TRUE(sheet.ok());
  EXPECT_THAT(sheet.value->dynamic_segments,
              ElementsAre(DynamicSegment{DataType::unsigned32, Access::ro, 0xA080, 0xA0BF, 0, 0},
                          DynamicSegment{DataType::boolean, Access::rww, 0xA500, 0xA500, 64, 1}));
  EXPECT_THAT(messages(file_with("[DynamicChannels]\nNrOfSeg=3\nType1=7\nRange1=0xA0BF-0xA080\n"
                                 "Type2=5\nRange2=0xA000\nPPOffset2=1;2\nDir2=in\n")),
              ElementsAre("x.eds:14:1: warning: segment 3 of the dynamic channels has no Type or "
                          "no Range; ignored",
                          "x.eds:17:8: warning: 'Range1': '0xA0BF-0xA080' is not a range of "
                          "indices like 0xA080-0xA0BF; ignored",
                          "x.eds:21:6: warning: AccessType: 'in' is not known; taken as ro"));
}

TEST(DataSheet, DummyUsageSaysWhichTypesMayFillPdos) {
  const auto loaded = load(file_with(std::string(test::kDummyUsage) + "Dummy001B=1\n"), "x", 5);
  EXPECT_EQ(loaded.value.value().dummy_types, 1U << 5U | 1U << 6U | 1U << 0x1BU);
}

constexpr std::string_view kConfigured = R"([DeviceCommissioning]
NodeID=5
[2000]
ParameterName=Threshold
DataType=0x0007
AccessType=rw
ObjFlags=1
DefaultValue=$NODEID+0x180
ParameterValue=0x200+$NODEID
LowLimit=$NODEID
HighLimit=0x80000000 + $nodeid
Denotation=Threshold of the gate
ParamRefd=+A1-B7
[2001]
ParameterName=Program
ObjectType=2
UploadFile=from_device.bin
DownloadFile=to_device.bin
[2002]
ParameterName=Speeds
ObjectType=8
DataType=0x0007
AccessType=rw
CompactSubObj=3
DefaultValue=9
Denotation=Speeds of the belt
[2002Name]
NrOfEntries=1
1=slow
[2002Value]
NrOfEntries=2
2=$NODEID+10
3=30
[2002Denotation]
NrOfEntries=1
2=middle
)";

TEST(Dcf, ConfiguredValuesKeepTheDefaultBesideThem) {
  const auto loaded = load(file_with(kConfigured), "x.dcf", 0);
  ASSERT_TRUE(loaded.ok());
  const od::VariableDescription* threshold = loaded.value->find({0x2000, 0});
  EXPECT_TRUE(threshold->configured);
  EXPECT_EQ(threshold->value, bytes({0x05, 0x02, 0, 0}));
  EXPECT_EQ(threshold->notes.default_value, bytes({0x85, 0x01, 0, 0}));
  EXPECT_EQ(threshold->notes.denotation, "Threshold of the gate");
  EXPECT_EQ(threshold->notes.reference, "+A1-B7");
  EXPECT_EQ(loaded.value->find(0x2000)->flags, 1U);
}

TEST(Dcf, FormulasAreUnderstoodEverywhereAndRemembered) {
  const auto loaded = load(file_with(kConfigured), "x.dcf", 0);
  ASSERT_TRUE(loaded.ok());
  const od::VariableDescription* threshold = loaded.value->find({0x2000, 0});
  EXPECT_EQ(threshold->low_limit, bytes({5, 0, 0, 0}));
  EXPECT_EQ(threshold->high_limit, bytes({5, 0, 0, 0x80}));
  EXPECT_TRUE(threshold->notes.value_formula && threshold->notes.default_formula &&
              threshold->notes.low_formula && threshold->notes.high_formula);
  EXPECT_EQ(loaded.value->find({0x2002, 2})->value, bytes({15, 0, 0, 0}));
  EXPECT_TRUE(loaded.value->find({0x2002, 2})->notes.value_formula);
  EXPECT_FALSE(loaded.value->find({0x2002, 3})->notes.value_formula);
}

TEST(Dcf, FilesOfAValueAreNamed) {
  const auto loaded = load(file_with(kConfigured), "x.dcf", 0);
  ASSERT_TRUE(loaded.ok());
  EXPECT_EQ(loaded.value->find({0x2001, 0})->notes.upload_file, "from_device.bin");
  EXPECT_EQ(loaded.value->find({0x2001, 0})->notes.download_file, "to_device.bin");
}

TEST(Dcf, CompactSubObjHasNamesValuesAndDenotations) {
  const auto loaded = load(file_with(kConfigured), "x.dcf", 0);
  ASSERT_TRUE(loaded.ok());
  const od::ObjectDescription* speeds = loaded.value->find(0x2002);
  EXPECT_EQ(speeds->denotation, "Speeds of the belt");
  ASSERT_EQ(speeds->variables.size(), 4U);
  EXPECT_EQ(speeds->variables[1].name, "slow");
  EXPECT_EQ(speeds->variables[2].name, "Speeds2");
  EXPECT_EQ(speeds->variables[2].notes.denotation, "middle");
  EXPECT_EQ(speeds->variables[1].notes.denotation, "");
  EXPECT_EQ(speeds->variables[1].value, bytes({9, 0, 0, 0}));
  EXPECT_FALSE(speeds->variables[1].configured);
  EXPECT_EQ(speeds->variables[3].value, bytes({30, 0, 0, 0}));
  EXPECT_TRUE(speeds->variables[3].configured);
  EXPECT_EQ(speeds->variables[3].notes.default_value, bytes({9, 0, 0, 0}));
}

}  // namespace
}  // namespace linegate::eds

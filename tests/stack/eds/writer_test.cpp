// SPDX-License-Identifier: Apache-2.0
// A data sheet is the same after it was written and read again.
#include "stack/eds/writer.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "stack/eds/value.h"
#include "stack/od/dictionary.h"

#include "tests/stack/eds/files.h"

namespace linegate::eds {
namespace {

using od::DataType;
using test::bytes;
using test::file_with;
using test::messages;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

TEST(Format, IsReadAsTheSameValue) {
  struct Written {
    DataType type;
    std::vector<std::byte> value;
    std::string_view text;
  };
  const Written table[] = {
      {DataType::boolean, bytes({1}), "1"},
      {DataType::unsigned8, bytes({9}), "9"},
      {DataType::unsigned8, bytes({10}), "0xA"},
      {DataType::unsigned32, bytes({0, 0, 0, 0x80}), "0x80000000"},
      {DataType::unsigned64, bytes({255, 255, 255, 255, 255, 255, 255, 255}), "0xFFFFFFFFFFFFFFFF"},
      {DataType::integer8, bytes({0x80}), "-128"},
      {DataType::integer8, bytes({0x7F}), "127"},
      {DataType::integer24, bytes({0xFE, 0xFF, 0xFF}), "-2"},
      {DataType::integer64, bytes({0, 0, 0, 0, 0, 0, 0, 0x80}), "-9223372036854775808"},
      {DataType::real32, bytes({0, 0, 0xC0, 0x3F}), "1.5"},
      {DataType::real32, bytes({0xCD, 0xCC, 0xCC, 0x3D}), "0.1"},
      {DataType::real32, bytes({1, 0, 0xC0, 0x7F}), "0x7FC00001"},
      {DataType::real64, bytes({0, 0, 0, 0, 0, 0, 0, 0x80}), "-0"},
      {DataType::visible_string, bytes({'a', ';', 'b'}), "a;b"},
      {DataType::unicode_string, bytes({0xE4, 0, 0x3D, 0xD8, 0x00, 0xDE}),
       "\xC3\xA4\xF0\x9F\x98\x80"},
      {DataType::octet_string, bytes({0x01, 0xAF}), "01AF"},
      {DataType::domain, bytes({0}), "00"},
      {DataType::time_of_day, bytes({1, 0, 0, 0, 0, 1}), "0x10000000001"},
      {static_cast<DataType>(0x40), bytes({1, 2}), "0102"},
  };
  for (const Written& row : table) {
    EXPECT_EQ(format_value(row.type, row.value), row.text);
    EXPECT_EQ(parse_value(row.type, row.text, 0).bytes, row.value) << row.text;
  }
}

TEST(Format, FormulasAndWhatAFileCannotHold) {
  EXPECT_EQ(format_value(DataType::unsigned32, bytes({0x85, 1, 0, 0}), true, 5), "$NODEID+0x180");
  EXPECT_EQ(format_value(DataType::unsigned8, bytes({5}), true, 5), "$NODEID");
  EXPECT_EQ(format_value(DataType::visible_string, bytes({'a', 10, 'b', ' '})), "a?b");
}

// The sheet without the positions of its entries in a file.
DataSheet without_places(DataSheet sheet) {
  const auto clear = [](od::ObjectDescription& object) {
    object.line = 0;
    for (od::VariableDescription& variable : object.variables) {
      variable.line = 0;
      variable.store = false;  // CiA 306 has no keyword for it
    }
  };
  sheet.device.file.clear();
  std::ranges::for_each(sheet.device.objects, clear);
  for (Module& module : sheet.modules) {
    std::ranges::for_each(module.fixed_objects, clear);
    for (SubExtension& extension : module.extensions) {
      extension.pattern.line = 0;
    }
  }
  return sheet;
}

constexpr std::string_view kEverything = R"([FileInfo]
FileName=press.dcf
FileVersion=2
EDSVersion=4.0
Description=The press; of hall 7
CreatedBy=somebody
LastEDS=press.eds
[DeviceInfo]
VendorName=Linegate
VendorNumber=7
ProductName=Press
ProductNumber=8
RevisionNumber=9
OrderCode=P-1
BaudRate_125=1
SimpleBootUpSlave=1
Granularity=1
DynamicChannelsSupported=2
NrOfRXPDO=2
NrOfTXPDO=1
LSS_Supported=1
CompactPDO=0x33
[DummyUsage]
Dummy0001=0
Dummy0002=1
Dummy0003=0
Dummy0004=0
Dummy0005=1
Dummy0006=0
Dummy0007=0
Dummy0015=1
[DeviceCommissioning]
NodeID=0x10
NodeName=Press 1
NodeRefd=+A1-K1
Baudrate=500
NetNumber=3
NetworkName=Hall
CANopenManager=1
LSS_SerialNumber=4711
[Comments]
Lines=2
Line1=first
Line2=
[Tools]
Items=1
[Tool1]
Name=Scope
[DynamicChannels]
NrOfSeg=1
Type1=0x0001
Dir1=rww
Range1=0xA500-0xA53F
PPOffset1=64, 1
[SupportedModules]
NrOfEntries=1
[M3ModuleInfo]
ProductName=DI8
OrderCode=4712
[M3Comments]
Lines=1
Line1=Eight inputs
[M3FixedObjects]
NrOfEntries=1
1=0x6003
[M3Fixed6003]
ParameterName=Filter
DataType=5
AccessType=rw
DefaultValue=1
[M3SubExtends]
NrOfEntries=1
1=0x6000
[M3SubExt6000]
ParameterName=Inputs
DataType=5
AccessType=ro
PDOMapping=1
Count=1
ObjExtend=128
[ConnectedModules]
NrOfEntries=2
1=3
2=3
[MandatoryObjects]
SupportedObjects=1
1=0x1000
[OptionalObjects]
SupportedObjects=2
1=0x1005
2=0x6100
[ManufacturerObjects]
SupportedObjects=5
1=0x2000
2=0x2001
3=0x2002
4=0x2003
5=0x2004
[1000]
ParameterName=Device type
DataType=7
AccessType=ro
DefaultValue=0x00020192
[1000ObjectLinks]
ObjectLinks=1
1=0x2000
[1005]
ParameterName=COB-ID SYNC
DataType=7
AccessType=rw
DefaultValue=0x80
ObjFlags=2
[2000]
ParameterName=Threshold
DataType=0x0007
AccessType=rww
DefaultValue=$NODEID+0x180
ParameterValue=0x200+$NODEID
LowLimit=$NODEID
HighLimit=0x80000000
PDOMapping=1
Denotation=Threshold of the gate
ParamRefd=+A1-B7
[2001]
ParameterName=Program
ObjectType=2
DataType=0x000F
AccessType=rw
UploadFile=from_device.bin
DownloadFile=to_device.bin
[2002]
ParameterName=Speeds
ObjectType=8
DataType=0x0007
AccessType=rw
CompactSubObj=4
DefaultValue=9
LowLimit=1
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
[2003]
ParameterName=Names
ObjectType=9
SubNumber=3
Denotation=Names in the hall
[2003sub0]
ParameterName=Number
DataType=5
AccessType=const
DefaultValue=7
[2003sub2]
ParameterName=First
DataType=9
AccessType=rw
DefaultValue=a;b
ParameterValue=c
[2003sub7]
ParameterName=Second
DataType=8
AccessType=wo
LowLimit=-1.5
HighLimit=1e9
[2004]
ParameterName=Mixed
ObjectType=8
SubNumber=4
[2004sub0]
ParameterName=Highest sub-index supported
DataType=5
AccessType=ro
DefaultValue=3
[2004sub1]
ParameterName=Mixed1
DataType=5
AccessType=rw
DefaultValue=1
[2004sub2]
ParameterName=Mixed2
DataType=5
AccessType=rw
DefaultValue=2
[2004sub3]
ParameterName=Mixed3
DataType=5
AccessType=rw
ParameterValue=3
[6100]
ParameterName=Levels
ObjectType=8
DataType=0x0003
AccessType=rwr
PDOMapping=1
CompactSubObj=5
)";

TEST(Writer, ADcfIsReadAsTheSameSheet) {
  const auto first = read(kEverything, "press.dcf", 0);
  ASSERT_TRUE(first.ok()) << to_string(first.diagnostics.at(0));
  EXPECT_THAT(messages(first.diagnostics), IsEmpty());
  const std::string text = write_dcf(*first.value);
  const auto second = read(text, "again.dcf", 0);
  ASSERT_TRUE(second.ok()) << to_string(second.diagnostics.at(0));
  EXPECT_THAT(messages(second.diagnostics), IsEmpty());
  const DataSheet a = without_places(*first.value);
  const DataSheet b = without_places(*second.value);
  ASSERT_EQ(a.device.objects.size(), b.device.objects.size());
  for (std::size_t i = 0; i < a.device.objects.size(); ++i) {
    EXPECT_TRUE(a.device.objects[i] == b.device.objects[i]) << a.device.objects[i].name;
  }
  EXPECT_TRUE(a.modules == b.modules);
  EXPECT_TRUE(a.commissioning == b.commissioning);
  EXPECT_TRUE(a.info == b.info);
  EXPECT_TRUE(a == b) << text;
  EXPECT_EQ(write_dcf(*second.value), text);
}

TEST(Writer, TheCommissioningIsWrittenUnderBothNames) {
  const auto first = read(kEverything, "press.dcf", 0);
  ASSERT_TRUE(first.ok());
  const std::string text = write_dcf(*first.value);
  const std::string begin = "\nNodeID=16\nNodeName=Press 1\n";
  EXPECT_THAT(text, HasSubstr("[DeviceCommissioning]" + begin));
  EXPECT_THAT(text, HasSubstr("[DeviceComissioning]" + begin));
}

TEST(Writer, FormulasStayFormulas) {
  const auto first = read(kEverything, "press.dcf", 0);
  ASSERT_TRUE(first.ok());
  const std::string text = write_dcf(*first.value);
  EXPECT_THAT(text, HasSubstr("DefaultValue=$NODEID+0x180\n"));
  EXPECT_THAT(text, HasSubstr("ParameterValue=$NODEID+0x200\n"));
  EXPECT_THAT(text, HasSubstr("[2002Value]\nNrOfEntries=2\n2=$NODEID+0xA\n3=0x1E\n"));
  EXPECT_THAT(text, HasSubstr("LowLimit=$NODEID\n"));
}

TEST(Writer, AnEdsHasTheDefaultsAndNothingOfTheConfiguration) {
  const auto first = read(kEverything, "press.dcf", 0);
  ASSERT_TRUE(first.ok());
  const std::string text = write_eds(*first.value);
  for (const char* word : {"ParameterValue", "Denotation", "DownloadFile", "Comissioning",
                           "Commissioning", "ConnectedModules", "LastEDS"}) {
    EXPECT_THAT(text, Not(HasSubstr(word)));
  }
  const auto second = load(text, "again.eds", 0x20);
  ASSERT_TRUE(second.ok()) << to_string(second.diagnostics.at(0));
  EXPECT_THAT(messages(second.diagnostics), IsEmpty());
  EXPECT_EQ(second.value->find({0x2000, 0})->value, bytes({0xA0, 0x01, 0, 0}));
  EXPECT_EQ(second.value->find({0x2002, 3})->value, bytes({9, 0, 0, 0}));
}

TEST(Writer, EqualElementsAreWrittenInFewLines) {
  const auto first = read(kEverything, "press.dcf", 0);
  ASSERT_TRUE(first.ok());
  const std::string text = write_dcf(*first.value);
  EXPECT_THAT(text, HasSubstr("CompactSubObj=5\n"));
  EXPECT_THAT(text, Not(HasSubstr("[6100sub1]")));
  EXPECT_THAT(text, HasSubstr("[2004sub1]"));
}

TEST(Writer, TheEdsOfADictionaryDescribesIt) {
  const auto first = load(kEverything, "press.dcf", 0);
  ASSERT_TRUE(first.ok());
  od::Dictionary dictionary(*first.value);
  std::array<std::byte, 16> window{};
  ASSERT_TRUE(
      dictionary.add_window(0xA040, DataType::unsigned16, od::Access::ro, window.data(), 8).ok());
  od::DeviceDescription device;
  device.objects = dictionary.describe();
  device.node_id = 0x10;
  const DataSheet sheet = sheet_of(device);
  const std::string text = write_eds(sheet);
  const auto second = read(text, "own.eds", 0x10);
  ASSERT_TRUE(second.ok()) << to_string(second.diagnostics.at(0));
  EXPECT_THAT(messages(second.diagnostics), IsEmpty());
  const auto expected = without_places(sheet).device.objects;
  const auto read_back = without_places(*second.value).device.objects;
  ASSERT_EQ(expected.size(), read_back.size());
  for (std::size_t i = 0; i < expected.size(); ++i) {
    EXPECT_TRUE(expected[i] == read_back[i]) << expected[i].name;
  }
  EXPECT_EQ(second.value->info.rpdos, 2);
  EXPECT_EQ(second.value->info.tpdos, 1);
}

}  // namespace
}  // namespace linegate::eds

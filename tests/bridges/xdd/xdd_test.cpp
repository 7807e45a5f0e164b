// SPDX-License-Identifier: Apache-2.0
#include "bridges/xdd/xdd.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace linegate::xdd {
namespace {

using od::Access;
using od::DataType;
using testing::Contains;
using testing::ElementsAre;
using testing::IsEmpty;

std::vector<std::string> messages(const std::vector<Diagnostic>& diagnostics) {
  std::vector<std::string> out;
  for (const Diagnostic& diagnostic : diagnostics) {
    out.push_back(to_string(diagnostic));
  }
  return out;
}

std::vector<std::byte> bytes(std::initializer_list<unsigned> values) {
  std::vector<std::byte> out;
  for (const unsigned value : values) {
    out.push_back(static_cast<std::byte>(value));
  }
  return out;
}

// Lines 1 to 12 of a file. The parameters are in line 10.
std::string head(std::string_view parameters = "") {
  return R"(<?xml version="1.0" encoding="utf-8"?>
<ISO15745ProfileContainer xmlns="http://www.canopen.org/xml/1.1" xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance">
<ISO15745Profile><ProfileBody xsi:type="ProfileBody_Device_CANopen" fileName="axis.xdd" fileVersion="1.0" fileCreator="somebody" fileCreationDate="2026-01-15">
<DeviceIdentity>
<vendorName>Linegate</vendorName>
<vendorID>0x0000AFFE</vendorID>
<productName> Axis </productName>
<productID>16</productID>
</DeviceIdentity>
<ApplicationProcess><parameterList>)" +
         std::string(parameters) + R"(</parameterList></ApplicationProcess>
</ProfileBody></ISO15745Profile>
<ISO15745Profile><ProfileBody xsi:type="ProfileBody_CommunicationNetwork_CANopen">
)";
}

// A file whose objects begin in line 14.
std::string file_with(std::string_view objects, std::string_view management = "",
                      std::string_view parameters = "") {
  return head(parameters) + "<ApplicationLayers><CANopenObjectList>\n" + std::string(objects) + R"(
</CANopenObjectList>
<dummyUsage><dummy entry="Dummy0001=0"/><dummy entry="Dummy0002=0"/><dummy entry="Dummy0003=0"/><dummy entry="Dummy0004=0"/><dummy entry="Dummy0005=1"/><dummy entry="Dummy0006=1"/><dummy entry="Dummy0007=0"/></dummyUsage>
<dynamicChannels><dynamicChannel dataType="0007" accessType="readWriteOutput" startIndex="A480" endIndex="A4BF" maxNumber="4" addressOffset="16"/></dynamicChannels>
</ApplicationLayers>
<TransportLayers><PhysicalLayer><baudRate defaultValue="250 Kbps"><supportedBaudRate value="125 Kbps"/><supportedBaudRate value="250 Kbps"/></baudRate></PhysicalLayer></TransportLayers>
<NetworkManagement><CANopenGeneralFeatures granularity="8" nrOfRxPDO="1" nrOfTxPDO="2" bootUpSlave="true" layerSettingServiceSlave="true"/><CANopenMasterFeatures bootUpMaster="false"/>)" +
         std::string(management) + R"(</NetworkManagement>
</ProfileBody></ISO15745Profile>
</ISO15745ProfileContainer>
)";
}

constexpr std::string_view kObjects =
    R"(<CANopenObject index="1000" name="Device type" objectType="7" dataType="0007" accessType="const" defaultValue="0x00020192" PDOmapping="no"/>
<CANopenObject index="1018" name="Identity" objectType="9" subNumber="2">
  <CANopenSubObject subIndex="00" name="Number" objectType="7" dataType="0005" accessType="ro" defaultValue="3"/>
  <CANopenSubObject subIndex="03" name="Revision" objectType="7" dataType="0007" accessType="ro"
      defaultValue="0x10002"/>
</CANopenObject>
<CANopenObject index="1800" name="TPDO 1" objectType="9" subNumber="2">
  <CANopenSubObject subIndex="00" name="Number" objectType="7" dataType="0005" accessType="const" defaultValue="1"/>
  <CANopenSubObject subIndex="01" name="COB-ID" objectType="7" dataType="0007" accessType="rw" defaultValue="$NODEID+0x180" lowLimit="0x181" highLimit="0xFFFFFFFF"/>
</CANopenObject>
<CANopenObject index="6000" name="Inputs" objectType="7" dataType="05" accessType="rw" PDOmapping="TPDO" objFlags="0002"/>
<CANopenObject index="6200" name="Outputs" objectType="7" dataType="0005" accessType="rw" PDOmapping="RPDO"/>
<CANopenObject index="6300" name="Both" objectType="7" dataType="0003" accessType="rw" PDOmapping="optional" defaultValue="-5"/>)";

TEST(Xdd, AFileInOrderIsReadWithoutFindings) {
  const auto sheet = read(file_with(kObjects), "axis.xdd", 5);
  EXPECT_THAT(messages(sheet.diagnostics), IsEmpty());
  ASSERT_TRUE(sheet.ok());
  const od::DeviceDescription& device = sheet.value->device;
  EXPECT_EQ(device.file, "axis.xdd");
  EXPECT_EQ(device.vendor_name, "Linegate");
  EXPECT_EQ(device.vendor_number, 0xAFFEU);
  EXPECT_EQ(device.product_name, "Axis");
  EXPECT_EQ(device.product_number, 16U);
  EXPECT_EQ(device.revision_number, 0x10002U) << "the value of 1018h";
  EXPECT_EQ(device.node_id, 5);
  EXPECT_EQ(device.dummy_types, 0x60U);
  EXPECT_EQ(sheet.value->file.file_name, "axis.xdd");
  EXPECT_EQ(sheet.value->file.created_by, "somebody");
  EXPECT_THAT(sheet.value->info.bit_rates, ElementsAre(125, 250));
  EXPECT_EQ(sheet.value->info.granularity, 8);
  EXPECT_EQ(sheet.value->info.rpdos, 1);
  EXPECT_EQ(sheet.value->info.tpdos, 2);
  EXPECT_TRUE(sheet.value->info.boot_up_slave);
  EXPECT_FALSE(sheet.value->info.boot_up_master);
  EXPECT_TRUE(sheet.value->info.lss);
  EXPECT_THAT(
      sheet.value->dynamic_segments,
      ElementsAre(eds::DynamicSegment{DataType::unsigned32, Access::rww, 0xA480, 0xA4BF, 16, 0}));
  EXPECT_FALSE(sheet.value->commissioning);
}

TEST(Xdd, ObjectsWithTypesValuesLimitsAndMapping) {
  const auto sheet = read(file_with(kObjects), "axis.xdd", 5);
  ASSERT_TRUE(sheet.ok());
  const od::DeviceDescription& device = sheet.value->device;
  EXPECT_EQ(device.find({0x1000, 0})->value, bytes({0x92, 0x01, 0x02, 0}));
  EXPECT_EQ(device.find({0x1000, 0})->access, Access::constant);
  EXPECT_EQ(device.find(0x1018)->type, od::ObjectType::record);
  EXPECT_EQ(device.find({0x1018, 3})->name, "Revision");
  EXPECT_EQ(device.find({0x1018, 3})->line, 17U);
  EXPECT_EQ(device.find({0x1800, 1})->value, bytes({0x85, 0x01, 0, 0}));
  EXPECT_EQ(device.find({0x1800, 1})->low_limit, bytes({0x81, 0x01, 0, 0}));
  EXPECT_EQ(device.find({0x6000, 0})->access, Access::rwr);
  EXPECT_EQ(device.find(0x6000)->flags, 2U);
  EXPECT_EQ(device.find({0x6200, 0})->access, Access::rww);
  EXPECT_EQ(device.find({0x6300, 0})->access, Access::rw);
  EXPECT_TRUE(device.find({0x6300, 0})->mappable);
  EXPECT_FALSE(device.find({0x1000, 0})->mappable);
  EXPECT_EQ(device.find({0x6300, 0})->value, bytes({0xFB, 0xFF}));
}

// CiA 311: the attribute access of a parameter has the default "read".
TEST(Xdd, AParameterWithoutAccessCanBeRead) {
  const auto sheet =
      read(file_with(R"(<CANopenObject index="2000" objectType="7" uniqueIDRef="P1"/>
<CANopenObject index="2001" name="Record" objectType="9" subNumber="3">
<CANopenSubObject subIndex="00" name="n" objectType="7" dataType="0005" accessType="const" defaultValue="1"/>
<CANopenSubObject subIndex="01" objectType="7" PDOmapping="TPDO" uniqueIDRef="P1"/>
<CANopenSubObject subIndex="FF" name="Structure" objectType="7" dataType="0007" accessType="const"/>
</CANopenObject>)",
                     "", R"(<parameter uniqueID="P1"><label>Speed</label><INT/></parameter>)"),
           "x.xdd", 5);
  EXPECT_THAT(messages(sheet.diagnostics), IsEmpty());
  ASSERT_TRUE(sheet.ok());
  EXPECT_EQ(sheet.value->device.find({0x2000, 0})->access, Access::ro);
  EXPECT_EQ(sheet.value->device.find({0x2001, 1})->access, Access::ro);
}

// CiA 311: the value for people is (value + offset) * multiplier.
TEST(Xdd, ParametersHaveUnitAndScaling) {
  constexpr std::string_view kParameters =
      R"(<parameter uniqueID="P1" offset="-400" multiplier="0.1"><label>Pressure</label><UINT/><unit multiplier="1"><label lang="en">bar</label></unit></parameter>)"
      R"(<parameter uniqueID="P2" multiplier="0"><label>A</label><UINT/></parameter>)"
      R"(<parameter uniqueID="P3" offset="x" multiplier="nan"><label>B</label><UINT/></parameter>)"
      R"(<parameter uniqueID="P4" multiplier="0.1"><label>C</label><BOOL/></parameter>)";
  const auto sheet = read(file_with(
                              R"(<CANopenObject index="2000" objectType="7" uniqueIDRef="P1"/>
<CANopenObject index="2001" objectType="7" uniqueIDRef="P2"/>
<CANopenObject index="2002" objectType="7" uniqueIDRef="P3"/>
<CANopenObject index="2003" objectType="7" uniqueIDRef="P4"/>)",
                              "", kParameters),
                          "x.xdd", 5);
  EXPECT_THAT(
      messages(sheet.diagnostics),
      testing::UnorderedElementsAre(testing::HasSubstr("make no scaling; ignored"),
                                    testing::HasSubstr("XddOffset: 'x' is no number"),
                                    testing::HasSubstr("XddMultiplier: 'nan' is no number")));
  ASSERT_TRUE(sheet.ok());
  const auto scaling_of = [&](std::uint16_t index) {
    return sheet.value->device.find({index, 0})->scaling;
  };
  EXPECT_EQ(scaling_of(0x2000), (od::Scaling{.unit = "bar", .scale = 0.1, .offset = -40}));
  for (std::uint16_t index = 0x2001; index <= 0x2003; ++index) {
    EXPECT_EQ(scaling_of(index), od::Scaling{}) << index;
  }
}

TEST(Xdd, ParametersOfTheApplicationProcessDescribeObjectsToo) {
  constexpr std::string_view kParameters =
      R"(<parameter uniqueID="P1" access="readWriteInput"><label lang="en">Speed</label><INT/><defaultValue value="7"/><allowedValues><range><minValue value="-10"/><maxValue value="10"/></range></allowedValues><denotation><label lang="en">Speed of the belt</label></denotation></parameter>)"
      R"(<parameter uniqueID="P2" access="const"><label>Not used</label><UDINT/></parameter>)";
  const auto sheet =
      read(file_with(
               R"(<CANopenObject index="2000" objectType="7" PDOmapping="TPDO" uniqueIDRef="P1"/>
<CANopenObject index="2001" name="Own name" objectType="7" accessType="ro" defaultValue="9" uniqueIDRef="P2"/>)",
               "", kParameters),
           "x.xdd", 5);
  EXPECT_THAT(messages(sheet.diagnostics), IsEmpty());
  ASSERT_TRUE(sheet.ok());
  const od::VariableDescription* speed = sheet.value->device.find({0x2000, 0});
  ASSERT_NE(speed, nullptr);
  EXPECT_EQ(speed->name, "Speed");
  EXPECT_EQ(speed->type, DataType::integer16);
  EXPECT_EQ(speed->access, Access::rwr);
  EXPECT_EQ(speed->value, bytes({7, 0}));
  EXPECT_EQ(speed->low_limit, bytes({0xF6, 0xFF}));
  EXPECT_EQ(speed->high_limit, bytes({10, 0}));
  EXPECT_EQ(speed->notes.denotation, "Speed of the belt");
  const od::VariableDescription* own = sheet.value->device.find({0x2001, 0});
  EXPECT_EQ(own->name, "Own name");
  EXPECT_EQ(own->access, Access::ro);
  EXPECT_EQ(own->type, DataType::unsigned32);
  EXPECT_EQ(own->value, bytes({9, 0, 0, 0}));
}

TEST(Xdc, ActualValuesAreConfiguredAndTheNodeIdIsTheFiles) {
  const auto sheet = read(
      file_with(
          R"(<CANopenObject index="1017" name="Heartbeat" objectType="7" dataType="0006" accessType="rw" defaultValue="0" actualValue="500" denotation="Pulse"/>
<CANopenObject index="1014" name="EMCY" objectType="7" dataType="0007" accessType="rw" defaultValue="$NODEID+0x80"/>)",
          R"(<deviceCommissioning nodeID="9" nodeName="Press" actualBaudRate="500 Kbps" networkNumber="3" networkName="Hall" CANopenManager="false"/>)"),
      "press.xdc", 0);
  EXPECT_THAT(messages(sheet.diagnostics), IsEmpty());
  ASSERT_TRUE(sheet.ok());
  EXPECT_EQ(sheet.value->device.node_id, 9);
  EXPECT_EQ(sheet.value->device.node_name, "Press");
  EXPECT_EQ(sheet.value->commissioning->bit_rate, 500);
  EXPECT_EQ(sheet.value->commissioning->net_number, 3U);
  EXPECT_EQ(sheet.value->commissioning->network_name, "Hall");
  const od::VariableDescription* heartbeat = sheet.value->device.find({0x1017, 0});
  EXPECT_TRUE(heartbeat->configured);
  EXPECT_EQ(heartbeat->value, bytes({0xF4, 0x01}));
  EXPECT_EQ(heartbeat->notes.default_value, bytes({0, 0}));
  EXPECT_EQ(heartbeat->notes.denotation, "Pulse");
  EXPECT_EQ(sheet.value->device.find({0x1014, 0})->value, bytes({0x89, 0, 0, 0}));
}

TEST(Xdd, SloppyFilesLoadWithAWarningThatNamesFileAndLine) {
  struct Row {
    std::string_view objects;
    std::string_view message;
  };
  const Row table[] = {
      {R"(<CANopenObject index="2000" name="a" objectType="7" dataType="0005" accessType="rw"
 defaultValue="256"/>)",
       "x.xdd:15:2: warning: DefaultValue: '256' does not fit UNSIGNED8 (0 to 255); ignored"},
      {R"(<CANopenObject index="2000" objectType="7" dataType="0005" accessType="rw"/>)",
       "x.xdd:14:2: warning: '2000' has no ParameterName; its section's name is used"},
      {R"(<CANopenObject index="2000" name="a" objectType="7" dataType="0005" accessType="any"/>)",
       "x.xdd:14:69: warning: AccessType: 'any' is not known; taken as ro"},
      {R"(<CANopenObject index="2000" name="a" objectType="7" dataType="0005" accessType="rw" PDOmapping="yes"/>)",
       "x.xdd:14:85: warning: PDOmapping: 'yes' is not known; taken as no"},
      {R"(<CANopenObject index="2000" name="a" objectType="7" dataType="0005" accessType="rw" uniqueIDRef="P"/>)",
       "x.xdd:14:85: warning: uniqueIDRef: there is no parameter 'P'"},
      {R"(<CANopenObject index="2000" name="a" objectType="7" dataType="0005" accessType="rw"/>
<CANopenObject index="2000" name="b" objectType="7" dataType="0005" accessType="rw"/>)",
       "x.xdd:15:2: warning: this object is already described; ignored"},
      {R"(<CANopenObject index="2000" name="a" objectType="8" subNumber="3"><CANopenSubObject subIndex="0" name="n" dataType="0005" accessType="ro"/></CANopenObject>)",
       "x.xdd:14:53: warning: SubNumber is 3, but 1 sub-indices are described"},
      {R"(<CANopenObject name="a" objectType="7" dataType="0005" accessType="rw"/>)",
       "x.xdd:14:2: warning: a CANopenObject without index is ignored"},
  };
  constexpr std::string_view kGood =
      "\n<CANopenObject index=\"1000\" name=\"t\" objectType=\"7\" dataType=\"0007\" "
      "accessType=\"ro\"/>";
  for (const Row& row : table) {
    const auto sheet = read(file_with(std::string(row.objects) + std::string(kGood)), "x.xdd", 5);
    EXPECT_TRUE(sheet.ok()) << row.message;
    EXPECT_THAT(messages(sheet.diagnostics), Contains(row.message));
  }
}

TEST(Xdd, Latin1IsUnderstood) {
  const auto sheet =
      read(file_with("<CANopenObject index=\"2000\" name=\"Ger\xE4t\" objectType=\"7\" "
                     "dataType=\"0005\" accessType=\"rw\"/>"),
           "x.xdd", 5);
  ASSERT_TRUE(sheet.ok());
  EXPECT_EQ(sheet.value->device.find(0x2000)->name, "Ger\xC3\xA4t");
}

TEST(Xdd, WhatCannotBeUnderstoodIsAnErrorThatNamesFileAndLine) {
  struct Row {
    std::string text;
    std::string_view message;
  };
  const Row table[] = {
      {"", "x.xdd:1:1: error: this is no XML: No document element found"},
      {"[FileInfo]\n", "x.xdd:2:1: error: this is no XML: No document element found"},
      {"<a>\n<b>\n</a>", "x.xdd:3:3: error: this is no XML: Start-end tags mismatch"},
      {"\n<a/>",
       "x.xdd:2:2: error: this is no XDD or XDC: it begins with 'a', not with "
       "ISO15745ProfileContainer"},
      {std::string("\xFF\xFE<\0", 4),
       "x.xdd: error: the file is UTF-16; it must be UTF-8 or Latin-1"},
      {"<ISO15745ProfileContainer/>",
       "x.xdd: error: no object is described; this describes no device"},
      {file_with(
           R"(<CANopenObject index="2000" name="a" objectType="7" dataType="0005" accessType="rw" actualValue="256"/>)"),
       "x.xdd:14:85: error: ParameterValue: '256' does not fit UNSIGNED8 (0 to 255)"},
  };
  for (const Row& row : table) {
    const auto sheet = read(row.text, "x.xdd", 5);
    EXPECT_FALSE(sheet.ok()) << row.message;
    EXPECT_THAT(messages(sheet.diagnostics), Contains(row.message));
  }
}

TEST(Xdd, IsToldByItsName) {
  EXPECT_TRUE(is_xdd("axis.xdd"));
  EXPECT_TRUE(is_xdd("devices/AXIS.XDC"));
  EXPECT_FALSE(is_xdd("axis.eds"));
  EXPECT_FALSE(is_xdd("xdd"));
}

}  // namespace
}  // namespace linegate::xdd

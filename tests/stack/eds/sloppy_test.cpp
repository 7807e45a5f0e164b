// SPDX-License-Identifier: Apache-2.0
// Device files as found in practice: they violate CiA 306, but their meaning is clear.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/stack/eds/files.h"

namespace linegate::eds {
namespace {

using test::bytes;
using test::file_with;
using test::messages;
using testing::ElementsAre;
using testing::IsEmpty;

std::string with_crlf(std::string_view text) {
  std::string out;
  for (const char c : text) {
    out += c == '\n' ? "\r\n" : std::string(1, c);
  }
  return out;
}

struct Row {
  std::string_view what;
  std::string text;
  std::string_view message;  // empty: CiA 306 permits it, so there is no message
};

std::string replaced(std::string text, std::string_view what, std::string_view with) {
  return text.replace(text.find(what), what.size(), with);
}

// An object in lines 14 to 17, and its sub-indices from line 18 on.
std::string record(std::string_view more) {
  return file_with("[2000]\nParameterName=r\nObjectType=9\nSubNumber=2\n" + std::string(more));
}

std::vector<Row> sloppy_files() {
  const std::string fine = file_with("");
  const std::string variable = "ParameterName=v\nDataType=5\nAccessType=rw\n";
  const std::string zero = "[2000sub0]\nParameterName=n\nDataType=5\nAccessType=const\n";
  return {
      {"CR LF", with_crlf(fine), ""},
      {"upper and lower case",
       replaced(replaced(fine, "AccessType=ro", "accesstype=RO"), "[DeviceInfo]", "[DEVICEINFO]"),
       ""},
      {"blanks around everything", replaced(fine, "DataType=0x0007", " DataType\t= 0x0007 "), ""},
      {"blanks in the name of a section", replaced(fine, "[DeviceInfo]", "[Device Info]"),
       "x.eds:3:1: warning: section 'Device Info' is read as [deviceinfo]"},
      {"Latin-1", replaced(fine, "Linegate", "Ger\xE4te"),
       "x.eds:4: warning: this line is neither ASCII nor UTF-8; such text is read as Latin-1"},
      {"DeviceCommissioning", fine + "[DeviceCommissioning]\nNodeID=5\n", ""},
      {"DeviceComissioning misspelt", fine + "[DeviceComissioning]\nNodeID=5\n",
       "x.eds:14:1: warning: section 'DeviceComissioning' is read as [DeviceCommissioning]"},
      {"a third spelling", fine + "[DeviceComisioning]\nNodeID=5\n",
       "x.eds:14:1: warning: section 'DeviceComisioning' is read as [DeviceCommissioning]"},
      {"two spellings", fine + "[DeviceCommissioning]\nNodeID=5\n[DeviceComissioning]\nNodeID=6\n",
       "x.eds:16:1: warning: section 'DeviceComissioning' is ignored: there is "
       "'DeviceCommissioning' in line 14"},
      {"two spellings that say the same",
       fine + "[DeviceCommissioning]\nNodeID=5\n[DeviceComissioning]\nNodeID=5\n", ""},
      {"decimal 005", fine + "[DeviceCommissioning]\nNodeID=005\n",
       "x.eds:15:8: warning: NodeID: '005' begins with 0, which means octal; read as 5"},
      {"decimal 008", file_with("[2000]\n" + variable + "DefaultValue=008\n"),
       "x.eds:18:14: warning: DefaultValue: '008' begins with 0, which means octal, but it is "
       "decimal; read as 8"},
      {"decimal 010 that is meant so or not", file_with("[2000]\n" + variable + "LowLimit=010\n"),
       "x.eds:18:10: warning: LowLimit: '010' begins with 0, which means octal; read as 8"},
      {"empty VendorNumber", replaced(fine, "VendorName=Linegate", "VendorNumber="),
       "x.eds:4:1: warning: VendorNumber has no value; object 1018h is used"},
      {"missing Dummy0001", fine + replaced(std::string(test::kDummyUsage), "Dummy0001=0\n", ""),
       "x.eds:14:1: warning: 'DummyUsage' has no Dummy0001; 0 is assumed"},
      {"missing ParameterName", replaced(fine, "ParameterName=Device type\n", ""),
       "x.eds:9:1: warning: '1000' has no ParameterName; its section's name is used"},
      {"missing ParameterName of a record",
       replaced(record(zero + "[2000sub1]\n" + variable), "ParameterName=r\n", ""),
       "x.eds:14:1: warning: '2000' has no ParameterName; its section's name is used"},
      {"a default that does not fit", file_with("[2000]\n" + variable + "DefaultValue=256\n"),
       "x.eds:18:14: warning: DefaultValue: '256' does not fit UNSIGNED8 (0 to 255); ignored"},
      {"a default that is no number", file_with("[2000]\n" + variable + "DefaultValue=low\n"),
       "x.eds:18:14: warning: DefaultValue: 'low' is not a number; ignored"},
      {"SubNumber too large", record(zero),
       "x.eds:17:11: warning: SubNumber is 2, but 1 sub-indices are described"},
      {"sub-index 0 too large", record(zero + "DefaultValue=3\n[2000sub1]\n" + variable),
       "x.eds:18:1: warning: sub-index 0 of 2000h says 3, but the highest sub-index described is "
       "1"},
      {"too many objects announced", replaced(fine, "SupportedObjects=1", "SupportedObjects=3"),
       "x.eds:7:18: warning: SupportedObjects is 3, but 1 are listed"},
  };
}

TEST(SloppyFile, LoadsWithAWarningThatNamesFileAndLine) {
  for (const Row& row : sloppy_files()) {
    const auto loaded = load(row.text, "x.eds", 5);
    EXPECT_TRUE(loaded.ok()) << row.what;
    std::vector<std::string> said = messages(loaded.diagnostics);
    // The objects that a row adds are in no list of objects.
    std::erase(said, "x.eds:14:1: warning: object 2000h is in no list of objects");
    if (row.message.empty()) {
      EXPECT_THAT(said, IsEmpty()) << row.what;
    } else {
      EXPECT_THAT(said, ElementsAre(row.message)) << row.what;
    }
  }
}

TEST(SloppyFile, WhatCannotBeUnderstoodIsAnErrorThatNamesFileAndLine) {
  const std::string fine = file_with("");
  const std::string variable = "[2000]\nParameterName=v\nDataType=5\nAccessType=rw\n";
  const Row table[] = {
      {"a list of objects", replaced(fine, "1=0x1000", "1=x1000"),
       "x.eds:8:3: error: index of an object: 'x1000' is not a number"},
      {"a section without end", replaced(fine, "[1000]", "[1000"),
       "x.eds:9:1: error: section name '[1000' is not closed by ']'"},
      {"a value to be written", file_with(variable + "ParameterValue=256\n"),
       "x.eds:18:16: error: ParameterValue: '256' does not fit UNSIGNED8 (0 to 255)"},
      {"a formula to be written", file_with(variable + "ParameterValue=$NODEID*2\n"),
       "x.eds:18:16: error: ParameterValue: '$NODEID*2' is not a formula like $NODEID+0x180"},
      {"a type of a value to be written",
       replaced(file_with(variable + "ParameterValue=1\n"), "DataType=5", "DataType=word"),
       "x.eds:16:10: error: DataType: 'word' is not a number"},
  };
  for (const Row& row : table) {
    const auto loaded = load(row.text, "x.eds", 5);
    EXPECT_FALSE(loaded.ok()) << row.what;
    EXPECT_THAT(messages(loaded.diagnostics), testing::Contains(row.message)) << row.what;
  }
}

TEST(SloppyFile, CrLfIsFine) {
  EXPECT_THAT(messages(with_crlf(file_with(""))), IsEmpty());
}

TEST(SloppyFile, CaseBlanksAndCommentsDoNotMatter) {
  const auto loaded = load(
      "[FILEINFO]\n"
      "[deviceInfo]\n"
      " vendorname = ACME  GmbH \n"
      "[mandatoryobjects]\n"
      "supportedobjects = 2 ; two\n"
      " 1 = 0x1000 ; device type\n"
      "2=0x1018\n"
      "; [1001]\n"
      "[1000]\n"
      "PARAMETERNAME=Type\n"
      "datatype = 7\n"
      "ACCESSTYPE = RO ; never changes\n"
      "defaultvalue = 0x91 ; default\n"
      "[1018]\n"
      "ParameterName=Identity\n"
      "ObjectType=0x09\n"
      "subnumber=2\n"
      "[1018Sub0]\n"
      "ParameterName=n\n"
      "DataType=5\n"
      "AccessType=Const\n"
      "[1018SUB0A]\n"
      "ParameterName=a\n"
      "DataType=7\n"
      "AccessType=ro\n",
      "x.eds", 1);
  EXPECT_THAT(messages(loaded.diagnostics), IsEmpty());
  ASSERT_TRUE(loaded.ok());
  EXPECT_EQ(loaded.value->vendor_name, "ACME  GmbH");
  EXPECT_EQ(loaded.value->find({0x1000, 0})->value, bytes({0x91, 0, 0, 0}));
  EXPECT_NE(loaded.value->find({0x1018, 10}), nullptr);
}

TEST(SloppyFile, Latin1NamesBecomeUtf8ButStringValuesAreTheDevices) {
  const auto loaded =
      load(file_with("[OptionalObjects]\nSupportedObjects=1\n1=0x1008\n"
                     "[1008]\nParameterName=Ger\xE4t\nDataType=9\nAccessType=const\n"
                     "DefaultValue=Z\xE4hler;2\n"),
           "x.eds", 1);
  EXPECT_THAT(messages(loaded.diagnostics),
              ElementsAre("x.eds:18: warning: this line is neither ASCII nor UTF-8; such text is "
                          "read as Latin-1"));
  ASSERT_TRUE(loaded.ok());
  EXPECT_EQ(loaded.value->find({0x1008, 0})->name, "Ger\xC3\xA4t");
  EXPECT_EQ(loaded.value->find({0x1008, 0})->value,
            bytes({'Z', 0xE4, 'h', 'l', 'e', 'r', ';', '2'}));
}

TEST(SloppyFile, EmptyValuesAreNotGiven) {
  EXPECT_THAT(messages(file_with("LowLimit=\nHighLimit=\nPDOMapping=\nSubNumber=\nObjFlags=\n")),
              IsEmpty());
}

TEST(SloppyFile, SectionsForOthersAreLeftAlone) {
  EXPECT_THAT(
      messages(file_with("[Tools]\nItems=1\n[Tool1]\nName=x\n[SupportedModules]\nNrOfEntries=1\n"
                         "[M1ModuleInfo]\n[DynamicChannels]\n[1000ObjectLinks]\n"
                         "[1000Denotation]\n[Comments]\nLines=0\n")),
      IsEmpty());
}

TEST(SloppyFile, AnUnknownSectionIsANote) {
  EXPECT_THAT(messages(file_with("[Vendor Stuff]\nx=1\n")),
              ElementsAre("x.eds:14:1: note: section 'Vendor Stuff' is not known; ignored"));
}

TEST(SloppyFile, MissingHeadSectionsAndListsAreWarnings) {
  const auto loaded = load(test::kDeviceType, "x.eds", 1);
  EXPECT_TRUE(loaded.ok());
  EXPECT_THAT(messages(loaded.diagnostics),
              ElementsAre("x.eds: warning: there is no section [FileInfo]",
                          "x.eds: warning: there is no section [DeviceInfo]",
                          "x.eds: warning: there is no list of objects ([MandatoryObjects] and so "
                          "on)"));
}

TEST(SloppyFile, DataTypeObjectsAreNoValues) {
  const auto loaded = load(file_with("[OptionalObjects]\nSupportedObjects=2\n1=5\n2=0x40\n"
                                     "[0005]\nParameterName=Dummy\nObjectType=5\nDataType=5\n"
                                     "AccessType=ro\n[0040]\nParameterName=s\nObjectType=6\n"),
                           "x.eds", 1);
  EXPECT_THAT(messages(loaded.diagnostics), IsEmpty());
  ASSERT_TRUE(loaded.ok());
  EXPECT_EQ(loaded.value->objects.size(), 1U);
}

TEST(SloppyFile, AnArrayThatSaysVarIsTakenForWhatItIs) {
  const auto loaded = load(file_with("[OptionalObjects]\nSupportedObjects=1\n1=0x1010\n"
                                     "[1010]\nParameterName=Store\nObjectType=7\nSubNumber=1\n"
                                     "[1010sub1]\nParameterName=all\nDataType=7\nAccessType=rw\n"),
                           "x.eds", 1);
  ASSERT_TRUE(loaded.ok());
  EXPECT_THAT(messages(loaded.diagnostics),
              ElementsAre("x.eds:17:1: warning: '1010' has sub-indices, but its ObjectType has "
                          "none; taken as RECORD",
                          "x.eds:17:1: warning: '1010' has no sub-index 0; 1 is assumed"));
  EXPECT_EQ(loaded.value->find({0x1010, 0})->value, bytes({1}));
  EXPECT_EQ(loaded.value->find(0x1010)->type, od::ObjectType::record);
}

}  // namespace
}  // namespace linegate::eds

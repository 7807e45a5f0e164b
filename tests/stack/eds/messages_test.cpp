// SPDX-License-Identifier: Apache-2.0
// Every finding has its line and a description; all findings of a file are reported at once.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "stack/od/dictionary.h"

#include "tests/stack/eds/files.h"

namespace linegate::eds {
namespace {

using test::file_with;
using test::messages;
using testing::ElementsAre;

// One more object, listed in line 16 and described from line 17 on.
std::string with_object(std::string_view keys) {
  return file_with("[OptionalObjects]\nSupportedObjects=1\n1=0x2000\n[2000]\n" + std::string(keys));
}

// Lines 18 to 20
constexpr std::string_view kGoodKeys = "ParameterName=a\nDataType=5\nAccessType=rw\n";

TEST(Messages, EmptyFile) {
  for (const char* text : {"", "\n\n", "; nothing\n"}) {
    const auto loaded = load(text, "x.eds", 1);
    EXPECT_FALSE(loaded.ok());
    EXPECT_THAT(messages(loaded.diagnostics),
                ElementsAre("x.eds: warning: there is no section [FileInfo]",
                            "x.eds: warning: there is no section [DeviceInfo]",
                            "x.eds: error: no object is described; this describes no device"));
  }
}

TEST(Messages, BinaryGarbage) {
  std::string garbage;
  for (unsigned i = 0; i < 4096; ++i) {
    garbage += static_cast<char>(i * 7919 >> 3U);
  }
  garbage[10] = '\0';
  const auto loaded = load(garbage, "x.eds", 1);
  EXPECT_FALSE(loaded.ok());
  EXPECT_THAT(messages(loaded.diagnostics),
              ElementsAre("x.eds:1: error: the file is not a text file (it contains a NUL "
                          "character)"));
}

TEST(Messages, ALineOfAMegabyte) {
  const std::string megabyte(1U << 20U, '7');
  const auto loaded =
      load(with_object(std::string(kGoodKeys) + "DefaultValue=" + megabyte), "x.eds", 1);
  EXPECT_TRUE(loaded.ok());
  EXPECT_THAT(messages(loaded.diagnostics),
              ElementsAre("x.eds:21:14: warning: DefaultValue: '" + megabyte.substr(0, 40) +
                          "...' has more than 64 bits; ignored"));
}

TEST(Messages, UnterminatedSection) {
  const auto loaded = load(file_with("[1001\nParameterName=Error register\n"), "x.eds", 1);
  EXPECT_FALSE(loaded.ok());
  EXPECT_THAT(messages(loaded.diagnostics),
              testing::Contains("x.eds:14:1: error: section name '[1001' is not closed by ']'"));
}

TEST(Messages, AllFindingsComeAtOnceInTheOrderOfTheFile) {
  const auto loaded = load(
      "[FileInfo]\nEDSVersion=five\n[DeviceInfo]\nVendorNumber=0x1FFFFFFFF\n"
      "[OptionalObjects]\nSupportedObjects=1\n1=0x2000\n2=zwei\n"
      "[2000]\nDataType=5\nAccessType=rx\nDefaultValue=300\nPDOMapping=2\n",
      "x.eds", 1);
  EXPECT_FALSE(loaded.ok());
  EXPECT_THAT(
      messages(loaded.diagnostics),
      ElementsAre(
          "x.eds:2:12: warning: EDSVersion: 'five' is not a version; 4.0 is assumed",
          "x.eds:4:14: warning: VendorNumber: '0x1FFFFFFFF' is not in 0 to 4294967295; ignored",
          "x.eds:6:18: warning: SupportedObjects is 1, but 2 are listed",
          "x.eds:8:3: error: index of an object: 'zwei' is not a number",
          "x.eds:9:1: warning: '2000' has no ParameterName; its section's name is used",
          "x.eds:11:12: warning: AccessType: 'rx' is not known; taken as ro",
          "x.eds:12:14: warning: DefaultValue: '300' does not fit UNSIGNED8 (0 to 255); ignored",
          "x.eds:13:12: warning: PDOMapping: '2' is not in 0 to 1; ignored"));
}

TEST(Messages, ListedObjectWithoutSection) {
  EXPECT_THAT(messages(file_with("[OptionalObjects]\nSupportedObjects=1\n1=0x1003\n")),
              ElementsAre("x.eds:16:3: warning: object 1003h is listed, but has no section"));
}

TEST(Messages, SectionThatIsNotListed) {
  EXPECT_THAT(messages(file_with("[2000]\n" + std::string(kGoodKeys))),
              ElementsAre("x.eds:14:1: warning: object 2000h is in no list of objects"));
}

TEST(Messages, ObjectListedTwice) {
  EXPECT_THAT(messages(file_with("[OptionalObjects]\nSupportedObjects=1\n1=0x1000\n")),
              ElementsAre("x.eds:16:3: warning: object 1000h is already listed in line 8"));
}

TEST(Messages, IndicesOverFFFFh) {
  const auto loaded =
      load(file_with("[OptionalObjects]\nSupportedObjects=2\n1=0x10000\n2=0\n[12345]\n[0000]\n"),
           "x.eds", 1);
  EXPECT_FALSE(loaded.ok());
  EXPECT_THAT(
      messages(loaded.diagnostics),
      ElementsAre(
          "x.eds:16:3: error: index of an object: '0x10000' is not in 1h to FFFFh",
          "x.eds:17:3: error: index of an object: '0' is not in 1h to FFFFh",
          "x.eds:18:1: warning: section '12345' is ignored: its index is not in 1h to FFFFh",
          "x.eds:19:1: warning: section '0000' is ignored: its index is not in 1h to FFFFh"));
}

TEST(Messages, SectionNamesThatAreAlmostRight) {
  EXPECT_THAT(
      messages(file_with("[1000sbu1]\n[1000sub100]\n[1000subFF]\n[1000sub]\n[1000sub-1]\n")),
      ElementsAre(
          "x.eds:14:1: warning: section '1000sbu1' is ignored: its name is not known",
          "x.eds:15:1: warning: section '1000sub100' is ignored: its sub-index is not in 0 to FFh",
          "x.eds:17:1: warning: section '1000sub' is ignored: its sub-index is not in 0 to FFh",
          "x.eds:18:1: warning: section '1000sub-1' is ignored: its sub-index is not in 0 to "
          "FFh"));
}

// Sub-index FFh describes the structure of its object (CiA 301 7.4.2); many files contain it.
TEST(Messages, NoneForTheStructureOfAnObject) {
  for (const char* number : {"2", "3"}) {
    EXPECT_THAT(
        messages(with_object("ParameterName=r\nObjectType=9\nSubNumber=" + std::string(number) +
                             "\n[2000sub0]\nParameterName=n\nDataType=5\nAccessType=ro\n"
                             "DefaultValue=1\n[2000sub1]\nParameterName=v\nDataType=5\n"
                             "AccessType=rw\n[2000subFF]\nParameterName=Structure\nDataType=7\n"
                             "AccessType=const\n")),
        ElementsAre())
        << number;
  }
}

TEST(Messages, SubIndexDescribedTwice) {
  const std::string sub = "ParameterName=a\nDataType=5\nAccessType=ro\n";
  EXPECT_THAT(messages(with_object("ParameterName=r\nObjectType=9\nSubNumber=1\n[2000sub0]\n" +
                                   sub + "[2000sub00]\n" + sub)),
              ElementsAre("x.eds:25:1: warning: section '2000sub00' is ignored: it is already "
                          "described in line 21"));
}

TEST(Messages, SubIndicesOfNoObject) {
  EXPECT_THAT(messages(file_with("[2000sub1]\n[2000Name]\n")),
              ElementsAre("x.eds:14:1: warning: '2000sub1' is ignored: object 2000h has no section",
                          "x.eds:15:1: warning: '2000Name' is ignored: object 2000h has no "
                          "section"));
}

TEST(Messages, WrongSubNumber) {
  EXPECT_THAT(messages(with_object("ParameterName=r\nObjectType=8\nSubNumber=3\n[2000sub0]\n" +
                                   std::string(kGoodKeys))),
              ElementsAre("x.eds:20:11: warning: SubNumber is 3, but 1 sub-indices are described"));
}

TEST(Messages, RecordWithoutSubIndices) {
  EXPECT_THAT(messages(with_object("ParameterName=r\nObjectType=9\nSubNumber=2\n")),
              ElementsAre("x.eds:17:1: warning: '2000' has no sub-indices; it is left out",
                          "x.eds:20:11: warning: SubNumber is 2, but 0 sub-indices are described"));
}

TEST(Messages, UnknownObjectType) {
  EXPECT_THAT(messages(with_object(std::string(kGoodKeys) + "ObjectType=3\n")),
              ElementsAre("x.eds:21:12: warning: ObjectType: 3 is not known; taken as VAR"));
}

TEST(Messages, DataTypeMissingOrUnknown) {
  EXPECT_THAT(messages(with_object("ParameterName=a\nAccessType=ro\n")),
              ElementsAre("x.eds:17:1: warning: '2000' has no DataType; it is left out"));
  EXPECT_THAT(messages(with_object("ParameterName=a\nDataType=0x10000\nAccessType=ro\n")),
              ElementsAre("x.eds:17:1: warning: '2000' has no DataType; it is left out",
                          "x.eds:19:10: warning: DataType: '0x10000' is not in 0 to 65535; "
                          "ignored"));
  const auto loaded =
      load(with_object("ParameterName=a\nDataType=0x40\nAccessType=ro\nDefaultValue=0102\n"),
           "x.eds", 1);
  EXPECT_THAT(messages(loaded.diagnostics),
              ElementsAre("x.eds:19:10: warning: DataType: 0040h is not known; taken as bytes"));
  ASSERT_TRUE(loaded.ok());
  EXPECT_EQ(loaded.value->find({0x2000, 0})->value, test::bytes({1, 2}));
}

TEST(Messages, AConfiguredValueWithoutDataTypeIsAnError) {
  const auto loaded =
      load(with_object("ParameterName=a\nAccessType=rw\nParameterValue=1\n"), "x.dcf", 1);
  EXPECT_FALSE(loaded.ok());
  EXPECT_THAT(messages(loaded.diagnostics),
              ElementsAre("x.dcf:17:1: error: '2000' has no DataType; it is left out"));
}

TEST(Messages, MissingNameAndAccess) {
  EXPECT_THAT(messages(with_object("DataType=5\n")),
              ElementsAre("x.eds:17:1: warning: '2000' has no ParameterName; its section's name "
                          "is used",
                          "x.eds:17:1: warning: '2000' has no AccessType; taken as ro"));
}

TEST(Messages, BadDefaultsAndLimitsAreWarnings) {
  const auto loaded =
      load(with_object(std::string(kGoodKeys) + "DefaultValue=0x1G\nLowLimit=-1\nHighLimit=256\n"),
           "x.eds", 1);
  ASSERT_TRUE(loaded.ok());
  EXPECT_THAT(
      messages(loaded.diagnostics),
      ElementsAre(
          "x.eds:21:14: warning: DefaultValue: '0x1G' is not a number; ignored",
          "x.eds:22:10: warning: LowLimit: '-1' does not fit UNSIGNED8 (0 to 255); ignored",
          "x.eds:23:11: warning: HighLimit: '256' does not fit UNSIGNED8 (0 to 255); ignored"));
  const od::VariableDescription* variable = loaded.value->find({0x2000, 0});
  EXPECT_TRUE(variable->value.empty() && variable->low_limit.empty());
}

TEST(Messages, ABadParameterValueIsAnError) {
  const auto loaded = load(
      with_object(std::string(kGoodKeys) + "DefaultValue=1\nParameterValue=256\n"), "x.dcf", 1);
  EXPECT_FALSE(loaded.ok());
  EXPECT_THAT(messages(loaded.diagnostics),
              ElementsAre("x.dcf:22:16: error: ParameterValue: '256' does not fit UNSIGNED8 (0 to "
                          "255)"));
}

TEST(Messages, ValuesOutsideTheLimits) {
  EXPECT_THAT(
      messages(with_object(std::string(kGoodKeys) +
                           "LowLimit=10\nHighLimit=20\nDefaultValue=9\nParameterValue=21\n")),
      ElementsAre("x.eds:23:14: warning: DefaultValue: '9' is outside LowLimit and "
                  "HighLimit",
                  "x.eds:24:16: warning: ParameterValue: '21' is outside LowLimit and "
                  "HighLimit"));
  EXPECT_THAT(
      messages(with_object(std::string(kGoodKeys) + "LowLimit=20\nHighLimit=10\nDefaultValue=9\n")),
      ElementsAre("x.eds:21:10: warning: LowLimit is more than HighLimit; both are "
                  "ignored"));
}

TEST(Messages, AFormulaNeedsANodeIdAndIsToldOnce) {
  const auto loaded = load(with_object("ParameterName=a\nDataType=7\nAccessType=rw\n"
                                       "DefaultValue=$NODEID+0x180\nLowLimit=$NODEID\n"),
                           "x.eds", 0);
  EXPECT_FALSE(loaded.ok());
  EXPECT_THAT(messages(loaded.diagnostics),
              ElementsAre("x.eds:22:10: error: LowLimit: '$NODEID' depends on the node-ID, but "
                          "none is given"));
  EXPECT_TRUE(load(file_with(""), "x.eds", 0).ok());
}

TEST(Messages, BadNodeIds) {
  EXPECT_THAT(messages(file_with(""), 128),
              ElementsAre("x.eds: error: node-ID 128 is not in 1 to 127"));
  for (const std::string number : {"0", "128"}) {
    const std::string text = file_with("[DeviceCommissioning]\nNodeID=" + number + "\n");
    EXPECT_FALSE(load(text, "x.dcf", 0).ok());
    EXPECT_TRUE(load(text, "x.dcf", 1).ok());
    EXPECT_THAT(messages(text, 0),
                ElementsAre("x.eds:15:8: error: NodeID: " + number + " is not in 1 to 127"));
    EXPECT_THAT(messages(text, 1),
                ElementsAre("x.eds:15:8: warning: NodeID: " + number + " is not in 1 to 127"));
  }
  EXPECT_THAT(messages(file_with("[DeviceCommissioning]\nNodeID=five\n"), 0),
              ElementsAre("x.eds:15:8: error: NodeID: 'five' is not a number"));
}

TEST(Messages, DummyUsage) {
  EXPECT_THAT(
      messages(file_with(std::string(test::kDummyUsage) +
                         "Dummy0000=1\nDummy0020=1\nDummyX=1\nDumm=1\n"
                         "Dummy001F=yes\n")),
      ElementsAre("x.eds:22:1: warning: key 'Dummy0000' is not Dummy0001 to Dummy001F; ignored",
                  "x.eds:23:1: warning: key 'Dummy0020' is not Dummy0001 to Dummy001F; ignored",
                  "x.eds:24:1: warning: key 'DummyX' is not Dummy0001 to Dummy001F; ignored",
                  "x.eds:25:1: warning: key 'Dumm' is not Dummy0001 to Dummy001F; ignored",
                  "x.eds:26:11: warning: Dummy001F: 'yes' is not a number; ignored"));
}

TEST(Messages, NewerEdsVersion) {
  std::string text = file_with("");
  text.replace(text.find("4.0"), 3, "5.1");
  EXPECT_THAT(messages(text), ElementsAre("x.eds:2:12: warning: EDSVersion: '5.1' is newer than "
                                          "4.0; it is read as 4.0"));
}

}  // namespace
}  // namespace linegate::eds

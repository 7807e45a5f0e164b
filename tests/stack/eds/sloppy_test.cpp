// Files as one meets them: not as CiA 306 wants them, but it is clear what they mean.
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
  EXPECT_THAT(messages(loaded.diagnostics), IsEmpty());
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
      messages(file_with("[Tools]\nItems=1\n[Tool1]\nName=x\n[SupportedModules]\nNrOfEntries=0\n"
                         "[M1ModuleInfo]\n[M1SubExtend6000]\n[DynamicChannels]\n[1000ObjectLinks]\n"
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

// SPDX-License-Identifier: Apache-2.0
#include "stack/eds/ini.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/stack/eds/files.h"

namespace linegate::eds {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

struct Parsed {
  explicit Parsed(std::string_view file) : text(file), report("f"), ini(Ini::parse(text, report)) {
    said = test::messages(report.take());
  }
  std::string text;
  Report report;
  Ini ini;
  std::vector<std::string> said;
};

TEST(Ini, SectionsKeysAndValuesWithTheirPlaces) {
  const Parsed file("; comment\n[One]\n  Key = some value \n[two]\nEmpty=\nx=a=b\n");
  EXPECT_THAT(file.said, IsEmpty());
  ASSERT_EQ(file.ini.sections().size(), 2U);
  const Section& one = file.ini.sections()[0];
  EXPECT_EQ(one.name, "One");
  EXPECT_EQ(one.place.line, 2U);
  ASSERT_EQ(one.entries.size(), 1U);
  EXPECT_EQ(one.entries[0].key, "Key");
  EXPECT_EQ(one.entries[0].value, "some value");
  EXPECT_EQ(one.entries[0].key_place.line, 3U);
  EXPECT_EQ(one.entries[0].key_place.column, 3U);
  EXPECT_EQ(one.entries[0].value_place.column, 9U);
  EXPECT_EQ(file.ini.find("TWO")->find("empty")->value, "");
  EXPECT_EQ(file.ini.find("TWO")->find("X")->value, "a=b");
  EXPECT_EQ(file.ini.find("three"), nullptr);
  EXPECT_EQ(one.find("nokey"), nullptr);
}

TEST(Ini, EveryLineEndCountsOnce) {
  const Parsed file("[a]\r\nb=1\rc=2\nd=3\r\n\r\ne=4");
  EXPECT_THAT(file.said, IsEmpty());
  const Section& section = file.ini.sections().at(0);
  ASSERT_EQ(section.entries.size(), 4U);
  EXPECT_EQ(section.entries[0].value, "1");
  EXPECT_EQ(section.entries[1].key_place.line, 3U);
  EXPECT_EQ(section.entries[2].key_place.line, 4U);
  EXPECT_EQ(section.entries[3].key_place.line, 6U);
}

TEST(Ini, StrayBlanksAndAByteOrderMarkDoNotMatter) {
  const Parsed file("\xEF\xBB\xBF\t [ a ] ; why\n \t\n\tb\t=\t1\t\n   ; c=2\n");
  EXPECT_THAT(file.said, IsEmpty());
  ASSERT_NE(file.ini.find("a"), nullptr);
  ASSERT_EQ(file.ini.find("a")->entries.size(), 1U);
  EXPECT_EQ(file.ini.find("a")->entries[0].value, "1");
}

TEST(Ini, OfDuplicatesTheFirstCounts) {
  const Parsed file("[a]\nk=1\nK=2\n[b]\nk=3\n[A]\nk=4\nk=5\n");
  EXPECT_THAT(file.said,
              ElementsAre("f:3:1: warning: key 'K' was already given in line 2; ignored",
                          "f:6:1: warning: section 'A' was already given in line 1; ignored"));
  EXPECT_EQ(file.ini.find("a")->find("k")->value, "1");
  EXPECT_EQ(file.ini.find("b")->find("k")->value, "3");
}

// Independent of the number of keys and of the keys of the previous section.
TEST(Ini, KeysGivenTwiceAmongMany) {
  std::string text = "[A]\n";
  for (int i = 1; i <= 200; ++i) {
    text += "k" + std::to_string(i) + "=" + std::to_string(i) + "\n";
  }
  text += "K7=x\nK190=x\n[B]\nk7=1\nk190=2\nK7=3\n";
  const Parsed parsed(text);
  EXPECT_THAT(parsed.said,
              ElementsAre("f:202:1: warning: key 'K7' was already given in line 8; ignored",
                          "f:203:1: warning: key 'K190' was already given in line 191; ignored",
                          "f:207:1: warning: key 'K7' was already given in line 205; ignored"));
  EXPECT_EQ(parsed.ini.find("A")->entries.size(), 200U);
  EXPECT_EQ(parsed.ini.find("B")->find("K190")->value, "2");
}

TEST(Ini, LinesThatAreNeitherAreToldAndSkipped) {
  const Parsed file("lost=1\n[a]\nnonsense\nk=1\n[b] junk\n");
  EXPECT_THAT(file.said,
              ElementsAre("f:1:1: warning: 'lost' is in no section; ignored",
                          "f:3:1: warning: 'nonsense' is neither a section nor key=value; ignored",
                          "f:5:4: warning: text behind the section name is ignored"));
  EXPECT_EQ(file.ini.find("a")->find("k")->value, "1");
  EXPECT_NE(file.ini.find("b"), nullptr);
}

TEST(Ini, AnUnterminatedSectionNameIsAnError) {
  const Parsed file("[a]\nk=1\n  [b\nk=2\n");
  EXPECT_THAT(file.said, ElementsAre("f:3:3: error: section name '[b' is not closed by ']'"));
  EXPECT_EQ(file.ini.find("b")->find("k")->value, "2");
}

TEST(Ini, WhatIsNoTextHasNoSections) {
  const Parsed binary(
      std::string_view("\x7F"
                       "ELF\n\x01[a]\0\0k=1\n",
                       16));
  EXPECT_THAT(binary.said,
              ElementsAre("f:2: error: the file is not a text file (it contains a NUL character)"));
  EXPECT_THAT(binary.ini.sections(), IsEmpty());
  const Parsed utf16(std::string_view("\xFF\xFE[\0a\0]\0", 8));
  EXPECT_THAT(utf16.said,
              ElementsAre("f: error: the file is UTF-16; it must be ASCII, Latin-1 or UTF-8"));
}

TEST(Ini, ALineOfAMegabyteIsShortInMessages) {
  const Parsed file("[a]\n" + std::string(1U << 20U, 'x') + "\nk=1\n");
  EXPECT_THAT(file.said, ElementsAre("f:2:1: warning: '" + std::string(40, 'x') +
                                     "...' is neither a section nor key=value; ignored"));
  EXPECT_EQ(file.ini.find("a")->find("k")->value, "1");
}

TEST(Report, KeepsTheFirstThousandFindingsAndCountsTheRest) {
  Report report("f");
  for (unsigned i = 0; i < 1001; ++i) {
    report.warning({i + 1, 0}, "w");
  }
  report.error({5000, 0}, "e");
  EXPECT_TRUE(report.has_errors());
  const std::vector<Diagnostic> findings = report.take();
  ASSERT_EQ(findings.size(), 1001U);
  EXPECT_EQ(to_string(findings.back()), "f: error: 2 more findings, 1 of them errors");
  EXPECT_FALSE(report.has_errors());
}

}  // namespace
}  // namespace linegate::eds

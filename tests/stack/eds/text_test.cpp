// SPDX-License-Identifier: Apache-2.0
#include "stack/eds/text.h"

#include <gtest/gtest.h>

#include "tests/stack/eds/files.h"

namespace linegate::eds {
namespace {

TEST(Text, TrimsBlanksOnBothSides) {
  EXPECT_EQ(trim(" \t a b \f\v"), "a b");
  EXPECT_EQ(trim("   "), "");
}

TEST(Text, ComparesWithoutCase) {
  EXPECT_TRUE(equal_ignoring_case("DefaultVALUE", "defaultvalue"));
  EXPECT_FALSE(equal_ignoring_case("a", "ab"));
  EXPECT_FALSE(equal_ignoring_case("a", "b"));
}

TEST(Text, QuotesAreShortAndPrintable) {
  EXPECT_EQ(quote("a\x01\xE4z"), "'a??z'");
  EXPECT_EQ(quote(std::string(40, 'x')), "'" + std::string(40, 'x') + "'");
  EXPECT_EQ(quote(std::string(41, 'x')), "'" + std::string(40, 'x') + "...'");
}

TEST(Text, HexadecimalAsInCiaDocuments) {
  EXPECT_EQ(hex(0x1A, 4), "001Ah");
  EXPECT_EQ(hex(0x12345, 4), "12345h");
  EXPECT_EQ(hex(0, 1), "0h");
}

TEST(Text, Utf8StaysAndEverythingElseIsLatin1) {
  EXPECT_EQ(to_utf8("Z\xC3\xA4hler"), "Z\xC3\xA4hler");
  EXPECT_EQ(to_utf8("Z\xE4hler \xB0"
                    "C"),
            "Z\xC3\xA4hler \xC2\xB0"
            "C");
}

TEST(Text, KnowsUtf8) {
  for (const char* good : {"", "a", "\xC2\x80", "\xE0\xA0\x80", "\xED\x9F\xBF", "\xF0\x90\x80\x80",
                           "\xF4\x8F\xBF\xBF"}) {
    EXPECT_TRUE(is_utf8(good)) << good;
  }
  for (const char* bad : {"\x80", "\xC1\xBF", "\xC3", "\xC3\x41", "\xE0\x9F\xBF", "\xED\xA0\x80",
                          "\xF0\x8F\xBF\xBF", "\xF4\x90\x80\x80", "\xF8\x88\x80\x80\x80", "\xFF"}) {
    EXPECT_FALSE(is_utf8(bad)) << bad;
  }
}

TEST(Text, Utf16IsLittleEndianWithSurrogates) {
  EXPECT_EQ(to_utf16("A\xC3\xA4\xF0\x9F\x98\x80"),
            test::bytes({0x41, 0, 0xE4, 0, 0x3D, 0xD8, 0x00, 0xDE}));
}

}  // namespace
}  // namespace linegate::eds

// SPDX-License-Identifier: Apache-2.0
#include "stack/base/short_text.h"

#include <gtest/gtest.h>

namespace linegate {
namespace {

TEST(ShortText, ATextThatFitsIsUnchanged) {
  EXPECT_EQ(short_text("", 3), "");
  EXPECT_EQ(short_text("12345", 5), "12345");
}

TEST(ShortText, ALongerOneEndsWithDots) {
  EXPECT_EQ(short_text("123456", 5), "12...");
  EXPECT_EQ(short_text("123456", 3), "...");
}

TEST(ShortText, CharactersRemainWhole) {
  EXPECT_EQ(short_text("\xC3\xA9\xC3\xA9\xC3\xA9", 5), "\xC3\xA9...");
  EXPECT_EQ(short_text("\xC3\xA9\xC3\xA9\xC3\xA9", 4), "...");
  EXPECT_EQ(short_text("\xBF\xBF\xBF\xBF\xBF", 4), "...") << "not UTF-8";
}

}  // namespace
}  // namespace linegate

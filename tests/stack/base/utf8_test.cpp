// SPDX-License-Identifier: Apache-2.0
#include "stack/base/utf8.h"

#include <string>
#include <string_view>

#include <gtest/gtest.h>

namespace linegate {
namespace {

TEST(Utf8, EachCodePointComesBack) {
  for (std::uint32_t code = 0; code <= 0x10'FFFF; code += code < 0x1'0000 ? 1 : 0x3F) {
    if (code >= 0xD800 && code < 0xE000)
      continue;
    std::string text;
    append_utf8(code, text);
    const std::size_t size = code < 0x80 ? 1 : code < 0x800 ? 2 : code < 0x1'0000 ? 3 : 4;
    ASSERT_EQ(text.size(), size) << code;
    text += '.';
    std::string_view rest = text;
    ASSERT_EQ(take_code_point(rest), code);
    ASSERT_EQ(rest, ".") << code;
  }
}

TEST(Utf8, WhatIsNoCodePointIsLeft) {
  for (const char* const text :
       {"\x80", "\xC0\x80", "\xC1\x81", "\xC3", "\xC3.", "\xE0\x80\x80", "\xE2\x82", "\xED\xA0\x80",
        "\xF0\x80\x80\x80", "\xF4\x90\x80\x80", "\xF5\x80\x80\x80", "\xFF"}) {
    std::string_view rest = text;
    EXPECT_FALSE(take_code_point(rest).has_value()) << text;
    EXPECT_EQ(rest, text);
  }
}

}  // namespace
}  // namespace linegate

// SPDX-License-Identifier: Apache-2.0
// The imports of one library are replaced, and no others.
#include "bridges/dds/guard/imports.h"

#include <gtest/gtest.h>

namespace linegate::dds::guard {
namespace {

TEST(Imports, OfAnUnknownLibraryOrFunctionAreRefused) {
  int never = 0;
  EXPECT_FALSE(replace_import("libfastrtps.so", "no_function_has_this_name", &never));
  EXPECT_FALSE(replace_import("libno-such-library.so", "recv", &never));
}

// Segments that begin or end within a page. What is beside them in their last page is written while
// the library runs.
TEST(Imports, ArePartsOfProtectedPages) {
  constexpr std::size_t kPage = 0x1000;
  constexpr std::uintptr_t kBegin = 0x7000'2D10;
  constexpr std::size_t kSize = 0x2400;  // up to 7000'5110h
  EXPECT_FALSE(is_relro(0x7000'1FF8, kBegin, kSize, kPage));
  EXPECT_TRUE(is_relro(0x7000'2000, kBegin, kSize, kPage));
  EXPECT_TRUE(is_relro(kBegin, kBegin, kSize, kPage));
  EXPECT_TRUE(is_relro(0x7000'4FF8, kBegin, kSize, kPage));
  EXPECT_FALSE(is_relro(0x7000'5000, kBegin, kSize, kPage));
  EXPECT_FALSE(is_relro(0x7000'5108, kBegin, kSize, kPage)) << "in the segment, but not protected";
  EXPECT_FALSE(is_relro(0x7000'2D10, kBegin, 0x100, kPage)) << "a part of one page";
  EXPECT_TRUE(is_relro(0x7000'5FF8, kBegin, 0x32F0, kPage)) << "the end of a page";
  EXPECT_FALSE(is_relro(0x7000'6000, kBegin, 0x32F0, kPage));
}

}  // namespace
}  // namespace linegate::dds::guard

// SPDX-License-Identifier: Apache-2.0
#include "stack/od/data_type.h"

#include <gtest/gtest.h>

namespace linegate::od {
namespace {

struct Row {
  unsigned code;
  unsigned bits;
  unsigned bytes;
  const char* name;
};

// CiA 301, 7.4.7.1 (object dictionary data types).
constexpr Row kTable[] = {
    {0x01, 1, 1, "BOOLEAN"},          {0x02, 8, 1, "INTEGER8"},
    {0x03, 16, 2, "INTEGER16"},       {0x04, 32, 4, "INTEGER32"},
    {0x05, 8, 1, "UNSIGNED8"},        {0x06, 16, 2, "UNSIGNED16"},
    {0x07, 32, 4, "UNSIGNED32"},      {0x08, 32, 4, "REAL32"},
    {0x09, 0, 0, "VISIBLE_STRING"},   {0x0A, 0, 0, "OCTET_STRING"},
    {0x0B, 0, 0, "UNICODE_STRING"},   {0x0C, 48, 6, "TIME_OF_DAY"},
    {0x0D, 48, 6, "TIME_DIFFERENCE"}, {0x0F, 0, 0, "DOMAIN"},
    {0x10, 24, 3, "INTEGER24"},       {0x11, 64, 8, "REAL64"},
    {0x12, 40, 5, "INTEGER40"},       {0x13, 48, 6, "INTEGER48"},
    {0x14, 56, 7, "INTEGER56"},       {0x15, 64, 8, "INTEGER64"},
    {0x16, 24, 3, "UNSIGNED24"},      {0x18, 40, 5, "UNSIGNED40"},
    {0x19, 48, 6, "UNSIGNED48"},      {0x1A, 56, 7, "UNSIGNED56"},
    {0x1B, 64, 8, "UNSIGNED64"},
};

TEST(DataType, HasTheSizesAndNamesOfCia301) {
  for (const Row& row : kTable) {
    const auto type = static_cast<DataType>(row.code);
    EXPECT_EQ(bit_size(type), row.bits) << row.name;
    EXPECT_EQ(byte_size(type), row.bytes) << row.name;
    EXPECT_EQ(has_fixed_size(type), row.bytes != 0) << row.name;
    EXPECT_EQ(name(type), row.name);
    const std::string_view word = row.name;
    EXPECT_EQ(is_signed(type), word.starts_with("INTEGER")) << row.name;
    EXPECT_EQ(is_integer(type),
              word.find("INTEGER") == 0 || word.starts_with("UNSIGNED") || word == "BOOLEAN")
        << row.name;
    EXPECT_EQ(is_real(type), word.starts_with("REAL")) << row.name;
    EXPECT_EQ(is_string(type), word.ends_with("STRING")) << row.name;
  }
}

TEST(DataType, UnknownCodesHaveNoSizeAndNoName) {
  for (const unsigned code : {0x00U, 0x0EU, 0x17U, 0x20U, 0xFFFFU}) {
    const auto type = static_cast<DataType>(code);
    EXPECT_EQ(bit_size(type), 0U);
    EXPECT_EQ(byte_size(type), 0U);
    EXPECT_FALSE(has_fixed_size(type));
    EXPECT_EQ(name(type), "unknown");
    EXPECT_FALSE(is_integer(type) || is_real(type) || is_string(type));
  }
}

}  // namespace
}  // namespace linegate::od

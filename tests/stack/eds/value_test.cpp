// SPDX-License-Identifier: Apache-2.0
#include "stack/eds/value.h"

#include <gtest/gtest.h>

#include "tests/stack/eds/files.h"

namespace linegate::eds {
namespace {

using od::DataType;
using test::bytes;

struct Good {
  DataType type;
  std::string_view text;
  std::vector<std::byte> expected;
};

TEST(Value, BecomesTheBytesOfItsType) {
  const Good table[] = {
      {DataType::boolean, "0", bytes({0})},
      {DataType::boolean, "1", bytes({1})},
      {DataType::boolean, "TRUE", bytes({1})},
      {DataType::boolean, "false", bytes({0})},
      {DataType::unsigned8, "255", bytes({255})},
      {DataType::unsigned8, "0xff", bytes({255})},
      {DataType::unsigned8, "0XFF", bytes({255})},
      {DataType::unsigned8, "0377", bytes({255})},
      {DataType::unsigned8, "+7", bytes({7})},
      {DataType::unsigned8, "0", bytes({0})},
      {DataType::unsigned8, "-0", bytes({0})},
      {DataType::unsigned8, "7 ; seven", bytes({7})},
      {DataType::unsigned16, "0x1234", bytes({0x34, 0x12})},
      {DataType::unsigned24, "0x123456", bytes({0x56, 0x34, 0x12})},
      {DataType::unsigned64, "0xFFFFFFFFFFFFFFFF", bytes({255, 255, 255, 255, 255, 255, 255, 255})},
      {DataType::integer8, "-128", bytes({0x80})},
      {DataType::integer8, "0x80", bytes({0x80})},
      {DataType::integer8, "0xFF", bytes({0xFF})},
      {DataType::integer16, "-2", bytes({0xFE, 0xFF})},
      {DataType::integer64, "-9223372036854775808", bytes({0, 0, 0, 0, 0, 0, 0, 0x80})},
      {DataType::real32, "1.5", bytes({0, 0, 0xC0, 0x3F})},
      {DataType::real32, "-2", bytes({0, 0, 0, 0xC0})},
      {DataType::real32, "+1e0", bytes({0, 0, 0x80, 0x3F})},
      {DataType::real32, "0x3F800000", bytes({0, 0, 0x80, 0x3F})},
      {DataType::real64, "1.5", bytes({0, 0, 0, 0, 0, 0, 0xF8, 0x3F})},
      {DataType::visible_string, "a;b", bytes({'a', ';', 'b'})},
      {DataType::unicode_string, "a", bytes({'a', 0})},
      {DataType::octet_string, "01 fF", bytes({0x01, 0xFF})},
      {DataType::octet_string, "01FF", bytes({0x01, 0xFF})},
      {DataType::octet_string, "0x01FF", bytes({0x01, 0xFF})},
      {DataType::unsigned8, "008", bytes({8})},
      {DataType::unsigned8, "001", bytes({1})},
      {DataType::unsigned8, "000", bytes({0})},
      {DataType::domain, "00", bytes({0})},
      {DataType::time_of_day, "1", bytes({1, 0, 0, 0, 0, 0})},
      {static_cast<DataType>(0x40), "0A0B", bytes({0x0A, 0x0B})},
      {DataType::unsigned32, "$NODEID+0x180", bytes({0x85, 0x01, 0, 0})},
      {DataType::unsigned32, "0x180 + $nodeid", bytes({0x85, 0x01, 0, 0})},
      {DataType::unsigned8, "$NODEID", bytes({5})},
      {DataType::unsigned32, "0x80000000+$NodeID+1", bytes({0x06, 0, 0, 0x80})},
  };
  for (const Good& row : table) {
    const Value value = parse_value(row.type, row.text, 5);
    EXPECT_EQ(value.problem, "") << row.text;
    EXPECT_EQ(value.bytes, row.expected) << row.text;
    EXPECT_EQ(value.uses_node_id, row.text.find('$') != std::string_view::npos) << row.text;
  }
}

struct Bad {
  DataType type;
  std::string_view text;
  std::string_view problem;
};

TEST(Value, SaysWhyItIsNone) {
  const Bad table[] = {
      {DataType::boolean, "2", "'2' does not fit BOOLEAN (0 to 1)"},
      {DataType::unsigned8, "256", "'256' does not fit UNSIGNED8 (0 to 255)"},
      {DataType::unsigned8, "-1", "'-1' does not fit UNSIGNED8 (0 to 255)"},
      {DataType::unsigned64, "0x10000000000000000", "'0x10000000000000000' has more than 64 bits"},
      {DataType::integer8, "128", "'128' does not fit INTEGER8 (-128 to 127)"},
      {DataType::integer8, "-129", "'-129' does not fit INTEGER8 (-128 to 127)"},
      {DataType::integer8, "0x100", "'0x100' does not fit INTEGER8 (-128 to 127)"},
      {DataType::integer64, "9223372036854775808",
       "'9223372036854775808' does not fit INTEGER64 (-9223372036854775808 to "
       "9223372036854775807)"},
      {DataType::unsigned8, "0x", "'0x' is not a number"},
      {DataType::unsigned8, "12h", "'12h' is not a number"},
      {DataType::unsigned8, "1 2", "'1 2' is not a number"},
      {DataType::unsigned8, "-", "'-' is not a number"},
      {DataType::unsigned8, "--1", "'--1' is not a number"},
      {DataType::unsigned8, "", "'' is not a number"},
      {DataType::unsigned8, "; none", "'' is not a number"},
      {DataType::unsigned8, "0x08g", "'0x08g' is not a number"},
      {DataType::unsigned8, "08g", "'08g' is not a number"},
      {DataType::unsigned8, "$NODEID+0x180", "'$NODEID+0x180' does not fit UNSIGNED8 (0 to 255)"},
      {DataType::unsigned32, "$NODEID-1", "'$NODEID-1' is not a formula like $NODEID+0x180"},
      {DataType::unsigned32, "$NODEID+", "'$NODEID+' is not a formula like $NODEID+0x180"},
      {DataType::unsigned32, "$NODEID+-1", "'$NODEID+-1' is not a formula like $NODEID+0x180"},
      {DataType::unsigned32, "$NODE", "'$NODE' is not a formula like $NODEID+0x180"},
      {DataType::unsigned64, "$NODEID+0xFFFFFFFFFFFFFFFF",
       "'$NODEID+0xFFFFFFFFFFFFFFFF' has more than 64 bits"},
      {DataType::real32, "1,5", "'1,5' is not a number"},
      {DataType::real32, "+", "'+' is not a number"},
      {DataType::real32, "1e39", "'1e39' does not fit REAL32"},
      {DataType::real64, "1e309", "'1e309' does not fit REAL64"},
      {DataType::real32, "0x100000000", "'0x100000000' does not fit REAL32 (32 bits)"},
      {DataType::octet_string, "hello", "'hello' is not made of hexadecimal digits"},
      {DataType::octet_string, "01 2", "'01 2' has half a byte at its end"},
      {DataType::time_of_day, "0x1000000000000",
       "'0x1000000000000' does not fit TIME_OF_DAY (48 bits)"},
      {DataType::time_of_day, "-1", "'-1' does not fit TIME_OF_DAY (48 bits)"},
  };
  for (const Bad& row : table) {
    EXPECT_EQ(parse_value(row.type, row.text, 5).problem, row.problem) << row.text;
  }
}

}  // namespace
}  // namespace linegate::eds

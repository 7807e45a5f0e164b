#include <gtest/gtest.h>

#include "tests/stack/od/objects.h"

namespace linegate::od {
namespace {

using test::bytes;
using test::copy;
using test::object;
using test::text;
using test::var;
using test::variable;

TEST(Read, GivesTheBytesOfReadableVariablesOnly) {
  const std::pair<Access, bool> table[] = {{Access::ro, true},  {Access::wo, false},
                                           {Access::rw, true},  {Access::rwr, true},
                                           {Access::rww, true}, {Access::constant, true}};
  for (const auto& [access, allowed] : table) {
    Dictionary dictionary;
    ASSERT_TRUE(dictionary.add(var(0x2000, DataType::unsigned16, bytes({1, 2}), access)));
    const auto result = dictionary.read({0x2000, 0});
    ASSERT_EQ(result.ok(), allowed);
    if (allowed) {
      EXPECT_EQ(copy(*result), bytes({1, 2}));
    } else {
      EXPECT_EQ(result.error(), to_error(AbortCode::write_only));
    }
  }
}

TEST(Read, TellsWhatDoesNotExist) {
  Dictionary dictionary;
  ASSERT_TRUE(dictionary.add(var(0x2000, DataType::unsigned16)));
  EXPECT_EQ(dictionary.read({0x2001, 0}).error(), to_error(AbortCode::no_object));
  EXPECT_EQ(dictionary.read({0x2001, 255}).error(), to_error(AbortCode::no_object));
  EXPECT_EQ(dictionary.read({0x2000, 1}).error(), to_error(AbortCode::no_sub_index));
}

TEST(Read, SubIndexFFhIsTheStructureOfTheObject) {
  Dictionary dictionary;
  ASSERT_TRUE(dictionary.add(var(0x1000, DataType::unsigned32)));
  ASSERT_TRUE(dictionary.add(
      object(0x1016, ObjectType::array,
             {variable(0, DataType::unsigned8), variable(1, DataType::unsigned32)})));
  const std::pair<std::uint16_t, unsigned> records[] = {
      {0x1018, 0x23}, {0x1023, 0x25}, {0x1025, 0x24}, {0x1200, 0x22},
      {0x12FF, 0x22}, {0x1301, 0x00}, {0x1400, 0x20}, {0x15FF, 0x20},
      {0x1600, 0x21}, {0x1800, 0x20}, {0x1BFF, 0x21}, {0x2000, 0x00}};
  for (const auto& [index, type] : records) {
    ASSERT_TRUE(
        dictionary.add(object(index, ObjectType::record, {variable(0, DataType::unsigned8)})));
    EXPECT_EQ(copy(*dictionary.read({index, 255})), bytes({9, type, 0, 0})) << index;
  }
  EXPECT_EQ(copy(*dictionary.read({0x1000, 255})), bytes({7, 0x07, 0, 0}));
  EXPECT_EQ(copy(*dictionary.read({0x1016, 255})), bytes({8, 0x07, 0, 0}));
}

TEST(Read, NumberIsZeroExtendedAndNeedsOneToEightBytes) {
  Dictionary dictionary;
  ASSERT_TRUE(dictionary.add(var(0x2000, DataType::integer16, bytes({0xFE, 0xFF}))));
  ASSERT_TRUE(dictionary.add(var(0x2001, DataType::visible_string)));
  ASSERT_TRUE(dictionary.add(var(0x2002, DataType::visible_string, text("nine char"))));
  EXPECT_EQ(dictionary.number({0x2000, 0}), 0xFFFEU);
  EXPECT_EQ(dictionary.number({0x2001, 0}), std::nullopt);
  EXPECT_EQ(dictionary.number({0x2002, 0}), std::nullopt);
  EXPECT_EQ(dictionary.number({0x2003, 0}), std::nullopt);
}

}  // namespace
}  // namespace linegate::od

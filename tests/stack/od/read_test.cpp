// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <cstdint>
#include <set>
#include <utility>
#include <vector>

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

// The contract of dictionary.h for callers that copy values in words of 8 bytes.
TEST(Read, NoWordHoldsPartsOfTwoValues) {
  Dictionary dictionary;
  const DataType types[] = {DataType::unsigned8, DataType::unsigned24, DataType::unsigned32,
                            DataType::unsigned64};
  std::vector<Address> addresses;
  for (std::uint16_t i = 0; i < 300; ++i) {
    const auto index = static_cast<std::uint16_t>(0x2000 + i);
    ASSERT_TRUE(dictionary.add(object(
        index, ObjectType::record, {variable(0, types[i % 4U]), variable(1, types[i / 4U % 4U])})));
    addresses.push_back({index, 0});
    addresses.push_back({index, 1});
  }
  std::set<std::uintptr_t> words;
  for (const Address address : addresses) {
    const std::byte* const data = dictionary.find(address)->data;
    EXPECT_TRUE(words.insert(reinterpret_cast<std::uintptr_t>(data)).second);
    EXPECT_EQ(reinterpret_cast<std::uintptr_t>(data) % 8, 0U);
  }
}

// The result of a glance: the bytes of values that it can return, nothing for all others.
std::vector<std::byte> glance(const Dictionary& dictionary, Address address) {
  const Glance seen = dictionary.glance(address);
  EXPECT_TRUE(seen.size == 0 || std::uint64_t{seen.word} >> 8U * seen.size == 0)
      << "bits above the value";
  std::vector<std::byte> out(seen.size);
  store_le(std::span<std::byte>(out), std::uint64_t{seen.word});
  return out;
}

TEST(Glance, SeesReadableValuesOfOneToFourBytes) {
  const std::vector<std::byte> eight = bytes({1, 2, 3, 4, 5, 6, 7, 8});
  const std::pair<DataType, std::size_t> table[] = {
      {DataType::boolean, 1},    {DataType::unsigned8, 1},  {DataType::integer16, 2},
      {DataType::unsigned24, 3}, {DataType::real32, 4},     {DataType::unsigned40, 0},
      {DataType::unsigned64, 0}, {DataType::time_of_day, 0}};
  for (const auto& [type, size] : table) {
    const std::vector<std::byte> value(eight.begin(), eight.begin() + byte_size(type));
    for (const Access access : {Access::ro, Access::rw, Access::constant, Access::wo}) {
      Dictionary dictionary;
      ASSERT_TRUE(dictionary.add(var(0x2000, type, value, access)));
      const auto expected = static_cast<std::ptrdiff_t>(access == Access::wo ? 0 : size);
      EXPECT_EQ(glance(dictionary, {0x2000, 0}),
                std::vector(eight.begin(), eight.begin() + expected));
    }
  }
}

TEST(Glance, SeesNothingOfAnObjectThatWasThereBefore) {
  Dictionary dictionary;
  ASSERT_TRUE(dictionary.add(var(0x2000, DataType::unsigned32, bytes({1, 2, 3, 4}))));
  ASSERT_TRUE(dictionary.remove(0x2000));
  ASSERT_TRUE(dictionary.add(var(0x2000, DataType::unsigned8, bytes({9}))));
  EXPECT_EQ(glance(dictionary, {0x2000, 0}), bytes({9}));
}

TEST(Glance, SeesSubIndexZeroAlone) {
  Dictionary dictionary;
  ASSERT_TRUE(dictionary.add(
      object(0x2000, ObjectType::record,
             {variable(0, DataType::unsigned8, bytes({1})), variable(1, DataType::unsigned8)})));
  ASSERT_TRUE(
      dictionary.add(object(0x2001, ObjectType::record, {variable(1, DataType::unsigned8)})));
  ASSERT_TRUE(dictionary.add(var(0x2002, DataType::visible_string, text("abc"))));
  ASSERT_TRUE(dictionary.add(var(0x2003, DataType::domain, text("abc"))));
  EXPECT_EQ(glance(dictionary, {0x2000, 0}), bytes({1}));
  for (const Address address :
       {Address{0x2000, 1}, Address{0x2000, 255}, Address{0x2001, 0}, Address{0x2001, 1},
        Address{0x2002, 0}, Address{0x2003, 0}, Address{0x2004, 0}, Address{0x4000, 0}}) {
    EXPECT_EQ(glance(dictionary, address), bytes({})) << address.index << ' ' << +address.sub;
  }
}

TEST(Glance, SeesTheNewestValue) {
  Dictionary dictionary;
  ASSERT_TRUE(dictionary.add(var(0x2000, DataType::unsigned16, bytes({1, 2}))));
  ASSERT_EQ(dictionary.write({0x2000, 0}, bytes({3, 4})), AbortCode::none);
  EXPECT_EQ(glance(dictionary, {0x2000, 0}), bytes({3, 4}));
  dictionary.reset_values(0, 0xFFFF);
  EXPECT_EQ(glance(dictionary, {0x2000, 0}), bytes({1, 2}));
}

TEST(Glance, LeavesHookedValuesToRead) {
  Dictionary dictionary;
  Hook of_service;
  Hook of_application;
  ASSERT_TRUE(dictionary.add(var(0x2000, DataType::unsigned8, bytes({7}))));
  ASSERT_TRUE(dictionary.set_hook(0x2000, &of_service));
  EXPECT_EQ(glance(dictionary, {0x2000, 0}), bytes({}));
  ASSERT_TRUE(dictionary.add_hook(0x2000, of_application));
  ASSERT_TRUE(dictionary.set_hook(0x2000, nullptr));
  EXPECT_EQ(glance(dictionary, {0x2000, 0}), bytes({}));
  dictionary.remove_hook(0x2000, of_application);
  EXPECT_EQ(glance(dictionary, {0x2000, 0}), bytes({7}));
}

TEST(Glance, LeavesBoundValuesToRead) {
  Dictionary dictionary;
  std::array<std::byte, 16> image{std::byte{9}};
  ASSERT_TRUE(dictionary.add(var(0x2000, DataType::unsigned8, bytes({7}))));
  ASSERT_TRUE(dictionary.bind({0x2000, 0}, image.data()));
  ASSERT_TRUE(dictionary.add_window(0x2001, DataType::unsigned8, Access::ro, image.data(), 8));
  EXPECT_EQ(glance(dictionary, {0x2000, 0}), bytes({}));
  EXPECT_EQ(glance(dictionary, {0x2001, 0}), bytes({8}));
  EXPECT_EQ(glance(dictionary, {0x2001, 1}), bytes({}));
}

TEST(Glance, DoesNotSeeObjectsThatAreGone) {
  Dictionary dictionary;
  ASSERT_TRUE(dictionary.add(var(0x2000, DataType::unsigned16, bytes({1, 2}))));
  ASSERT_TRUE(dictionary.remove(0x2000));
  EXPECT_EQ(glance(dictionary, {0x2000, 0}), bytes({}));
  ASSERT_TRUE(dictionary.add(var(0x2000, DataType::unsigned32, bytes({5}))));
  EXPECT_EQ(glance(dictionary, {0x2000, 0}), bytes({5, 0, 0, 0}));
}

}  // namespace
}  // namespace linegate::od

// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <cstdint>
#include <cstring>

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

constexpr Error kIncompatible = to_error(AbortCode::device_incompatible);

TEST(Building, RefusesDescriptionsThatMakeNoSense) {
  Dictionary dictionary;
  ASSERT_TRUE(dictionary.add(var(0x2000, DataType::unsigned8)));
  const ObjectDescription bad[] = {
      var(0x2000, DataType::unsigned8),
      var(0x0000, DataType::unsigned8),
      var(0x2001, DataType::none),
      var(0x2001, DataType::unsigned8, bytes({1, 2})),
      object(0x2001, ObjectType::array, {}),
      object(0x2001, ObjectType::array,
             {variable(1, DataType::unsigned8), variable(1, DataType::unsigned8)}),
      object(0x2001, ObjectType::array,
             {variable(2, DataType::unsigned8), variable(1, DataType::unsigned8)}),
      object(0x2001, ObjectType::array, {variable(255, DataType::unsigned8)}),
  };
  for (const ObjectDescription& description : bad) {
    const Result<void> result = dictionary.add(description);
    ASSERT_FALSE(result);
    EXPECT_EQ(result.error(), kIncompatible);
  }
  EXPECT_EQ(dictionary.indices(), std::vector<std::uint16_t>{0x2000});
}

TEST(Building, AShortValueIsFilledUpWithZeros) {
  Dictionary dictionary;
  ASSERT_TRUE(dictionary.add(var(0x2000, DataType::unsigned32, bytes({0x11, 0x22}))));
  EXPECT_EQ(copy(*dictionary.read({0x2000, 0})), bytes({0x11, 0x22, 0, 0}));
}

TEST(Building, ADeviceDescriptionBecomesADictionary) {
  DeviceDescription device;
  device.objects = {var(0x1000, DataType::unsigned32, bytes({0x91, 1, 2, 0}), Access::ro),
                    var(0x1001, DataType::unsigned8)};
  const Dictionary dictionary(device);
  EXPECT_EQ(dictionary.number({0x1000, 0}), 0x0002'0191U);
  EXPECT_TRUE(dictionary.has_object(0x1001));
}

TEST(Building, RemovedObjectsAreGoneAndTheirIndexIsFree) {
  Dictionary dictionary;
  EXPECT_EQ(dictionary.remove(0x2000).error(), to_error(AbortCode::no_object));
  ASSERT_TRUE(dictionary.add(var(0x2000, DataType::unsigned8, bytes({1}))));
  ASSERT_TRUE(dictionary.remove(0x2000));
  EXPECT_FALSE(dictionary.has_object(0x2000));
  ASSERT_TRUE(dictionary.add(var(0x2001, DataType::unsigned8, bytes({2}))));
  ASSERT_TRUE(dictionary.add(var(0x2000, DataType::unsigned16, bytes({3}))));
  EXPECT_EQ(dictionary.number({0x2001, 0}), 2U);
  EXPECT_EQ(dictionary.number({0x2000, 0}), 3U);
}

TEST(Building, ObserversHearOfObjectsThatComeGoAndMove) {
  struct Listener : Observer {
    void reshaped(std::uint16_t index) override { heard.push_back(index); }
    std::vector<std::uint16_t> heard;
  } listener;
  std::array<std::byte, 2> image{};
  Hook hook;
  Dictionary dictionary;
  dictionary.add_observer(listener);
  ASSERT_TRUE(dictionary.add(var(0x2000, DataType::unsigned8)));
  ASSERT_TRUE(dictionary.bind({0x2000, 0}, image.data()));
  ASSERT_TRUE(dictionary.add_window(0xA040, DataType::unsigned8, Access::ro, image.data(), 2));
  ASSERT_TRUE(dictionary.add_hook(0x2000, hook)) << "other objects are unaffected";
  ASSERT_TRUE(dictionary.add_hook(0x2000, hook, Watch::rpdos));
  ASSERT_TRUE(dictionary.remove(0x2000));
  EXPECT_EQ(listener.heard, (std::vector<std::uint16_t>{0x2000, 0x2000, 0xA040, 0x2000, 0x2000}));
  dictionary.remove_observer(listener);
  ASSERT_TRUE(dictionary.remove(0xA040));
  EXPECT_EQ(listener.heard.size(), 5U);
}

// A string gets a value longer than its memory: pointers to its bytes become invalid.
TEST(Building, ObserversHearOfAStringThatGrowsOutOfItsRoom) {
  struct Listener : Observer {
    explicit Listener(Dictionary& values) : dictionary(values) {}
    void reshaped(std::uint16_t index) override {
      heard.push_back(index);
      at = dictionary.find({index, 0})->data;
    }
    Dictionary& dictionary;
    std::vector<std::uint16_t> heard;
    const std::byte* at = nullptr;
  };
  const std::vector<std::byte> longer(100, std::byte{'a'});
  const std::vector<std::byte> longest(200, std::byte{'b'});
  const std::vector<std::byte> odd(301, std::byte{'c'});
  for (const bool restored : {false, true}) {
    Dictionary dictionary;
    ASSERT_TRUE(dictionary.add(var(0x2000, DataType::visible_string, text("short"))));
    ASSERT_TRUE(dictionary.add(var(0x2001, DataType::unicode_string, bytes({'a', 0}))));
    Listener listener(dictionary);
    dictionary.add_observer(listener);
    const auto give = [&](std::uint16_t index, std::span<const std::byte> value) {
      return restored ? dictionary.restore({index, 0}, value) : dictionary.set({index, 0}, value);
    };
    EXPECT_TRUE(give(0x2000, text("as short")));
    EXPECT_TRUE(listener.heard.empty()) << "the bytes do not move";
    EXPECT_TRUE(give(0x2000, longer));
    EXPECT_EQ(listener.at, dictionary.find({0x2000, 0})->data);
    EXPECT_TRUE(give(0x2000, longest));
    EXPECT_EQ(listener.at, dictionary.find({0x2000, 0})->data);
    EXPECT_TRUE(give(0x2000, longer));
    EXPECT_EQ(listener.heard, (std::vector<std::uint16_t>{0x2000, 0x2000, 0x2000}));
    EXPECT_TRUE(give(0x2000, longer));
    EXPECT_EQ(dictionary.write({0x2000, 0}, longest), AbortCode::none);
    const Assignment shorter{{0x2000, 0}, longer};
    EXPECT_EQ(dictionary.write_all({&shorter, 1}), AbortCode::none);
    EXPECT_EQ(listener.heard.size(), 5U) << "only this value has another length";
    const std::byte* const before = dictionary.find({0x2001, 0})->data;
    EXPECT_FALSE(give(0x2001, odd));
    EXPECT_EQ(dictionary.find({0x2001, 0})->data, before) << "a refused value moves nothing";
    EXPECT_EQ(listener.heard.size(), 5U);
    dictionary.remove_observer(listener);
  }
}

TEST(Building, ValuesStayWhereTheyAre) {
  Dictionary dictionary;
  ASSERT_TRUE(dictionary.add(var(0x2000, DataType::unsigned32)));
  const std::byte* at = dictionary.find({0x2000, 0})->data;
  for (std::uint16_t index = 0x2001; index < 0x2400; ++index) {
    ASSERT_TRUE(dictionary.add(var(index, DataType::unsigned32)));
  }
  Dictionary moved = std::move(dictionary);
  ASSERT_TRUE(moved.write({0x2000, 0}, bytes({1, 2, 3, 4})) == AbortCode::none);
  EXPECT_EQ(moved.find({0x2000, 0})->data, at);
}

// Copy plans of PDOs rely on this: they may load and store whole words at a value and up to 8 bytes
// behind it, without changing another value.
TEST(Building, ValuesAreAlignedAndHaveSlack) {
  std::vector<VariableDescription> variables;
  for (unsigned sub = 0; sub < 9; ++sub) {
    variables.push_back(variable(static_cast<std::uint8_t>(sub),
                                 sub == 7 ? DataType::visible_string : DataType::unsigned24,
                                 bytes({sub})));
  }
  Dictionary dictionary;
  ASSERT_TRUE(dictionary.add(object(0x2000, ObjectType::record, variables)));
  for (unsigned sub = 0; sub < 9; ++sub) {
    const auto found = dictionary.find({0x2000, static_cast<std::uint8_t>(sub)});
    EXPECT_EQ(reinterpret_cast<std::uintptr_t>(found->data) % 8, 0U);
    std::memset(found->data + found->capacity, 0xEE, 8);
  }
  for (unsigned sub = 0; sub < 9; ++sub) {
    EXPECT_EQ(dictionary.number({0x2000, static_cast<std::uint8_t>(sub)}), sub);
  }
}

TEST(Building, ABoundVariableLivesWhereItIsBound) {
  Dictionary dictionary;
  ASSERT_TRUE(dictionary.add(var(0x6000, DataType::unsigned16, bytes({1, 2}))));
  std::array<std::byte, 2> image{std::byte{0x34}, std::byte{0x12}};
  ASSERT_TRUE(dictionary.bind({0x6000, 0}, image.data()));
  EXPECT_EQ(dictionary.number({0x6000, 0}), 0x1234U);
  EXPECT_EQ(dictionary.write({0x6000, 0}, bytes({0x78, 0x56})), AbortCode::none);
  EXPECT_EQ(image[0], std::byte{0x78});
  EXPECT_EQ(image[1], std::byte{0x56});
  EXPECT_EQ(dictionary.bind({0x6000, 1}, image.data()).error(), to_error(AbortCode::no_sub_index));
  EXPECT_EQ(dictionary.bind({0x6001, 0}, image.data()).error(), to_error(AbortCode::no_object));
}

TEST(Building, DomainsCannotBeBound) {
  Dictionary dictionary;
  ASSERT_TRUE(dictionary.add(var(0x1F50, DataType::domain)));
  std::array<std::byte, 8> elsewhere{};
  EXPECT_EQ(dictionary.bind({0x1F50, 0}, elsewhere.data()).error(),
            to_error(AbortCode::unsupported_access));
}

TEST(Window, ShowsElementsThatLieOneAfterTheOther) {
  std::array<std::byte, 6> image{};
  Dictionary dictionary;
  ASSERT_TRUE(dictionary.add_window(0xA100, DataType::unsigned16, Access::ro, image.data(), 3));
  image[2] = std::byte{0xCD};
  image[3] = std::byte{0xAB};
  EXPECT_EQ(dictionary.number({0xA100, 0}), 3U);
  EXPECT_EQ(dictionary.number({0xA100, 1}), 0U);
  EXPECT_EQ(dictionary.number({0xA100, 2}), 0xABCDU);
  EXPECT_EQ(dictionary.find({0xA100, 3})->data, image.data() + 4);
  EXPECT_TRUE(dictionary.find({0xA100, 3})->mappable);
  AbortCode why = AbortCode::none;
  EXPECT_FALSE(dictionary.find({0xA100, 4}, &why));
  EXPECT_EQ(why, AbortCode::no_sub_index);
  EXPECT_EQ(dictionary.highest_sub(0xA100), 3);
  EXPECT_EQ(dictionary.object_type(0xA100), ObjectType::array);
  EXPECT_EQ(dictionary.write({0xA100, 1}, bytes({1, 2})), AbortCode::read_only);
  EXPECT_EQ(dictionary.write({0xA100, 0}, bytes({1})), AbortCode::read_only);
}

TEST(Window, WritesGoToTheElement) {
  std::array<std::byte, 6> image{};
  Dictionary dictionary;
  ASSERT_TRUE(dictionary.add_window(0xA580, DataType::unsigned16, Access::rww, image.data(), 3));
  EXPECT_EQ(dictionary.write({0xA580, 3}, bytes({1, 2})), AbortCode::none);
  EXPECT_EQ(copy(image), bytes({0, 0, 0, 0, 1, 2}));
  EXPECT_EQ(dictionary.write({0xA580, 3}, bytes({1})), AbortCode::length_too_low);
  EXPECT_EQ(dictionary.bind({0xA580, 1}, image.data()).error(),
            to_error(AbortCode::unsupported_access));
}

TEST(Window, HasItsLimits) {
  std::array<std::byte, 254> image{};
  Dictionary dictionary;
  std::byte* data = image.data();
  ASSERT_TRUE(dictionary.add_window(0xA040, DataType::unsigned8, Access::ro, data, 254));
  EXPECT_EQ(dictionary.find({0xA040, 254})->data, data + 253);
  EXPECT_FALSE(dictionary.find({0xA040, 255}));
  EXPECT_EQ(dictionary.add_window(0xA040, DataType::unsigned8, Access::ro, data, 1).error(),
            kIncompatible);
  EXPECT_EQ(dictionary.add_window(0xA041, DataType::unsigned8, Access::ro, data, 255).error(),
            kIncompatible);
  EXPECT_EQ(dictionary.add_window(0xA041, DataType::visible_string, Access::ro, data, 1).error(),
            kIncompatible);
}

TEST(ResetValues, GivesInitialValuesAgainWithinTheRange) {
  Dictionary dictionary;
  ASSERT_TRUE(dictionary.add(var(0x0FFF, DataType::unsigned8, bytes({1}))));
  ASSERT_TRUE(dictionary.add(var(0x1000, DataType::unsigned8, bytes({2}))));
  ASSERT_TRUE(dictionary.add(object(0x1FFF, ObjectType::record,
                                    {variable(0, DataType::unsigned8, bytes({3})),
                                     variable(2, DataType::visible_string, text("abc")),
                                     variable(3, DataType::domain, text("domain"))})));
  ASSERT_TRUE(dictionary.add(var(0x2000, DataType::unsigned8, bytes({4}))));
  for (const Address address : {Address{0x0FFF, 0}, {0x1000, 0}, {0x1FFF, 0}, {0x2000, 0}}) {
    ASSERT_TRUE(dictionary.set(address, 99));
  }
  ASSERT_EQ(dictionary.write({0x1FFF, 2}, text("longer than it was")), AbortCode::none);
  ASSERT_EQ(dictionary.write({0x1FFF, 3}, text("longer than it was")), AbortCode::none);

  dictionary.reset_values(0x1000, 0x1FFF);

  EXPECT_EQ(dictionary.number({0x0FFF, 0}), 99U);
  EXPECT_EQ(dictionary.number({0x1000, 0}), 2U);
  EXPECT_EQ(dictionary.number({0x1FFF, 0}), 3U);
  EXPECT_EQ(copy(*dictionary.read({0x1FFF, 2})), text("abc"));
  EXPECT_EQ(copy(*dictionary.read({0x1FFF, 3})), text("domain"));
  EXPECT_EQ(dictionary.number({0x2000, 0}), 99U);
}

TEST(ResetValues, WritesBoundVariablesAndLeavesWindowsAlone) {
  std::array<std::byte, 2> image{std::byte{7}, std::byte{8}};
  Dictionary dictionary;
  ASSERT_TRUE(dictionary.add(var(0x6000, DataType::unsigned8, bytes({1}))));
  ASSERT_TRUE(dictionary.bind({0x6000, 0}, image.data()));
  ASSERT_TRUE(dictionary.add_window(0xA040, DataType::unsigned8, Access::ro, image.data() + 1, 1));
  dictionary.reset_values(0x0000, 0xFFFF);
  EXPECT_EQ(copy(image), bytes({1, 8}));
}

}  // namespace
}  // namespace linegate::od

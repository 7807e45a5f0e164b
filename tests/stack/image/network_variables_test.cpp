// SPDX-License-Identifier: Apache-2.0
// Network variables A000h..A8FFh compared with the table of the IXXAT CANopen Manager API
// manual 6.1.3.
#include "stack/image/network_variables.h"

#include <tuple>

#include <gtest/gtest.h>

#include "tests/stack/image/layouts.h"

namespace linegate::image {
namespace {

using od::Address;
using od::DataType;
using test::kIn;
using test::kOut;
using test::make_layout;

struct Row {
  DataType type;
  std::uint16_t output;
  std::uint16_t input;
};

class Table : public testing::TestWithParam<Row> {};

TEST_P(Table, FirstVariableOfItsType) {
  const auto [type, output, input] = GetParam();
  const std::uint32_t bits = od::bit_size(type);
  EXPECT_EQ(variable_address(kOut, type, 0, bits), (Address{output, 1}));
  EXPECT_EQ(variable_address(kIn, type, 0, bits), (Address{input, 1}));
}

TEST_P(Table, ElementsAreCountedBy254) {
  const auto [type, output, input] = GetParam();
  const std::uint32_t bits = od::bit_size(type);
  const auto index = [](std::uint16_t base, int add) {
    return static_cast<std::uint16_t>(base + add);
  };
  EXPECT_EQ(variable_address(kIn, type, 253 * bits, bits), (Address{input, 254}));
  EXPECT_EQ(variable_address(kIn, type, 254 * bits, bits), (Address{index(input, 1), 1}));
  EXPECT_EQ(variable_address(kOut, type, (64 * 254 - 1) * bits, bits),
            (Address{index(output, 63), 254}));
  EXPECT_FALSE(variable_address(kOut, type, 64 * 254 * bits, bits));
}

TEST_P(Table, PlaceIsTheInverse) {
  const auto [type, output, input] = GetParam();
  const std::uint32_t bits = od::bit_size(type);
  for (const std::uint32_t element : {0U, 1U, 253U, 254U, 12'345U, 64U * 254U - 1U}) {
    for (const Direction direction : {kIn, kOut}) {
      const auto address = variable_address(direction, type, element * bits, bits);
      ASSERT_TRUE(address);
      const auto place = variable_place(*address);
      ASSERT_TRUE(place);
      EXPECT_EQ(place->direction, direction);
      EXPECT_EQ(place->type, type);
      EXPECT_EQ(place->bit_offset, element * bits);
      EXPECT_EQ(place->bit_length, bits);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(
    Ixxat, Table,
    testing::Values(
        Row{DataType::integer8, 0xA000, 0xA480}, Row{DataType::unsigned8, 0xA040, 0xA4C0},
        Row{DataType::boolean, 0xA080, 0xA500}, Row{DataType::integer16, 0xA0C0, 0xA540},
        Row{DataType::unsigned16, 0xA100, 0xA580}, Row{DataType::integer24, 0xA140, 0xA5C0},
        Row{DataType::unsigned24, 0xA180, 0xA600}, Row{DataType::integer32, 0xA1C0, 0xA640},
        Row{DataType::unsigned32, 0xA200, 0xA680}, Row{DataType::real32, 0xA240, 0xA6C0},
        Row{DataType::unsigned40, 0xA280, 0xA700}, Row{DataType::integer40, 0xA2C0, 0xA740},
        Row{DataType::unsigned48, 0xA300, 0xA780}, Row{DataType::integer48, 0xA340, 0xA7C0},
        Row{DataType::unsigned56, 0xA380, 0xA800}, Row{DataType::integer56, 0xA3C0, 0xA840},
        Row{DataType::integer64, 0xA400, 0xA880}, Row{DataType::unsigned64, 0xA440, 0xA8C0}));

TEST(VariableAddress, TypesWithoutAnArrayAreShownByTheUnsignedOneOfTheirSize) {
  EXPECT_EQ(variable_address(kIn, DataType::real64, 64, 64), (Address{0xA8C0, 2}));
  EXPECT_EQ(variable_address(kIn, DataType::octet_string, 0, 24), (Address{0xA600, 1}));
  EXPECT_EQ(variable_address(kIn, DataType::none, 9, 1), (Address{0xA500, 10}));
}

TEST(VariableAddress, NothingForOtherLengthsAndPlaces) {
  EXPECT_FALSE(variable_address(kIn, DataType::unsigned16, 8, 16));
  EXPECT_FALSE(variable_address(kIn, DataType::none, 0, 3));
  EXPECT_FALSE(variable_place({0x9FFF, 1}));
  EXPECT_FALSE(variable_place({0xA900, 1}));
  EXPECT_FALSE(variable_place({0xA000, 0}));
  EXPECT_FALSE(variable_place({0xA000, 255}));
}

class NetworkVariables : public testing::Test {
 protected:
  NetworkVariables()
      : image(make_layout(kIn, 600, {{1, 0, 32}}), make_layout(kOut, 9, {{1, 0, 32}})) {
    EXPECT_TRUE(add_network_variables(dictionary, image).ok());
  }
  std::uint64_t sdo_read(Address address) {
    const auto bytes = dictionary.read(address);
    EXPECT_TRUE(bytes.ok());
    return bytes.ok() ? load_le(bytes.value()) : 0;
  }

  ProcessImage image;
  od::Dictionary dictionary;
};

TEST_F(NetworkVariables, TheSameBytesUnderEveryType) {
  image.area(kIn).merge(4, 0x8877'6655'4433'2211U, ~std::uint64_t{0});
  EXPECT_EQ(sdo_read({0xA4C0, 5}), 0x11U);          // U8 at 4
  EXPECT_EQ(sdo_read({0xA580, 3}), 0x2211U);        // U16 at 4
  EXPECT_EQ(sdo_read({0xA600, 3}), 0x554433U);      // U24 at 6
  EXPECT_EQ(sdo_read({0xA680, 2}), 0x44332211U);    // U32 at 4
  EXPECT_EQ(sdo_read({0xA700, 2}), 0x6655443322U);  // U40 at 5
  EXPECT_EQ(sdo_read({0xA8C0, 2}), 0x88776655U);    // U64 at 8
  EXPECT_EQ(sdo_read({0xA500, 33}), 1U);            // bit 0 of byte 4
  EXPECT_EQ(sdo_read({0xA500, 34}), 0U);            // bit 1 of byte 4
}

TEST_F(NetworkVariables, OnlyElementsInTheAreaExist) {
  EXPECT_TRUE(dictionary.find({0xA040, 9}));
  EXPECT_FALSE(dictionary.find({0xA040, 10}));
  EXPECT_EQ(dictionary.number({0xA040, 0}), 9U);
  EXPECT_EQ(dictionary.number({0xA100, 0}), 4U);
  EXPECT_TRUE(dictionary.find({0xA4C2, 600 - 2 * 254}));
  EXPECT_FALSE(dictionary.find({0xA4C2, 600 - 2 * 254 + 1}));
  EXPECT_FALSE(dictionary.has_object(0xA4C3));
}

TEST_F(NetworkVariables, OutputsAreReadOnly) {
  EXPECT_EQ(dictionary.write({0xA040, 1}, std::array{std::byte{1}}), AbortCode::read_only);
  EXPECT_EQ(dictionary.write({0xA080, 1}, std::array{std::byte{1}}), AbortCode::read_only);
}

TEST_F(NetworkVariables, AWrittenInputIsAChangeOfTheImage) {
  EXPECT_EQ(dictionary.write({0xA580, 2}, std::array{std::byte{7}, std::byte{0}}), AbortCode::none);
  EXPECT_EQ(image.bytes(kIn)[2], std::byte{7});
  Snapshot snapshot;
  image.snapshot(kIn, snapshot, Instant{}, false, 0);
  EXPECT_TRUE(snapshot.is_changed(0));
  EXPECT_EQ(snapshot.bytes[2], std::byte{7});
}

TEST_F(NetworkVariables, AWrittenBooleanChangesOneBit) {
  image.area(kIn).merge(1, 0xF0, 0xFF);
  EXPECT_EQ(dictionary.write({0xA500, 10}, std::array{std::byte{1}}), AbortCode::none);
  EXPECT_EQ(image.bytes(kIn)[1], std::byte{0xF2});
  EXPECT_EQ(dictionary.write({0xA500, 13}, std::array{std::byte{0}}), AbortCode::none);
  EXPECT_EQ(image.bytes(kIn)[1], std::byte{0xE2});
  EXPECT_EQ(dictionary.write({0xA500, 13}, std::array{std::byte{2}}), AbortCode::invalid_value);
}

TEST_F(NetworkVariables, TheBooleansStandForTheirBits) {
  const auto variable = dictionary.find({0xA500, 13});
  ASSERT_TRUE(variable);
  const auto place = image.locate(variable->data);
  ASSERT_TRUE(place);
  EXPECT_EQ(place->direction, kIn);
  EXPECT_EQ(place->bit_offset, 12U);
}

}  // namespace
}  // namespace linegate::image

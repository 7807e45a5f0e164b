// SPDX-License-Identifier: Apache-2.0
// The signature, and the numbers of records.
#include "stack/srdo/parameters.h"

#include <gtest/gtest.h>

#include "stack/image/layout.h"

namespace linegate::srdo {
namespace {

Parameters example() {
  return {.number = 2,
          .direction = Direction::transmit,
          .cycle_ms = 25,
          .validation_ms = 20,
          .cob_id = 0x101,
          .inverted_cob_id = 0x102,
          .mapping = {pdo::Mapping::from_raw(0x2000'0108), pdo::Mapping::from_raw(0x2000'0208)}};
}

TEST(Signature, IsThatOfTheExample) {
  EXPECT_EQ(signature(example(), 1), 0x51AF);
}

TEST(Signature, EachParameterCounts) {
  const std::uint16_t expected = signature(example(), 9);
  const auto with = [](auto change) {
    Parameters srdo = example();
    change(srdo);
    return signature(srdo, 9);
  };
  EXPECT_NE(with([](Parameters& srdo) { srdo.direction = Direction::receive; }), expected);
  EXPECT_NE(with([](Parameters& srdo) { srdo.cycle_ms = 26; }), expected);
  EXPECT_NE(with([](Parameters& srdo) { srdo.cycle_ms = 25 + 256; }), expected);
  EXPECT_NE(with([](Parameters& srdo) { srdo.validation_ms = 21; }), expected);
  EXPECT_NE(with([](Parameters& srdo) { srdo.cob_id = 0x103; }), expected);
  EXPECT_NE(with([](Parameters& srdo) { srdo.inverted_cob_id = 0x104; }), expected);
  EXPECT_NE(with([](Parameters& srdo) { std::swap(srdo.mapping[0], srdo.mapping[1]); }), expected);
  EXPECT_NE(with([](Parameters& srdo) { srdo.mapping[1].bits = 16; }), expected);
  EXPECT_NE(with([](Parameters& srdo) { srdo.mapping.clear(); }), expected);
  EXPECT_EQ(with([](Parameters& srdo) { srdo.number = 3; }), expected);
}

// As CANopenNode: default identifiers are those of the object without the node-ID.
TEST(Signature, TheDefaultIdentifiersOfSrdo1AreWithoutTheNodeId) {
  const auto of_node = [](std::uint8_t number, std::uint8_t node) {
    Parameters srdo = example();
    srdo.number = number;
    srdo.cob_id = default_cob_id(node);
    srdo.inverted_cob_id = default_cob_id(node) + 1;
    return signature(srdo, node);
  };
  EXPECT_EQ(of_node(1, 3), of_node(1, 64));
  EXPECT_NE(of_node(2, 3), of_node(2, 4)) << "of SRDO 1 alone";
  EXPECT_NE(of_node(1, 64), of_node(1, 65)) << "nodes above 64 have no default";
}

TEST(Records, HaveTheNumbersOfTheirSrdos) {
  EXPECT_EQ(number_of(0x1300), 0);
  EXPECT_EQ(number_of(0x1301), 1);
  EXPECT_EQ(number_of(0x1340), 64);
  EXPECT_EQ(number_of(0x1341), 0);
  EXPECT_EQ(number_of(0x1381), 1);
  EXPECT_EQ(number_of(0x13C0), 64);
  EXPECT_EQ(number_of(0x13C1), 0);
  EXPECT_FALSE(is_srdo_object(0x12FF));
  EXPECT_TRUE(is_srdo_object(0x1300));
  EXPECT_TRUE(is_srdo_object(0x13FF));
  EXPECT_FALSE(is_srdo_object(0x1400));
}

TEST(Records, AnSrdoIsAPdoAboveThoseOfTheDevice) {
  const pdo::Parameters pdo = as_pdo(example());
  EXPECT_EQ(pdo.number, image::kFirstSrdo + 1);
  EXPECT_EQ(pdo.cob_id.id(), 0x101U);
  ASSERT_EQ(pdo.mapping.size(), 1U);
  EXPECT_EQ(pdo.mapping[0].raw(), 0x2000'0108U);
}

}  // namespace
}  // namespace linegate::srdo

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
  EXPECT_EQ(signature(example()), 0x51AF);
}

TEST(Signature, EachParameterCounts) {
  const std::uint16_t expected = signature(example());
  const auto with = [](auto change) {
    Parameters srdo = example();
    change(srdo);
    return signature(srdo);
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

// SRDO 1 of node 9 on its default identifiers: 111h and 112h, not FFh and 100h.
TEST(Signature, HasTheDefaultIdentifiersWithTheNodeId) {
  Parameters srdo = example();
  srdo.number = 1;
  srdo.cob_id = default_cob_id(9);
  srdo.inverted_cob_id = default_cob_id(9) + 1;
  EXPECT_EQ(signature(srdo), 0x2F78);
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

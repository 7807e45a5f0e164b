// SPDX-License-Identifier: Apache-2.0
#include "stack/manager/comparison.h"

#include <gtest/gtest.h>

#include "stack/base/byte_order.h"
#include "stack/manager/configuration_report.h"

#include "tests/stack/manager/numbers.h"

namespace linegate::manager {
namespace {

TEST(Comparison, ReadsEachObjectOnceAndExpectsItsLastValue) {
  const std::vector<ObjectWrite> writes = {{{0x1800, 1}, number(0x8000'0185)},
                                           {{0x1A00, 0}, number(0, 1)},
                                           {{0x1010, 1}, number(0x6576'6173)},
                                           {{0x1A00, 0}, number(2, 1)},
                                           {{0x1800, 1}, number(0x185)}};
  Comparison comparison(5, writes);
  EXPECT_EQ(comparison.total(), 2U);
  EXPECT_EQ(comparison.wanted()->address, (od::Address{0x1800, 1}));
  EXPECT_FALSE(comparison.wanted()->write);
  comparison.take(AbortCode::none, number(0x185));
  EXPECT_EQ(comparison.wanted()->address, (od::Address{0x1A00, 0}));
  comparison.take(AbortCode::none, number(1, 1));
  EXPECT_FALSE(comparison.wanted());
  EXPECT_EQ(comparison.end(), AbortCode::none);
  EXPECT_EQ(comparison.take_differences(),
            (std::vector<Difference>{
                {.object = {0x1A00, 0}, .expected = number(2, 1), .found = number(1, 1)}}));
}

TEST(Comparison, AnObjectThatCannotBeReadIsADifferenceButForWriteOnlyOnes) {
  const std::vector<ObjectWrite> writes = {{{0x2000, 0}, number(1)}, {{0x2001, 0}, number(2)}};
  Comparison comparison(5, writes);
  (void)comparison.wanted();
  comparison.take(AbortCode::write_only, {});
  (void)comparison.wanted();
  comparison.take(AbortCode::no_object, {});
  EXPECT_FALSE(comparison.wanted());
  EXPECT_EQ(comparison.take_differences(),
            (std::vector<Difference>{
                {.object = {0x2001, 0}, .expected = number(2), .abort = AbortCode::no_object}}));
}

TEST(Comparison, ANodeThatFallsSilentEndsIt) {
  const std::vector<ObjectWrite> writes = {{{0x2000, 0}, number(1)}, {{0x2001, 0}, number(2)}};
  Comparison comparison(5, writes);
  (void)comparison.wanted();
  comparison.take(AbortCode::timeout, {});
  EXPECT_FALSE(comparison.wanted());
  EXPECT_EQ(comparison.end(), AbortCode::timeout);
  EXPECT_EQ(comparison.done(), 0U);
}

TEST(ConfigurationReport, IsReadAsItWasWritten) {
  const std::vector<NodeReport> nodes = {
      {.node = 5},
      {.node = 7,
       .boot = 'J',
       .end = AbortCode::value_too_high,
       .differences = {
           {.object = {0x2001, 3}, .expected = number(2), .abort = AbortCode::value_too_high},
           {.object = {0x1017, 0}, .expected = number(100, 2), .found = number(0, 2)}}}};
  const auto bytes = write_configuration_report(nodes);
  EXPECT_EQ(bytes.size(), 10U + 10U + 19U + 19U);
  const auto read = read_configuration_report(bytes);
  ASSERT_TRUE(read.ok());
  EXPECT_EQ(*read, nodes);
  EXPECT_TRUE(read->at(0).good());
  EXPECT_FALSE(read->at(1).good());
  for (std::size_t size = 1; size < bytes.size(); ++size) {
    const auto cut = read_configuration_report(std::span(bytes).first(size));
    EXPECT_TRUE(!cut.ok() || cut->size() == 1) << size;
  }
  auto count = bytes;
  count[9] = std::byte{0xFF};
  EXPECT_FALSE(read_configuration_report(count).ok());
  auto node = bytes;
  node[0] = std::byte{0};
  EXPECT_FALSE(read_configuration_report(node).ok());
}

}  // namespace
}  // namespace linegate::manager

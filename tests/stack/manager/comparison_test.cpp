// SPDX-License-Identifier: Apache-2.0
#include "stack/manager/comparison.h"

#include <gtest/gtest.h>

#include "stack/base/byte_order.h"

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
  EXPECT_EQ(comparison.pop_differences(),
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
  EXPECT_EQ(comparison.pop_differences(),
            (std::vector<Difference>{
                {.object = {0x2001, 0}, .expected = number(2), .abort = AbortCode::no_object}}));
}

TEST(Comparison, ReadsThePdosOfTheImage) {
  const std::vector<ObjectWrite> writes = {{{0x1800, 2}, number(1, 1)}};
  const std::vector<AssumedPdo> pdos = {{.parameters = {{{0x1800, 1}, number(0x185)},
                                                        {{0x1800, 2}, number(1, 1)},
                                                        {{0x1A00, 0}, number(1, 1)},
                                                        {{0x1A00, 1}, number(0x6000'0108)}},
                                         .remedy = {}}};
  Comparison comparison(5, writes, pdos);
  EXPECT_EQ(comparison.total(), 4U);
  comparison.take(AbortCode::none, number(0x4000'0185));
  comparison.take(AbortCode::none, number(1, 1));
  comparison.take(AbortCode::no_object, {});
  EXPECT_EQ(comparison.wanted()->address, (od::Address{0x1A00, 1}));
  comparison.take(AbortCode::none, number(0x6000'0208));
  EXPECT_FALSE(comparison.wanted());
  EXPECT_EQ(
      comparison.pop_differences(),
      (std::vector<Difference>{
          {.object = {0x1A00, 1}, .expected = number(0x6000'0108), .found = number(0x6000'0208)}}));
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

}  // namespace
}  // namespace linegate::manager

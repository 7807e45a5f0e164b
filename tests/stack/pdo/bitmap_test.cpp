// SPDX-License-Identifier: Apache-2.0
// A set with a summary word, compared with a plain set: also one with more words than the summary
// has bits.
#include "stack/pdo/bitmap.h"

#include <random>
#include <set>

#include <gtest/gtest.h>

namespace linegate::pdo {
namespace {

std::size_t first_of(const std::set<std::size_t>& bits, const std::set<std::size_t>& except) {
  for (const std::size_t bit : bits) {
    if (!except.contains(bit)) {
      return bit;
    }
  }
  return SummedBitmap::kNone;
}

TEST(SummedBitmaps, AreSetsOfAnySize) {
  std::mt19937 random(3);
  for (const std::size_t size : {1U, 64U, 65U, 4096U, 4097U, 9000U}) {
    SCOPED_TRACE(size);
    std::uint64_t summary = 0;
    SummedBitmap bits(summary);
    Bitmap except;
    bits.reset(size);
    except.reset(size);
    std::set<std::size_t> expected;
    std::set<std::size_t> excepted;
    for (int step = 0; step < 2000; ++step) {
      const std::size_t bit = random() % size;
      if (random() % 2 == 0) {
        EXPECT_EQ(bits.set(bit), expected.insert(bit).second);
      } else {
        bits.clear(expected.empty() ? bit : *expected.begin());
        expected.erase(expected.empty() ? bit : *expected.begin());
      }
      if (random() % 8 == 0) {
        except.set(bit);
        excepted.insert(bit);
      }
      ASSERT_EQ(bits.any(), !expected.empty());
      ASSERT_EQ(bits.test(bit), expected.contains(bit));
      ASSERT_EQ(bits.first_except(except), first_of(expected, excepted));
    }
  }
}

}  // namespace
}  // namespace linegate::pdo

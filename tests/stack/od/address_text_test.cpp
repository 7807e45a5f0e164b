// SPDX-License-Identifier: Apache-2.0
// Index and sub-index as text.
#include <gtest/gtest.h>

#include "stack/od/description.h"

namespace linegate::od {
namespace {

TEST(AddressText, IsReadAsItIsPrinted) {
  for (unsigned sub = 0; sub <= 0xFF; ++sub) {
    const Address address{static_cast<std::uint16_t>(0x1A00 + sub * 7),
                          static_cast<std::uint8_t>(sub)};
    EXPECT_EQ(parse_address(to_text(address)), address) << to_text(address);
  }
  EXPECT_EQ(to_text({0x6200, 10}), "6200:0A");
  EXPECT_EQ(to_text({0x5, 0xFF}), "0005:FF");
}

TEST(AddressText, BothPartsAreHexadecimalHoweverTheyAreWritten) {
  for (const char* text : {"6200:10", "6200:0x10", "0x6200:10"}) {
    EXPECT_EQ(parse_address(text), (Address{0x6200, 16})) << text;
  }
  EXPECT_EQ(parse_address("60fe"), (Address{0x60FE, 0}));
  EXPECT_EQ(parse_sub("a"), 10);
  EXPECT_EQ(parse_index("1f22"), 0x1F22);
  for (const char* text : {"", ":", "6200:", ":1", "6200:100", "10000:1", "6200:1:2", "6200:-1",
                           "6200: 1", "0x", "6200h:1", "x:1"}) {
    EXPECT_EQ(parse_address(text), std::nullopt) << text;
  }
}

}  // namespace
}  // namespace linegate::od

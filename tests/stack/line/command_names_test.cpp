// SPDX-License-Identifier: Apache-2.0
#include <cstddef>
#include <set>
#include <string_view>

#include <gtest/gtest.h>

#include "stack/line/command.h"

namespace linegate::line {
namespace {

// Compares kCommandKinds with the enumeration: a kind that is missing there has a name, too.
TEST(CommandKinds, EachHasANameOfItsOwn) {
  std::set<std::string_view> names;
  for (std::size_t i = 0; i < kCommandKinds; ++i) {
    const std::string_view text = name(static_cast<CommandKind>(i));
    EXPECT_NE(text, "unknown") << i;
    EXPECT_TRUE(names.insert(text).second) << text;
  }
  EXPECT_EQ(name(static_cast<CommandKind>(kCommandKinds)), "unknown");
}

}  // namespace
}  // namespace linegate::line

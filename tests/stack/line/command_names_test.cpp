// SPDX-License-Identifier: Apache-2.0
#include <cstddef>
#include <set>
#include <string_view>

#include <gtest/gtest.h>

#include "stack/line/command.h"

namespace linegate::line {
namespace {

TEST(CommandKinds, EachHasANameOfItsOwn) {
  std::set<std::string_view> names;
  for (const CommandKind kind : kRequestKinds) {
    const std::string_view text = name(kind);
    EXPECT_NE(text, "unknown") << static_cast<unsigned>(kind);
    EXPECT_TRUE(names.insert(text).second) << text;
  }
}

TEST(CommandKinds, ANumberOfTheOwnerOfTheLineIsNoRequest) {
  for (const unsigned number : {7U, 10U, 13U, 26U, 255U}) {
    const auto kind = static_cast<CommandKind>(number);
    EXPECT_EQ(index_of(kind), kRequestKinds.size()) << number;
    EXPECT_EQ(name(kind), "unknown") << number;
  }
}

TEST(CommandKinds, AnEmptyRequestHasItsKind) {
  for (const CommandKind asked : kRequestKinds) {
    EXPECT_EQ(kind(empty_request(asked)), asked) << name(asked);
  }
}

}  // namespace
}  // namespace linegate::line

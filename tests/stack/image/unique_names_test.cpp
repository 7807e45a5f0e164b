// SPDX-License-Identifier: Apache-2.0
#include <set>

#include <gtest/gtest.h>

#include "stack/image/limits.h"

#include "tests/stack/image/layouts.h"

namespace linegate::image::test {
namespace {

// Subscribers have names of up to kLongestEntryName bytes: what differs must be within these.
TEST(UniqueNames, LongNamesRemainUniqueWithinTheirBound) {
  Layout layout = make_layout(kIn, 6, {{1, 0, 8}, {1, 8, 8}, {2, 16, 8}, {2, 24, 8}, {2, 32, 8}});
  for (std::size_t i = 0; i < layout.entries.size(); ++i)
    layout.entries[i].name = std::string(kLongestEntryName, 'n') + std::to_string(i);
  layout.entries[4].name = "drive.Value";
  make_names_unique(layout);
  std::set<std::string> names;
  for (const Entry& entry : layout.entries) {
    EXPECT_LE(entry.name.size(), kLongestEntryName);
    names.insert(entry.name);
  }
  EXPECT_EQ(names.size(), layout.entries.size());
  EXPECT_EQ(layout.entries[0].name, std::string(kLongestEntryName - 3, 'n') + "...");
  EXPECT_TRUE(layout.entries[1].name.ends_with("... in PDO 101"));
  EXPECT_TRUE(layout.entries[3].name.ends_with("... in PDO 102 #2")) << layout.entries[3].name;
  EXPECT_EQ(layout.entries[4].name, "drive.Value");
}

TEST(PdoText, NamesSrdosAsSuch) {
  EXPECT_EQ(pdo_text(512), "PDO 512");
  EXPECT_EQ(pdo_text(kFirstSrdo), "SRDO 1");
  EXPECT_EQ(pdo_cell(512), "512");
  EXPECT_EQ(pdo_cell(kLastSrdo), "SRDO64");
}

}  // namespace
}  // namespace linegate::image::test

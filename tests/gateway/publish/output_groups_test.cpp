// SPDX-License-Identifier: Apache-2.0
#include "gateway/publish/output_groups.h"

#include <gmock/gmock.h>

namespace linegate::gateway {
namespace {

using testing::EndsWith;
using testing::IsEmpty;
using testing::Le;
using testing::SizeIs;

TEST(OutputGroups, AreRunsOfEntriesWithTheNumberOfTheirGroup) {
  EXPECT_THAT(output_group_properties({}), IsEmpty()) << "one group 0 with all outputs";
  const std::vector<line::OutputGroup> groups{{.number = 1, .name = "motion", .entries = {2, 0, 1}},
                                              {.number = 7, .name = "lamps", .entries = {5, 3}}};
  const auto properties = output_group_properties(groups);
  ASSERT_THAT(properties, SizeIs(1));
  EXPECT_EQ(properties[0].name, "output-groups");
  EXPECT_EQ(properties[0].value, "1 0..2, 7 3, 7 5");
}

TEST(OutputGroups, RunsWithoutRoomAreCounted) {
  line::OutputGroup odd{.number = 1000};
  for (std::uint32_t entry = 1; entry < 2000; entry += 2) {
    odd.entries.push_back(entry);
  }
  const auto properties = output_group_properties(std::span(&odd, 1));
  ASSERT_THAT(properties, SizeIs(1));
  EXPECT_THAT(properties[0].value.size(), Le(256U));
  EXPECT_THAT(properties[0].value, EndsWith(", 1000 53, +973"));
}

}  // namespace
}  // namespace linegate::gateway

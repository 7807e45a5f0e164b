// SPDX-License-Identifier: Apache-2.0
// The right and the name that the partitions of a writer prove.
#include "bridges/dds/security.h"

#include <gtest/gtest.h>

namespace linegate::dds {
namespace {

std::string claim(const std::vector<std::string>& partitions, std::string_view line = "press") {
  const auto found = claim_of(partitions, "plant", line);
  return found ? std::string(name(found->right)) + "/" + found->name : "";
}

TEST(ClaimOf, APartitionOfTheLine) {
  EXPECT_EQ(claim({"plant/press/operator/alice"}), "operator/alice");
  EXPECT_EQ(claim({"plant/press/engineer/erin"}), "engineer/erin");
  EXPECT_EQ(claim({"plant/oven/operator/alice", "plant/press/operator/alice"}), "operator/alice");
  EXPECT_EQ(claim({"plant//operator/alice"}, ""), "operator/alice");
  EXPECT_EQ(request_partition("plant", "press", "operator/alice"), "plant/press/operator/alice");
}

TEST(ReplyPartition, HasRightAndName) {
  EXPECT_EQ(reply_partition("plant", "operator/alice"), "plant//operator/alice");
  EXPECT_EQ(replies_to("operator/alice"), "*/*/operator/alice");
}

TEST(ClaimOf, NothingElse) {
  for (const char* partition :
       {"", "*", "plant/*", "plant/press", "plant/press/", "plant/press/operator",
        "plant/press/operator/", "plant/press/viewer/victor", "plant/press/gateway/plant",
        "plant/press/Operator/alice", "plant/oven/operator/alice", "plan/press/operator/alice",
        "plant/press/operator/alice/more", "plant/press/engineer/erin/operator/alice",
        "plant//press/operator/alice", "/plant/press/operator/alice", "plant/press/operator/al*",
        "plant/pr?ss/operator/alice", "plant/press/operator/[a]"}) {
    EXPECT_EQ(claim({partition}), "") << partition;
  }
  EXPECT_EQ(claim({}), "");
  // The line of a request is chosen by its sender.
  for (const char* line : {"press/engineer/erin", "press/operator", "press/", "*", ""})
    EXPECT_EQ(claim({"plant/press/operator/alice"}, line), "") << line;
}

TEST(ClaimOf, OneWildcardSpoilsAll) {
  EXPECT_EQ(claim({"plant/press/operator/alice", "plant/*/operator/alice"}), "");
}

}  // namespace
}  // namespace linegate::dds

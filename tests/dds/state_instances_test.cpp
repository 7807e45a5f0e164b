// SPDX-License-Identifier: Apache-2.0
#include "bridges/dds/state_instances.h"

#include <gtest/gtest.h>

namespace linegate::dds {
namespace {

constexpr WriterGuid kWriter{1};
constexpr WriterGuid kSuccessor{2};

TEST(StateInstances, AnEndNamesTheNodeOnce) {
  StateInstances<int> instances;
  instances.note(5, {"gw", "press", 7}, kWriter);
  EXPECT_FALSE(instances.end(6, kWriter)) << "never received";
  const auto ended = instances.end(5, kWriter);
  ASSERT_TRUE(ended);
  EXPECT_EQ(ended->gateway, "gw");
  EXPECT_EQ(ended->line, "press");
  EXPECT_EQ(ended->number, 7);
  EXPECT_FALSE(instances.end(5, kWriter));
}

TEST(StateInstances, TheEndOfAnEarlierWriterIsNoEnd) {
  StateInstances<int> instances;
  instances.note(5, {"gw", "press", 7}, kWriter);
  instances.note(5, {"gw", "press", 7}, kSuccessor);
  EXPECT_FALSE(instances.end(5, kWriter));
  EXPECT_TRUE(instances.end(5, kSuccessor));
}

TEST(StateInstances, AreBounded) {
  using Instances = StateInstances<std::size_t>;
  Instances instances;
  for (std::size_t i = 0; i <= Instances::kMost; ++i)
    instances.note(i, {"gw", "press", 7}, kWriter);
  EXPECT_FALSE(instances.end(Instances::kMost, kWriter));
  EXPECT_TRUE(instances.end(0, kWriter));
  instances.note(Instances::kMost, {"gw", "press", 7}, kWriter);
  EXPECT_TRUE(instances.end(Instances::kMost, kWriter));
}

}  // namespace
}  // namespace linegate::dds

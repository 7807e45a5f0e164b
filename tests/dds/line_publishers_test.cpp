// SPDX-License-Identifier: Apache-2.0
// The lines that disappear with their writer, and the bound on the number of line names.
#include "bridges/dds/line_publishers.h"

#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace linegate::dds {
namespace {

using Publishers = LinePublishers<int>;  // writers are identified by a number

std::vector<std::string> lose(Publishers& publishers, int writer) {
  std::vector<std::string> gone;
  publishers.lose(writer, [&](const std::string& gateway, const std::string& line) {
    gone.push_back(gateway + "/" + line);
  });
  return gone;
}

TEST(LinePublishers, AWriterIsLostWithItsLinesOnce) {
  Publishers publishers;
  EXPECT_TRUE(publishers.note("plant", "press", 1));
  EXPECT_TRUE(publishers.note("plant", "hall", 1));
  EXPECT_TRUE(publishers.note("other", "press", 2));
  EXPECT_EQ(lose(publishers, 1), (std::vector<std::string>{"plant/hall", "plant/press"}));
  EXPECT_TRUE(lose(publishers, 1).empty());
}

TEST(LinePublishers, ALineMayGoWhileItsWriterStays) {
  Publishers publishers;
  publishers.note("plant", "press", 1);
  publishers.note("plant", "hall", 1);
  publishers.forget("plant", "press");
  publishers.forget("plant", "nobody");
  EXPECT_EQ(lose(publishers, 1), std::vector<std::string>{"plant/hall"});
}

TEST(LinePublishers, AGatewayThatStartedAgainIsNotGone) {
  Publishers publishers;
  publishers.note("plant", "press", 1);
  publishers.note("plant", "press", 2);
  EXPECT_TRUE(lose(publishers, 1).empty());
}

TEST(LinePublishers, AreBoundedAndKnownLinesGoOn) {
  Publishers publishers;
  for (std::size_t i = 0; i < Publishers::kMaxLines; ++i) {
    ASSERT_TRUE(publishers.note("stranger", std::to_string(i), 1));
  }
  EXPECT_FALSE(publishers.note("stranger", "one more", 1));
  EXPECT_TRUE(publishers.note("stranger", "7", 2));
  EXPECT_EQ(lose(publishers, 1).size(), Publishers::kMaxLines - 1);
  EXPECT_TRUE(publishers.note("stranger", "one more", 1)) << "there is room for a line again";
}

}  // namespace
}  // namespace linegate::dds

// SPDX-License-Identifier: Apache-2.0
// A line counts as unchanged as long as everything it is read from is unchanged.
#include "gateway/config/source.h"

#include <filesystem>
#include <fstream>
#include <string>

#include <gtest/gtest.h>
#include <unistd.h>

#include "gateway/config/plant.h"

#include "tests/paths.h"

namespace linegate::config {
namespace {

TEST(Canonical, IsTheSameForWhatMeansTheSame) {
  const auto of = [](const char* text) { return canonical(YAML::Load(text)); };
  EXPECT_EQ(of("{a: 1, b: [x, y]}"), of("# a remark\nb:\n  - 'x'\n  - \"y\"\na: 1\n"));
  EXPECT_EQ(of("{a: &n {c: 1}, b: *n}"), of("{a: {c: 1}, b: {c: 1}}"));
  for (const char* other : {"{a: 2, b: [x, y]}", "{a: 1, b: [y, x]}", "{a: 1, b: [x]}", "{a: 1}",
                            "{a: 1, b: [[x, y]]}", "{a: 1, b: [xy]}", "[a, 1]", "", "a"}) {
    EXPECT_NE(of("{a: 1, b: [x, y]}"), of(other)) << other;
  }
}

class SourceTest : public testing::Test {
 protected:
  SourceTest() {
    std::filesystem::create_directory(folder_);
    std::filesystem::copy_file(paths::in_repository("bridges/sim/eds/digital-io.eds"),
                               folder_ / "io.eds");
  }
  ~SourceTest() override { std::filesystem::remove_all(folder_); }

  // The sources of all lines.
  std::vector<std::string> sources(const std::string& text) const {
    const auto loaded = read(text, (folder_ / "plant.yaml").string());
    std::vector<std::string> out;
    for (const auto& diagnostic : loaded.diagnostics) {
      ADD_FAILURE() << to_string(diagnostic);
    }
    for (const auto& line : loaded.value.value_or(Plant{}).lines) {
      out.push_back(line.source);
    }
    return out;
  }

  const std::filesystem::path folder_ =
      std::filesystem::temp_directory_path() / ("linegate-source-test-" + std::to_string(getpid()));
  const std::string plant_ = R"(schema: 1
executors: [{name: fast, priority: 3}]
lines:
  - {name: a, interface: "virtual:a", nodes: [{id: 5, eds: io.eds}]}
  - {name: b, interface: "virtual:b", executor: fast}
  - {name: c, interface: "virtual:c", network_id: 9}
)";
};

TEST_F(SourceTest, ALineOfItsOwnIsAllThatChangesWithIt) {
  const auto before = sources(plant_);
  ASSERT_EQ(before.size(), 3U);
  EXPECT_EQ(sources(plant_), before);
  EXPECT_EQ(sources("# a remark\n" + plant_), before);

  std::string text = plant_;
  text.replace(text.find("id: 5"), 5, "id: 6");
  const auto after = sources(text);
  EXPECT_NE(after[0], before[0]);
  EXPECT_EQ(after[1], before[1]);
  EXPECT_EQ(after[2], before[2]);
}

TEST_F(SourceTest, ADeviceFileBelongsToTheLinesThatNameIt) {
  const auto before = sources(plant_);
  std::ofstream(folder_ / "io.eds", std::ios::app) << "; a remark\n";
  const auto after = sources(plant_);
  EXPECT_NE(after[0], before[0]);
  EXPECT_EQ(after[1], before[1]);
}

TEST_F(SourceTest, AnExecutorBelongsToItsLines) {
  const auto before = sources(plant_);
  std::string text = plant_;
  text.replace(text.find("priority: 3"), 11, "priority: 4");
  const auto after = sources(text);
  EXPECT_EQ(after[0], before[0]);
  EXPECT_NE(after[1], before[1]);
  EXPECT_EQ(after[2], before[2]);
}

// Forty aliases, each twice as large as the one before, are never expanded.
TEST_F(SourceTest, AliasesInAliasesAreAnErrorAndNoMore) {
  std::string bombs = "x0: &b0 [x]\n";
  for (int i = 1; i < 40; ++i) {
    const std::string before = "*b" + std::to_string(i - 1);
    const std::string name = std::to_string(i);
    bombs += "x" + name + ": &b" + name + " [" + before + ", " + before + "]\n";
  }
  const auto loaded =
      read(bombs + "schema: 1\nlines: [{name: a, interface: 'virtual:a', nodes: *b39}]\n",
           (folder_ / "plant.yaml").string());
  EXPECT_FALSE(loaded.ok());
}

TEST_F(SourceTest, ThePlaceInTheListCountsWhereItGivesTheNetworkId) {
  const auto before = sources(plant_);
  std::string text = plant_;
  text.replace(text.find("  - {name: a"), 0, "  - {name: first, interface: \"virtual:f\"}\n");
  const auto after = sources(text);
  ASSERT_EQ(after.size(), 4U);
  EXPECT_NE(after[1], before[0]);
  EXPECT_EQ(after[3], before[2]) << "the line has its own network-ID";
}

}  // namespace
}  // namespace linegate::config

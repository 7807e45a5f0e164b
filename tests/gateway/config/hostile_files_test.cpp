// SPDX-License-Identifier: Apache-2.0
// Files that are built to cause harm: endless ones, nested aliases, tens of thousands of keys. Each
// ends in findings, in a time that is proportional to its size.
#include <filesystem>
#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include "gateway/config/plant.h"
#include "gateway/config/whole_file.h"

namespace linegate::config {
namespace {

using testing::HasSubstr;

class HostileFile : public testing::Test {
 protected:
  HostileFile() : folder_(testing::TempDir() + "linegate_hostile_" + test_name()) {
    std::filesystem::create_directories(folder_);
  }
  ~HostileFile() override { std::filesystem::remove_all(folder_); }

  static std::string test_name() {
    return testing::UnitTest::GetInstance()->current_test_info()->name();
  }
  static std::string messages(const Loaded<Plant>& loaded) {
    std::string out;
    for (const auto& diagnostic : loaded.diagnostics) {
      out += to_string(diagnostic) + '\n';
    }
    return out;
  }

  std::string folder_;
};

const std::string kNode =
    "schema: 1\nlines:\n  - {name: a, interface: 'virtual:a', nodes: [{id: 5, ";

TEST_F(HostileFile, WithoutAnEndIsRefusedByItsType) {
  EXPECT_THAT(messages(load("/dev/zero")), HasSubstr("/dev/zero: error: cannot be read: it is no "
                                                     "regular file"));
  const std::string fifo = folder_ + "/fifo";
  ASSERT_EQ(mkfifo(fifo.c_str(), 0600), 0);
  EXPECT_THAT(messages(load(fifo)), HasSubstr("it is no regular file"));
  for (const char* file : {"fifo", "/dev/zero"}) {
    EXPECT_THAT(messages(read(kNode + "eds: " + file + "}]}\n", folder_ + "/plant.yaml")),
                HasSubstr(std::string(file) + " cannot be read: it is no regular file"));
  }
}

TEST_F(HostileFile, ThatIsTooLargeIsRefused) {
  const std::string large = folder_ + "/large.eds";
  std::ofstream(large).put('x');
  std::filesystem::resize_file(large, kLargestFile + 1);  // sparse: no blocks are allocated
  std::string why;
  EXPECT_FALSE(whole_file(large, why));
  EXPECT_EQ(why, "cannot be read: it has more than 64 MB");
  std::filesystem::resize_file(large, 1000);
  EXPECT_EQ(whole_file(large, why)->size(), 1000U);
}

// Ten aliases in each of twenty levels stand for 10^20 values.
TEST_F(HostileFile, AliasesInAliasesAreCountedBeforeTheyAreFollowed) {
  std::string text = "schema: 1\na0: &a0 [x]\n";
  for (int level = 1; level <= 20; ++level) {
    const std::string below = "*a" + std::to_string(level - 1);
    text += "a" + std::to_string(level) + ": &a" + std::to_string(level) + " [" + below;
    for (int i = 1; i < 10; ++i) {
      text += ", " + below;
    }
    text += "]\n";
  }
  const auto loaded = read(text + "lines: *a20\n", "plant.yaml");
  ASSERT_EQ(loaded.diagnostics.size(), 1U);
  EXPECT_THAT(messages(loaded), HasSubstr("more than 2000000 values"));
  EXPECT_THAT(messages(read("a: &a [*a]\n", "plant.yaml")),
              HasSubstr("plant.yaml:1:8: error: an alias stands for something that it is a part "
                        "of"));
}

TEST_F(HostileFile, AliasesAsPeopleUseThemAreFine) {
  const auto loaded = read(
      "schema: 1\nlines:\n  - {name: a, interface: 'virtual:a', publish: &p {period: 100ms}}\n"
      "  - {name: b, interface: 'virtual:b', publish: *p}\n",
      "plant.yaml");
  EXPECT_TRUE(loaded.ok()) << messages(loaded);
}

TEST_F(HostileFile, MergeKeysAsPeopleUseThemAreFine) {
  const std::string text =
      "schema: 1\nlines:\n  - &press {name: press, interface: 'virtual:press', bit_rate: 125kbit,\n"
      "     network_id: 9, publish: &p {period: 100ms}}\n"
      "  - {<<: *press, name: hall, interface: 'virtual:hall', network_id: 10}\n"
      "  - <<: [{network_id: 11, bit_rate: 1Mbit}, *press]\n"
      "    name: pack\n    interface: 'virtual:pack'\n    publish: {<<: *p}\n";
  const auto loaded = read(text, "plant.yaml");
  ASSERT_TRUE(loaded.ok()) << messages(loaded);
  const auto& lines = loaded.value->lines;
  ASSERT_EQ(lines.size(), 3U);
  EXPECT_EQ(lines[1].config.name, "hall");
  EXPECT_EQ(lines[1].config.bit_rate, 125'000U) << "merged";
  EXPECT_EQ(lines[1].config.network_id, 10) << "the line's own key takes precedence";
  EXPECT_EQ(lines[2].config.network_id, 11) << "the first mapping counts";
  EXPECT_EQ(lines[2].config.bit_rate, 1'000'000U);
  EXPECT_THAT(messages(read("schema: 1\nlines:\n  - {<<: 5, name: a, interface: 'virtual:a'}\n",
                            "plant.yaml")),
              HasSubstr("plant.yaml:3:10: error: the merge key << takes a mapping"));
}

TEST_F(HostileFile, AMistakeInWhatIsMergedNamesThePlaceWhereItIsWritten) {
  EXPECT_THAT(messages(read("schema: 1\nlines:\n"
                            "  - &a {name: a, interface: 'virtual:a', bit_rate: 77}\n"
                            "  - {<<: *a, name: b, interface: 'virtual:b'}\n",
                            "plant.yaml")),
              HasSubstr("plant.yaml:3:"));
}

// Each level merges the level below ten times: 10^20 keys if they were expanded before they are
// counted.
TEST_F(HostileFile, MergesOfMergesAreCountedBeforeTheyAreFollowed) {
  std::string text = "schema: 1\na0: &a0 {x: 1}\n";
  for (int level = 1; level <= 20; ++level) {
    const std::string below = "*a" + std::to_string(level - 1);
    text += "a" + std::to_string(level) + ": &a" + std::to_string(level) + " {<<: [" + below;
    for (int i = 1; i < 10; ++i) {
      text += ", " + below;
    }
    text += "]}\n";
  }
  EXPECT_THAT(messages(read(text, "plant.yaml")), HasSubstr("more than 2000000 values"));
}

TEST_F(HostileFile, TenThousandsOfUnknownKeysAreSomeFindings) {
  constexpr int kKeys = 40'000;
  std::string keys;
  for (int i = 0; i < kKeys; ++i) {
    keys += "    unknown_" + std::to_string(i) + ": 1\n";
  }
  const auto loaded =
      read("schema: 1\nlines:\n  - name: a\n    interface: 'virtual:a'\n" + keys, "plant.yaml");
  EXPECT_EQ(loaded.diagnostics.size(), 101U);
  EXPECT_THAT(messages(loaded), HasSubstr("39900 more unknown keys in a line"));
}

TEST_F(HostileFile, MoreNodesThanALineHasRoomForAreNotRead) {
  std::string nodes;
  for (int i = 0; i < 1000; ++i) {
    nodes += "      - {id: 5}\n";
  }
  EXPECT_THAT(messages(read("schema: 1\nlines:\n  - name: a\n    interface: 'virtual:a'\n"
                            "    nodes:\n" +
                                nodes,
                            "plant.yaml")),
              HasSubstr("plant.yaml:133:9: error: nodes has at most 127 elements"));
}

// GatewayState has room for 1024 lines (bridges/dds/values.h), so it lists all of a plant.
TEST_F(HostileFile, MoreLinesThanAGatewayHasRoomForAreRefused) {
  std::string lines;
  for (int i = 0; i < 128; ++i) {
    lines +=
        "  - {name: l" + std::to_string(i) + ", interface: 'virtual:l" + std::to_string(i) + "'}\n";
  }
  EXPECT_THAT(messages(read("schema: 1\nlines:\n" + lines, "plant.yaml")),
              HasSubstr("plant.yaml:130:5: error: lines has at most 127 elements"));
}

TEST_F(HostileFile, ASecondDocumentIsAnError) {
  EXPECT_THAT(messages(read("schema: 1\nlines:\n  - {name: a, interface: 'virtual:a'}\n---\n"
                            "schema: 1\n",
                            "plant.yaml")),
              HasSubstr("error: a second YAML document begins here"));
  EXPECT_TRUE(
      read("---\nschema: 1\nlines:\n  - {name: a, interface: 'virtual:a'}\n...\n", "plant.yaml")
          .ok());
}

}  // namespace
}  // namespace linegate::config

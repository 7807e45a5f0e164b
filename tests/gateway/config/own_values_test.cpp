// SPDX-License-Identifier: Apache-2.0
// The values that a line writes to objects of its own node: own_values and own_concise_dcf.
#include <filesystem>
#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "gateway/config/plant.h"
#include "stack/manager/plan.h"

#include "tests/paths.h"

namespace linegate::config {
namespace {

using testing::ElementsAre;

class OwnValues : public testing::Test {
 protected:
  OwnValues() : folder_(testing::TempDir() + "linegate_own_values_" + test_name()) {
    std::filesystem::create_directories(folder_);
  }
  ~OwnValues() override { std::filesystem::remove_all(folder_); }

  static std::string test_name() {
    return testing::UnitTest::GetInstance()->current_test_info()->name();
  }
  // A plant with one line that has these keys, from line 5 of the file on.
  Loaded<Plant> plant(const std::string& keys) const {
    return read("schema: 1\nlines:\n  - name: press\n    interface: \"simulated:\"\n" + keys,
                folder_ + "/plant.yaml");
  }
  std::vector<std::string> messages(const std::string& keys) const {
    std::vector<std::string> out;
    for (const Diagnostic& diagnostic : plant(keys).diagnostics) {
      out.push_back(std::to_string(diagnostic.line) + ":" + std::to_string(diagnostic.column) +
                    ": " + diagnostic.text);
    }
    return out;
  }
  static std::vector<std::byte> bytes(std::initializer_list<unsigned> values) {
    std::vector<std::byte> out;
    for (const unsigned value : values) {
      out.push_back(static_cast<std::byte>(value));
    }
    return out;
  }

  std::string folder_;
};

TEST_F(OwnValues, AreOfTheTypeThatTheObjectHas) {
  const auto loaded = plant(
      "    own_objects: {2100: {type: i16}}\n"
      "    own_values: {1007: 20000, 2100: -2, 5F41:8: 100}\n");
  ASSERT_TRUE(loaded.ok()) << to_string(loaded.diagnostics.at(0));
  const auto& values = loaded.value->lines.at(0).config.own_values;
  ASSERT_EQ(values.size(), 3U);
  EXPECT_EQ(values[0].address, (od::Address{0x1007, 0}));
  EXPECT_EQ(values[0].data, bytes({0x20, 0x4E, 0, 0}));
  EXPECT_EQ(values[1].data, bytes({0xFE, 0xFF}));
  EXPECT_EQ(values[2].address, (od::Address{0x5F41, 8}));
  EXPECT_EQ(values[2].data, bytes({100, 0}));
}

TEST_F(OwnValues, PutServicesWhereNoPdoMayBe) {
  const std::string nodes =
      "    nodes: [{id: 5, eds: " +
      paths::in_repository("bridges/sim/eds/drive.eds, pdos: {tpdo1: {cob_id: 0x80}}}]\n");
  EXPECT_FALSE(plant(nodes).ok());
  const auto moved = plant("    own_values: {1005: 0xF2}\n" + nodes);
  ASSERT_TRUE(moved.ok()) << to_string(moved.diagnostics.at(0));
  EXPECT_EQ(moved.value->lines.at(0).config.own_values.size(), 1U);
  EXPECT_FALSE(plant("    own_values: {1005: 0x80, 1012: 0xF2}\n" + nodes).ok());
}

TEST_F(OwnValues, OfAConciseDcfComeFirst) {
  const std::vector<manager::ObjectWrite> writes{{{0x1007, 0}, bytes({1, 0, 0, 0})},
                                                 {{0x5F41, 7}, bytes({20})}};
  const auto content = manager::write_concise_dcf(writes);
  std::ofstream(folder_ + "/own.cdc", std::ios::binary)
      .write(reinterpret_cast<const char*>(content.data()),
             static_cast<std::streamsize>(content.size()));
  const auto loaded = plant("    own_concise_dcf: own.cdc\n    own_values: {1007: 2}\n");
  ASSERT_TRUE(loaded.ok()) << to_string(loaded.diagnostics.at(0));
  const auto& values = loaded.value->lines.at(0).config.own_values;
  ASSERT_EQ(values.size(), 3U);
  EXPECT_EQ(values[0].data, bytes({1, 0, 0, 0}));
  EXPECT_EQ(values[1].address, (od::Address{0x5F41, 7}));
  EXPECT_EQ(values[2].data, bytes({2, 0, 0, 0}));
}

TEST_F(OwnValues, WhatTheOwnNodeCannotHaveIsToldWithItsPlace) {
  EXPECT_THAT(
      messages("    own_values:\n"
               "      speed: 1\n"
               "      2F00: 1\n"
               "      1018:1: 1\n"
               "      5F41:0A: 5\n"
               "      5F41:8: 65536\n"
               "      5F41:5: 0\n"
               "      1019:0: 1\n"
               "      1019: 2\n"),
      ElementsAre("6:7: expected an object such as 1007:0 (index and sub-index hexadecimal), got "
                  "\"speed\"",
                  "13:7: object 1019:00 is there twice"));
  EXPECT_THAT(messages("    own_values:\n"
                       "      2F00: 1\n"
                       "      1018:1: 1\n"
                       "      5F41:0A: 5\n"
                       "      5F41:8: 65536\n"
                       "      5F41:5: 0\n"),
              ElementsAre("6:7: the own node has no object 2F00:00",
                          "7:7: object 1018:01 (Vendor-ID) cannot have a value: its access is "
                          "read-only",
                          "8:7: object 5F41:0A (Scan of a node) cannot have a value: its access is "
                          "write-only",
                          "9:15: \"65536\" is no UNSIGNED16 for object 5F41:08 (Default PDO event "
                          "time)",
                          "10:15: the own node refuses the value of object 5F41:05 (Default "
                          "heartbeat producer time): value of parameter too low"));
}

TEST_F(OwnValues, AFileThatIsNoneIsTold) {
  std::ofstream(folder_ + "/own.cdc", std::ios::binary) << "none";
  EXPECT_THAT(messages("    own_concise_dcf: own.cdc\n"),
              ElementsAre("5:22: " + folder_ +
                          "/own.cdc is no concise DCF: its 4 bytes do not match its count and "
                          "sizes"));
  EXPECT_THAT(messages("    own_concise_dcf: other.cdc\n"),
              ElementsAre("5:22: there is no file " + folder_ + "/other.cdc"));
}

TEST_F(OwnValues, AreNotForAnObserver) {
  EXPECT_THAT(messages("    role: observer\n    own_values: {1007: 1}\n"),
              ElementsAre("6:17: own_values has no effect on an observer, which transmits "
                          "nothing"));
}

}  // namespace
}  // namespace linegate::config

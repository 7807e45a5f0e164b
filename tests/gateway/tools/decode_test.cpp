// SPDX-License-Identifier: Apache-2.0
// `linegate decode`: what it takes from a plant, and its JSON.
#include "gateway/tools/decode.h"

#include <filesystem>
#include <fstream>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/paths.h"

namespace linegate::gateway {
namespace {

using testing::HasSubstr;

class DecodeTest : public testing::Test {
 protected:
  DecodeTest() {
    std::ofstream(plant_) << "schema: 1\n"
                             "lines:\n"
                             "  - name: press\n"
                             "    interface: 'virtual:press'\n"
                             "    own_objects: {'2100:1': {name: Recipe, type: u16, map: true}}\n"
                             "    own_pdos: {tpdo40: {cob_id: 0x3AA, map: ['2100:1']}}\n"
                             "    nodes:\n"
                             "      - id: 8\n"
                             "        name: panel\n"
                             "        eds: "
                          << paths::in_repository("bridges/sim/eds/digital-io.eds")
                          << "\n"
                             "        values:\n"
                             "          6000:1: {alias: Level, unit: mm, scale: 0.5, offset: -10}\n"
                             "          6000:2: {unit: pieces}\n";
  }
  ~DecodeTest() override {
    std::filesystem::remove(log_);
    std::filesystem::remove(plant_);
  }
  DecodeTest(const DecodeTest&) = delete;
  DecodeTest& operator=(const DecodeTest&) = delete;

  // Frames as in "705#R1".
  std::string decoded(const std::string& frame, bool json = false) {
    std::ofstream(log_) << "(1700000000.000000) press " << frame << '\n';
    testing::internal::CaptureStdout();
    EXPECT_EQ(decode({.file = log_, .plant = plant_, .json = json}), 0);
    return testing::internal::GetCapturedStdout();
  }

  const std::string log_ = testing::TempDir() + "/decoded.log";
  const std::string plant_ = testing::TempDir() + "/decoded.yaml";
};

TEST_F(DecodeTest, OwnPdosAreExplained) {
  EXPECT_THAT(decoded("3AA#0500"), HasSubstr("TPDO 40 of node 127 (own node): 2100:01 Recipe = 5"));
}

TEST_F(DecodeTest, ValuesHaveTheirNamesAndUnits) {
  EXPECT_THAT(decoded("188#2D030405"), HasSubstr("6000:01 Level = 12.5 mm; 6000:02 "));
  EXPECT_THAT(decoded("188#2D030405"), HasSubstr(" = 3 pieces; 6000:03 "));
  EXPECT_THAT(decoded("588#4F0060012D000000"), HasSubstr("6000:01 Level = 12.5 mm\n"));
  EXPECT_THAT(decoded("588#4F00600305000000"), HasSubstr(" = 5\n")) << "without a unit";
  EXPECT_THAT(decoded("588#4B0060012D000000"), HasSubstr(" = 2D 00\n")) << "of another length";
}

TEST_F(DecodeTest, EachFrameHasItsLength) {
  EXPECT_THAT(decoded("705#R1", true), HasSubstr(R"("remote":true,"fd":false,"length":1,)"));
  EXPECT_THAT(decoded("705#R", true), HasSubstr(R"("length":0,"data":"remote")"));
  EXPECT_THAT(decoded("185#0102", true), HasSubstr(R"("length":2,"data":"01 02")"));
  EXPECT_THAT(decoded("705#R1"), HasSubstr(" remote 1 "));
}

}  // namespace
}  // namespace linegate::gateway

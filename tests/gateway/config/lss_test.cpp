// SPDX-License-Identifier: Apache-2.0
// `lss:` of a line, and simulated devices that start without a node-ID.
#include <gtest/gtest.h>

#include "gateway/config/plant.h"

namespace linegate::config {
namespace {

using namespace std::chrono_literals;

Loaded<Plant> read_line_with(const std::string& keys) {
  return read("schema: 1\nlines:\n  - name: a\n    interface: 'simulated:'\n" + keys, "plant.yaml");
}

std::string first_message(const std::string& keys) {
  const auto loaded = read_line_with(keys);
  return loaded.diagnostics.empty() ? "" : to_string(loaded.diagnostics.front());
}

TEST(LssSection, Defaults) {
  const auto loaded = read_line_with("");
  ASSERT_TRUE(loaded.ok());
  const line::LssConfig& lss = loaded.value->lines.at(0).config.lss;
  EXPECT_FALSE(lss.assign);
  EXPECT_EQ(lss.timeout, 100ms);
  EXPECT_EQ(lss.period, 5s);
  EXPECT_FALSE(lss.store);
  EXPECT_EQ(lss.bit_rate, 0U);
}

TEST(LssSection, Everything) {
  const auto loaded = read_line_with(
      "    lss: {assign: true, timeout: 50ms, period: 0, store: true, bit_rate: 250kbit}\n"
      "    simulate: [{node: 5, profile: drive, unconfigured: true, serial: 7}]\n");
  ASSERT_TRUE(loaded.ok()) << to_string(loaded.diagnostics.front());
  const LinePlan& line = loaded.value->lines.at(0);
  EXPECT_TRUE(line.config.lss.assign);
  EXPECT_EQ(line.config.lss.timeout, 50ms);
  EXPECT_EQ(line.config.lss.period, 0s);
  EXPECT_TRUE(line.config.lss.store);
  EXPECT_EQ(line.config.lss.bit_rate, 250'000U);
  EXPECT_TRUE(line.simulated.at(0).unconfigured);
  EXPECT_EQ(line.simulated.at(0).serial, 7U);
}

TEST(LssSection, WhatIsWrongIsSaidWithItsPlace) {
  EXPECT_EQ(first_message("    lss: {assign: true, bitrate: 250kbit}\n").substr(0, 24),
            "plant.yaml:5:25: error: ");
  EXPECT_EQ(first_message("    lss: {store: true, bit_rate: 300kbit}\n"),
            "plant.yaml:5:34: error: expected one of the bit rates of CiA 305: 10kbit, 20kbit, "
            "50kbit, 125kbit, 250kbit, 500kbit, 800kbit, 1Mbit, got \"300kbit\"");
  EXPECT_EQ(first_message("    lss: {bit_rate: 250kbit}\n"),
            "plant.yaml:5:21: error: bit_rate needs store: true: devices have it when they are "
            "switched on the next time");
  EXPECT_EQ(first_message("    role: observer\n    lss: {assign: true}\n"),
            "plant.yaml:6:10: warning: lss has no effect on an observer, which transmits nothing");
  EXPECT_EQ(first_message("    role: device\n    lss: {assign: true}\n    devices:\n"
                          "      - {id: 5, profile: 401, digital_inputs: 1}\n"),
            "plant.yaml:6:10: error: lss is for a line with the role manager; a device has a key "
            "lss of its own");
}

}  // namespace
}  // namespace linegate::config

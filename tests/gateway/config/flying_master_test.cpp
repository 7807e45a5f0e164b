// SPDX-License-Identifier: Apache-2.0
// `flying_master:` of a line.
#include <gtest/gtest.h>

#include "gateway/config/plant.h"

namespace linegate::config {
namespace {

using namespace std::chrono_literals;

Loaded<Plant> read_flying_line(const std::string& keys) {
  return read("schema: 1\nlines:\n  - name: a\n    interface: 'simulated:'\n" + keys, "plant.yaml");
}

std::string finding_of(const std::string& keys) {
  const auto loaded = read_flying_line(keys);
  return loaded.diagnostics.empty() ? "" : to_string(loaded.diagnostics.front());
}

TEST(FlyingMasterSection, MayBeEmpty) {
  const auto loaded = read_flying_line("    flying_master: {}\n");
  ASSERT_TRUE(loaded.ok());
  ASSERT_TRUE(loaded.value->lines.at(0).config.flying_master);
  EXPECT_EQ(loaded.value->lines.at(0).config.flying_master->priority, 2);
  EXPECT_FALSE(read_flying_line("").value->lines.at(0).config.flying_master);
}

TEST(FlyingMasterSection, WhatIsWrongIsSaidWithItsPlace) {
  EXPECT_EQ(finding_of("    flying_master: {priority: 3}\n"),
            "plant.yaml:5:31: error: expected a number from 0 to 2, got \"3\"");
  EXPECT_EQ(finding_of("    flying_master: {detect_cycle: 0}\n"),
            "plant.yaml:5:35: error: detect_cycle is not from 1ms to 65535ms");
  EXPECT_EQ(finding_of("    flying_master: {priority_slot: 1270ms}\n"),
            "plant.yaml:5:20: error: priority_slot of flying_master must be more than 127 x "
            "device_slot");
  EXPECT_EQ(finding_of("    flying_master: {detection: shout}\n"),
            "plant.yaml:5:32: error: expected ask or force, got \"shout\"");
  EXPECT_EQ(finding_of("    role: device\n    flying_master: {}\n"),
            "plant.yaml:6:20: error: flying_master is for a line with the role manager");
  EXPECT_EQ(finding_of("    role: observer\n    flying_master: {}\n"),
            "plant.yaml:6:20: warning: flying_master has no effect on an observer, which "
            "transmits nothing");
}

}  // namespace
}  // namespace linegate::config

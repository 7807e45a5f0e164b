// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "stack/scan/describe.h"

#include "tests/stack/scan/answers.h"

namespace linegate::scan {
namespace {

using namespace std::chrono_literals;
using test::Answers;

constexpr od::Address kGuard{0x100C, 0};
constexpr od::Address kFactor{0x100D, 0};
constexpr od::Address kBeat{0x1017, 0};

ScannedNode set_up_alone(ScannedNode node) {
  set_up(std::span(&node, 1), 250ms);
  return node;
}

TEST(SetUp, ADeviceWithoutErrorControlGetsAHeartbeat) {
  Answers answers;
  answers.set(0x1000, 0, 0x0002'0192, 4);
  answers.set(0x100C, 0, 0, 2);
  answers.set(0x100D, 0, 0, 1);
  answers.set(0x1017, 0, 0, 2);
  const ScannedNode node = set_up_alone(answers.survey());
  EXPECT_EQ(node.number(kBeat), 250U);
  EXPECT_EQ(node.find(kBeat)->size(), 2U);
  EXPECT_EQ(node.number(kGuard), 0U) << "heartbeat or guarding, not both";
}

TEST(SetUp, WhatADeviceHasSetUpIsKept) {
  Answers beats;
  beats.set(0x1000, 0, 0x0002'0192, 4);
  beats.set(0x1017, 0, 1000, 2);
  EXPECT_EQ(set_up_alone(beats.survey()).number(kBeat), 1000U);
  Answers guarded;
  guarded.set(0x1000, 0, 0x0002'0192, 4);
  guarded.set(0x100C, 0, 100, 2);
  guarded.set(0x100D, 0, 3, 1);
  guarded.set(0x1017, 0, 0, 2);
  const ScannedNode node = set_up_alone(guarded.survey());
  EXPECT_EQ(node.number(kBeat), 0U) << "it would disable guarding";
  EXPECT_EQ(node.number(kFactor), 3U);
}

TEST(SetUp, ADeviceWithoutHeartbeatIsGuarded) {
  Answers answers;
  answers.set(0x1000, 0, 0x0002'0192, 4);
  answers.set(0x100C, 0, 100, 2);
  answers.set(0x100D, 0, 0, 1);
  const ScannedNode node = set_up_alone(answers.survey());
  EXPECT_EQ(node.number(kGuard), 250U);
  EXPECT_EQ(node.number(kFactor), 4U);
  EXPECT_EQ(node.number(kBeat), std::nullopt);
}

TEST(SetUp, AnalogueInputsAreSent) {
  Answers answers;
  answers.set(0x1000, 0, 0x0004'0191, 4);
  answers.set(0x6423, 0, 0, 1);
  EXPECT_EQ(set_up_alone(answers.survey()).number({0x6423, 0}), 1U);
}

}  // namespace
}  // namespace linegate::scan

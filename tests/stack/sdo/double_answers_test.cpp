// SPDX-License-Identifier: Apache-2.0
#include "stack/sdo/double_answers.h"

#include <gtest/gtest.h>

namespace linegate::sdo::test {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

using Found = DoubleAnswers::Found;

// The response of an expedited upload of 4 bytes, 43h.
std::uint64_t answer_of(std::uint16_t index, std::uint8_t sub, std::uint32_t value) {
  return 0x43U | std::uint64_t{index} << 8U | std::uint64_t{sub} << 24U |
         std::uint64_t{value} << 32U;
}

class DoubleAnswersTest : public ::testing::Test {
 protected:
  Found asked(std::uint16_t index, std::uint8_t sub = 0, std::uint32_t value = 1) {
    return answers_.response(answer_of(index, sub, value), true, now_ += milliseconds(1));
  }
  Found second(std::uint16_t index, std::uint8_t sub = 0, std::uint32_t value = 1) {
    return answers_.response(answer_of(index, sub, value), false, now_ += milliseconds(1));
  }

  Instant now_{seconds(1)};
  DoubleAnswers answers_;
};

// The second of two devices sends its responses after the first one has answered all requests.
TEST_F(DoubleAnswersTest, AnswersOfADeviceThatLagsBehindAreSecondOnes) {
  EXPECT_EQ(asked(0x1000), Found::nothing);
  EXPECT_EQ(asked(0x1018, 1), Found::nothing);
  EXPECT_EQ(asked(0x1018, 2), Found::nothing);
  const std::uint64_t refused = 0x0602'0000'04'1018'80U;  // 1018h:4 does not exist
  EXPECT_EQ(answers_.response(refused, true, now_), Found::nothing);
  EXPECT_EQ(asked(0x1017), Found::nothing);
  EXPECT_EQ(asked(0x2000), Found::nothing);
  EXPECT_EQ(second(0x1000), Found::second_answer);
  EXPECT_EQ(second(0x1018, 1), Found::second_answer);
  EXPECT_EQ(second(0x1018, 2), Found::second_answer);
  EXPECT_EQ(answers_.response(refused, false, now_), Found::second_answer);
  EXPECT_EQ(second(0x1017), Found::second_answer);
  EXPECT_EQ(second(0x2000), Found::two_devices);
}

TEST_F(DoubleAnswersTest, IdenticalAnswersInTheSameMomentAreFound) {
  const auto both = [this](std::uint8_t sub) {
    const std::uint64_t word = answer_of(0x6000, sub, 1);
    EXPECT_EQ(answers_.response(word, true, now_), Found::nothing);
    return answers_.response(word, false, now_);
  };
  for (std::uint8_t sub = 1; sub < 6; ++sub) {
    EXPECT_EQ(both(sub), Found::second_answer);
  }
  EXPECT_EQ(both(6), Found::two_devices);
  EXPECT_EQ(both(7), Found::second_answer) << "reported recently";
}

TEST_F(DoubleAnswersTest, AnotherIdentityIsFoundAtOnceAnotherProcessValueIsNot) {
  asked(0x6064, 0, 17);
  EXPECT_EQ(second(0x6064, 0, 18), Found::second_answer) << "its request may have been repeated";
  asked(0x1018, 4, 17);
  EXPECT_EQ(second(0x1018, 4, 18), Found::two_devices);
}

TEST_F(DoubleAnswersTest, RepeatedFramesAreNoSecondDevice) {
  for (int i = 0; i < 50; ++i) {
    asked(0x1000);
    EXPECT_EQ(second(0x1000), Found::second_answer);
    asked(0x1018, 1);
    EXPECT_EQ(second(0x1018, 1), Found::second_answer);
    asked(0x1018, 2);
  }
}

// The second device was removed, and a controller repeats a frame later.
TEST_F(DoubleAnswersTest, AnswersOfLongAgoDoNotCount) {
  for (std::uint8_t sub = 1; sub < 6; ++sub) {
    asked(0x6000, sub);
    EXPECT_EQ(second(0x6000, sub), Found::second_answer);
  }
  now_ += DoubleAnswers::kRow;
  for (std::uint8_t sub = 1; sub < 6; ++sub) {
    asked(0x6000, sub);
    EXPECT_EQ(second(0x6000, sub), Found::second_answer);
  }
  asked(0x6000, 6);
  EXPECT_EQ(second(0x6000, 6), Found::two_devices);
}

TEST_F(DoubleAnswersTest, WhatComesAfterADisturbanceOrTooLateIsNone) {
  answers_.disturb(now_);
  for (std::uint8_t sub = 1; sub < 9; ++sub) {
    asked(0x1018, sub);
    EXPECT_EQ(second(0x1018, sub, 2), Found::second_answer) << "the request was repeated";
  }
  now_ += DoubleAnswers::kUndisturbed;
  asked(0x1018, 1);
  now_ += DoubleAnswers::kLate;
  EXPECT_EQ(second(0x1018, 1, 2), Found::nothing);
}

TEST_F(DoubleAnswersTest, TheAnswerToACancelledRequestIsNoSecondOne) {
  for (int i = 0; i < 20; ++i) {
    answers_.cancel({0x1000, 0}, now_);
    asked(0x1000);
    EXPECT_EQ(second(0x1000), Found::second_answer) << "of the cancelled request";
  }
}

TEST_F(DoubleAnswersTest, AnswersThatNobodyAskedForAreNone) {
  EXPECT_EQ(second(0x1018, 1), Found::nothing);
  asked(0x1018, 1);
  answers_.forget();
  EXPECT_EQ(second(0x1018, 1, 2), Found::nothing);
  EXPECT_EQ(answers_.response(0x00'00'00'00'01'10'18'80U, false, now_), Found::nothing);
}

}  // namespace
}  // namespace linegate::sdo::test

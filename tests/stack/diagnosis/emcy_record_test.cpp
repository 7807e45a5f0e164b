// SPDX-License-Identifier: Apache-2.0
#include "stack/diagnosis/emcy_record.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace linegate::diagnosis {
namespace {

emcy::Message message(std::uint16_t code, std::uint8_t error_register = 1, std::uint8_t info = 0) {
  return {.code = code, .error_register = error_register, .info = {std::byte{info}}};
}

std::vector<unsigned> numbers(std::span<const std::byte> bytes) {
  std::vector<unsigned> out;
  for (const std::byte byte : bytes) {
    out.push_back(std::to_integer<unsigned>(byte));
  }
  return out;
}

TEST(EmcyRecord, WithoutMessagesTheHistoryIsOneZero) {
  const EmcyRecord record;
  EXPECT_THAT(numbers(record.history(5)), testing::ElementsAre(0));
  EXPECT_EQ(record.count(5), 0);
}

TEST(EmcyRecord, AMessageIsKeptAsItCame) {
  EmcyRecord record;
  record.note(5, message(0x8110, 0x11, 0xAB));
  EXPECT_THAT(numbers(record.history(5)),
              testing::ElementsAre(1, 0x10, 0x81, 0x11, 0xAB, 0, 0, 0, 0));
  EXPECT_THAT(numbers(record.history(6)), testing::ElementsAre(0)) << "one history for each node";
}

TEST(EmcyRecord, OfCanopenFdTheFieldsOfAClassicalOneAreKept) {
  EmcyRecord record;
  for (int i = 0; i < 5; ++i) {
    emcy::Message fd = message(0x8110, 0x11, 0xAB);
    fd.fd = {.any = true, .logical_device = 7, .status = 1, .profile = 402};
    record.note(5, fd);
  }
  ASSERT_EQ(record.history(5).size(), 33U);
  EXPECT_THAT(numbers(record.history(5).subspan(25)),
              testing::ElementsAre(0x10, 0x81, 0x11, 0xAB, 0, 0, 0, 0));
}

TEST(EmcyRecord, TheFifthTakesThePlaceOfTheFirst) {
  EmcyRecord record;
  for (std::uint8_t i = 1; i <= 6; ++i) {
    record.note(5, message(0x1000, 1, i));
  }
  const std::vector<unsigned> history = numbers(record.history(5));
  ASSERT_EQ(history.size(), 33U);
  EXPECT_EQ(history[0], 2U);
  EXPECT_EQ(history[1 + 3], 5U);
  EXPECT_EQ(history[9 + 3], 6U) << "the newest EMCY";
  EXPECT_EQ(history[17 + 3], 3U) << "the oldest EMCY";
  EXPECT_EQ(history[25 + 3], 4U);
}

TEST(EmcyRecord, CountsByNodeAndByClass) {
  EmcyRecord record;
  const std::uint16_t codes[] = {0x1000, 0x5001, 0x5100, 0x6010, 0x8130,
                                 0x8210, 0x9000, 0xFF42, 0x0000, 0x8100};
  for (const std::uint16_t code : codes) {
    record.note(7, message(code));
  }
  EXPECT_EQ(record.count(7), 10) << "error resets are counted, too";
  std::vector<unsigned> classes;
  for (std::size_t i = 0; i < kEmcyClasses.size(); ++i) {
    classes.push_back(record.of_class(i));
  }
  EXPECT_THAT(classes, testing::ElementsAre(1, 1, 1, 2, 1, 1, 1)) << "51xxh is not counted";
}

TEST(EmcyRecord, CountersEndAt255) {
  EmcyRecord record;
  for (int i = 0; i < 300; ++i) {
    record.note(1, message(0x8110));
  }
  EXPECT_EQ(record.count(1), 255);
  EXPECT_EQ(record.of_class(3), 255);
}

TEST(EmcyRecord, ANodeIsFreeOfErrorsWhenItSaysSo) {
  EmcyRecord record;
  EXPECT_FALSE(record.erroneous(9));
  record.note(9, message(0x8110));
  EXPECT_TRUE(record.erroneous(9));
  record.note(9, message(0x0000, 0x10));
  EXPECT_TRUE(record.erroneous(9)) << "the error register has another error";
  record.note(9, message(0x0000, 0));
  EXPECT_FALSE(record.erroneous(9));
}

}  // namespace
}  // namespace linegate::diagnosis

// SPDX-License-Identifier: Apache-2.0
// SDO transfers of other nodes, frame by frame.
#include "stack/observer/sdo_follower.h"

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include <gtest/gtest.h>

namespace linegate::observer {
namespace {

using Bytes = std::array<std::uint8_t, 8>;

class SdoFollowerTest : public testing::Test {
 protected:
  static can::Frame frame(const Bytes& data) {
    can::Frame out;
    out.length = 8;
    for (std::size_t i = 0; i < data.size(); ++i) {
      out.data[i] = std::byte{data[i]};
    }
    return out;
  }

  void client(const Bytes& data) { take(follower_.request(at_now(data))); }
  void server(const Bytes& data) { take(follower_.answer(at_now(data))); }

  can::Frame at_now(const Bytes& data) const {
    can::Frame out = frame(data);
    out.time = now_;
    return out;
  }

  void take(const std::optional<Transfer>& transfer) {
    if (transfer) {
      told_.push_back(*transfer);
    }
  }

  static std::vector<int> value(const Transfer& transfer) {
    std::vector<int> out;
    for (const std::byte b : transfer.kept()) {
      out.push_back(std::to_integer<int>(b));
    }
    return out;
  }

  SdoFollower follower_;
  Instant now_{std::chrono::seconds(1)};
  std::vector<Transfer> told_;
};

TEST_F(SdoFollowerTest, ExpeditedDownload) {
  client({0x2B, 0x17, 0x10, 0x00, 0xE8, 0x03, 0, 0});
  EXPECT_TRUE(told_.empty()) << "the server has not confirmed it";
  server({0x60, 0x17, 0x10, 0x00, 0, 0, 0, 0});
  ASSERT_EQ(told_.size(), 1U);
  EXPECT_EQ(told_[0].address, (od::Address{0x1017, 0}));
  EXPECT_TRUE(told_[0].download);
  EXPECT_EQ(value(told_[0]), (std::vector<int>{0xE8, 0x03}));
  server({0x60, 0x17, 0x10, 0x00, 0, 0, 0, 0});
  EXPECT_EQ(told_.size(), 1U) << "a repeated frame";
}

TEST_F(SdoFollowerTest, ExpeditedUpload) {
  client({0x40, 0x00, 0x1A, 0x01, 0, 0, 0, 0});
  server({0x43, 0x00, 0x1A, 0x01, 0x10, 0x00, 0x00, 0x20});
  ASSERT_EQ(told_.size(), 1U);
  EXPECT_FALSE(told_[0].download);
  EXPECT_EQ(value(told_[0]), (std::vector<int>{0x10, 0x00, 0x00, 0x20}));
}

TEST_F(SdoFollowerTest, SegmentedDownload) {
  client({0x21, 0x08, 0x10, 0x00, 9, 0, 0, 0});
  server({0x60, 0x08, 0x10, 0x00, 0, 0, 0, 0});
  client({0x00, 1, 2, 3, 4, 5, 6, 7});
  server({0x20, 0, 0, 0, 0, 0, 0, 0});
  client({0x1B, 8, 9, 0, 0, 0, 0, 0});
  EXPECT_TRUE(told_.empty());
  server({0x30, 0, 0, 0, 0, 0, 0, 0});
  ASSERT_EQ(told_.size(), 1U);
  EXPECT_EQ(value(told_[0]), (std::vector<int>{1, 2, 3, 4, 5, 6, 7, 8, 9}));
}

TEST_F(SdoFollowerTest, SegmentedUpload) {
  client({0x40, 0x08, 0x10, 0x00, 0, 0, 0, 0});
  server({0x41, 0x08, 0x10, 0x00, 9, 0, 0, 0});
  client({0x60, 0, 0, 0, 0, 0, 0, 0});
  server({0x00, 1, 2, 3, 4, 5, 6, 7});
  client({0x70, 0, 0, 0, 0, 0, 0, 0});
  server({0x1B, 8, 9, 0, 0, 0, 0, 0});
  ASSERT_EQ(told_.size(), 1U);
  EXPECT_EQ(value(told_[0]), (std::vector<int>{1, 2, 3, 4, 5, 6, 7, 8, 9}));
}

TEST_F(SdoFollowerTest, BlockDownloadWithALostSegment) {
  client({0xC6, 0x50, 0x1F, 0x01, 16, 0, 0, 0});
  server({0xA4, 0x50, 0x1F, 0x01, 2, 0, 0, 0});
  client({0x01, 1, 2, 3, 4, 5, 6, 7});
  client({0x02, 0x40, 0x18, 0x10, 0x01, 0, 0, 0});  // a segment that looks like an initiate request
  server({0xA2, 1, 2, 0, 0, 0, 0, 0});
  client({0x01, 8, 9, 10, 11, 12, 13, 14});
  client({0x82, 15, 16, 0, 0, 0, 0, 0});
  server({0xA2, 2, 2, 0, 0, 0, 0, 0});
  client({0xD5, 0x12, 0x34, 0, 0, 0, 0, 0});
  EXPECT_TRUE(told_.empty());
  server({0xA1, 0, 0, 0, 0, 0, 0, 0});
  ASSERT_EQ(told_.size(), 1U);
  EXPECT_TRUE(told_[0].download);
  EXPECT_EQ(value(told_[0]),
            (std::vector<int>{1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16}));
}

TEST_F(SdoFollowerTest, BlockUpload) {
  client({0xA4, 0x08, 0x10, 0x00, 127, 0, 0, 0});
  server({0xC6, 0x08, 0x10, 0x00, 9, 0, 0, 0});
  client({0xA3, 0, 0, 0, 0, 0, 0, 0});
  server({0x01, 1, 2, 3, 4, 5, 6, 7});
  server({0x82, 8, 9, 0, 0, 0, 0, 0});
  client({0xA2, 2, 127, 0, 0, 0, 0, 0});
  server({0xD5, 0x12, 0x34, 0, 0, 0, 0, 0});
  client({0xA1, 0, 0, 0, 0, 0, 0, 0});
  ASSERT_EQ(told_.size(), 1U);
  EXPECT_EQ(value(told_[0]), (std::vector<int>{1, 2, 3, 4, 5, 6, 7, 8, 9}));
}

TEST_F(SdoFollowerTest, AValueWithAHoleIsNotTold) {
  client({0xC2, 0x50, 0x1F, 0x01, 14, 0, 0, 0});
  server({0xA0, 0x50, 0x1F, 0x01, 2, 0, 0, 0});
  client({0x82, 8, 9, 10, 11, 12, 13, 14});  // the first segment was not received
  server({0xA2, 2, 2, 0, 0, 0, 0, 0});
  client({0xC1, 0, 0, 0, 0, 0, 0, 0});
  server({0xA1, 0, 0, 0, 0, 0, 0, 0});
  EXPECT_TRUE(told_.empty());
  client({0x40, 0x00, 0x10, 0x00, 0, 0, 0, 0});
  server({0x43, 0x00, 0x10, 0x00, 1, 0, 0, 0});
  EXPECT_EQ(told_.size(), 1U) << "the next transfer is followed";
}

TEST_F(SdoFollowerTest, AValueIsNotKnownWhoseServerConfirmsMoreThanABlock) {
  client({0xC0, 0x50, 0x1F, 0x01, 0, 0, 0, 0});
  server({0xA0, 0x50, 0x1F, 0x01, 127, 0, 0, 0});
  for (std::uint8_t number = 1; number <= 127; ++number) {
    client({number, 1, 2, 3, 4, 5, 6, 7});
  }
  server({0xA2, 200, 127, 0, 0, 0, 0, 0});
  client({0x81, 1, 2, 3, 4, 5, 6, 7});
  server({0xA2, 1, 127, 0, 0, 0, 0, 0});
  client({0xC1, 0, 0, 0, 0, 0, 0, 0});
  server({0xA1, 0, 0, 0, 0, 0, 0, 0});
  EXPECT_TRUE(told_.empty());
}

TEST_F(SdoFollowerTest, ABlockUploadMayBeAnsweredExpedited) {
  client({0xA4, 0x00, 0x10, 0x00, 127, 10, 0, 0});
  server({0x43, 0x00, 0x10, 0x00, 1, 2, 3, 4});
  ASSERT_EQ(told_.size(), 1U);
  EXPECT_EQ(value(told_[0]), (std::vector<int>{1, 2, 3, 4}));
}

TEST_F(SdoFollowerTest, AbortsOfEitherSide) {
  server({0x80, 0x18, 0x10, 0x01, 0x11, 0x00, 0x09, 0x06});
  EXPECT_TRUE(told_.empty()) << "no transfer was under way";
  client({0x40, 0x18, 0x10, 0x01, 0, 0, 0, 0});
  server({0x80, 0x18, 0x10, 0x01, 0x11, 0x00, 0x09, 0x06});
  client({0x21, 0x08, 0x10, 0x00, 9, 0, 0, 0});
  server({0x60, 0x08, 0x10, 0x00, 0, 0, 0, 0});
  client({0x80, 0x08, 0x10, 0x00, 0x00, 0x00, 0x04, 0x05});
  ASSERT_EQ(told_.size(), 2U);
  EXPECT_EQ(told_[0].abort, AbortCode::no_sub_index);
  EXPECT_EQ(told_[1].abort, AbortCode::timeout);
  EXPECT_TRUE(told_[1].download);
}

TEST_F(SdoFollowerTest, AnAbortWithCode0IsOneWithThatCode) {
  client({0x40, 0x18, 0x10, 0x01, 0, 0, 0, 0});
  server({0x80, 0x18, 0x10, 0x01, 0, 0, 0, 0});
  ASSERT_EQ(told_.size(), 1U);
  EXPECT_TRUE(told_[0].aborted);
  EXPECT_EQ(told_[0].abort, AbortCode::none);
  EXPECT_FALSE(told_[0].complete());
}

TEST_F(SdoFollowerTest, AnAnswerToAnotherObjectIsNone) {
  client({0x2B, 0x17, 0x10, 0x00, 0xE8, 0x03, 0, 0});
  server({0x60, 0x16, 0x10, 0x00, 0, 0, 0, 0});
  server({0x60, 0x17, 0x10, 0x00, 0, 0, 0, 0});
  EXPECT_TRUE(told_.empty());
}

TEST_F(SdoFollowerTest, WhatStandsStillIsForgotten) {
  client({0x40, 0x18, 0x10, 0x01, 0, 0, 0, 0});
  now_ += SdoFollower::kPatience + std::chrono::seconds(1);
  server({0x43, 0x18, 0x10, 0x01, 1, 0, 0, 0});
  EXPECT_TRUE(told_.empty());
}

}  // namespace
}  // namespace linegate::observer

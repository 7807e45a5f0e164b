// SPDX-License-Identifier: Apache-2.0
// USDO transfers of other nodes, frame by frame.
#include "stack/observer/usdo_follower.h"

#include <cstddef>
#include <cstdint>
#include <iterator>
#include <optional>
#include <random>
#include <vector>

#include <gtest/gtest.h>

namespace linegate::observer {
namespace {

using od::DataType;
using usdo::Command;
using usdo::Route;

constexpr std::uint8_t kClient = 1;
constexpr std::uint8_t kServer = 5;
constexpr std::uint8_t kSession = 9;
constexpr od::Address kObject{0x2000, 3};

class UsdoFollowerTest : public testing::Test {
 protected:
  static Route to_server(std::uint8_t client = kClient, std::uint8_t session = kSession) {
    return {can::kSdoRequestBase + client, kServer, session};
  }
  static Route to_client(std::uint8_t client = kClient, std::uint8_t session = kSession) {
    return {can::kSdoResponseBase + kServer, client, session};
  }
  static std::vector<std::byte> bytes(std::size_t count, unsigned from = 0) {
    std::vector<std::byte> out;
    for (std::size_t i = 0; i < count; ++i) {
      out.push_back(static_cast<std::byte>(from + i));
    }
    return out;
  }

  void hear(can::Frame frame) {
    frame.time = now_;
    const auto node = static_cast<std::uint8_t>(frame.id & 0x7FU);
    const bool request = frame.id >= can::kSdoRequestBase;
    if (const auto ended =
            request ? follower_.request(node, frame) : follower_.answer(node, frame)) {
      told_.push_back(*ended);
    }
  }
  // Without an answer.
  void write(od::Address object, std::uint8_t session = kSession) {
    hear(usdo::expedited_frame(to_server(kClient, session), Command::download, object,
                               DataType::unsigned8, bytes(1)));
  }
  // Of kObject at kServer.
  void expect_doubt() {
    const auto unanswered = follower_.pop_unanswered();
    ASSERT_TRUE(unanswered);
    EXPECT_EQ(unanswered->server, kServer);
    EXPECT_EQ(unanswered->object, kObject);
    EXPECT_FALSE(follower_.pop_unanswered());
  }
  void write_segments(std::size_t size, bool lose_one = false) {
    hear(usdo::initiate_frame(to_server(), Command::download_initiate, kObject, DataType::domain,
                              static_cast<std::uint32_t>(size)));
    hear(usdo::object_frame(to_client(), Command::initiate_response, kObject));
    const std::vector<std::byte> all = bytes(size);
    std::uint8_t counter = 0;
    std::size_t done = 0;
    for (; size - done > usdo::kSegmentData; done += usdo::kSegmentData) {
      if (!lose_one || counter != 1) {
        hear(usdo::segment_frame(to_server(), Command::download_segment, counter,
                                 std::span(all).subspan(done, usdo::kSegmentData)));
      }
      hear(usdo::counted_frame(to_client(), Command::segment_response, counter++));
    }
    hear(usdo::end_frame(to_server(), Command::download_end, std::span(all).subspan(done)));
    hear(usdo::plain_frame(to_client(), Command::end_response));
  }

  UsdoFollower follower_;
  Instant now_{std::chrono::seconds(1)};
  std::vector<UsdoTransfer> told_;
};

TEST_F(UsdoFollowerTest, ExpeditedDownload) {
  hear(usdo::expedited_frame(to_server(), Command::download, kObject, DataType::unsigned16,
                             bytes(2, 7)));
  EXPECT_TRUE(told_.empty()) << "the server has not confirmed it";
  hear(usdo::object_frame(to_client(), Command::download_response, kObject));
  ASSERT_EQ(told_.size(), 1U);
  EXPECT_EQ(told_[0].server, kServer);
  EXPECT_EQ(told_[0].client, kClient);
  EXPECT_EQ(told_[0].transfer.address, kObject);
  EXPECT_TRUE(told_[0].transfer.download);
  EXPECT_TRUE(std::ranges::equal(told_[0].transfer.kept(), bytes(2, 7)));
  EXPECT_FALSE(follower_.pop_unanswered());
}

TEST_F(UsdoFollowerTest, ExpeditedUploadOf56Bytes) {
  hear(usdo::object_frame(to_server(), Command::upload, kObject));
  hear(usdo::expedited_frame(to_client(), Command::upload_response, kObject,
                             DataType::visible_string, bytes(56)));
  ASSERT_EQ(told_.size(), 1U);
  EXPECT_FALSE(told_[0].transfer.download);
  EXPECT_TRUE(told_[0].transfer.complete());
  EXPECT_TRUE(std::ranges::equal(told_[0].transfer.kept(), bytes(56)));
}

TEST_F(UsdoFollowerTest, DownloadsInSegments) {
  for (const std::size_t size : {1U, 60U, 61U, 64U, 1000U, 60U * 300U}) {
    told_.clear();
    write_segments(size);
    ASSERT_EQ(told_.size(), 1U) << size;
    EXPECT_EQ(told_[0].transfer.size, size);
    EXPECT_EQ(told_[0].transfer.complete(), size <= Transfer::kKept);
    const std::size_t kept = std::min<std::size_t>(size, Transfer::kKept);
    EXPECT_TRUE(std::ranges::equal(told_[0].transfer.kept(), bytes(kept)));
  }
}

TEST_F(UsdoFollowerTest, UploadInSegments) {
  hear(usdo::object_frame(to_server(), Command::upload, kObject));
  hear(usdo::initiate_frame(to_client(), Command::upload_initiate, kObject, DataType::domain, 63));
  hear(usdo::counted_frame(to_server(), Command::upload_segment, 0));
  const can::Frame segment =
      usdo::segment_frame(to_client(), Command::upload_segment_answer, 0, bytes(60));
  hear(segment);
  hear(segment);  // repeated
  hear(usdo::counted_frame(to_server(), Command::upload_segment, 1));
  hear(usdo::end_frame(to_client(), Command::upload_end, bytes(3, 60)));
  ASSERT_EQ(told_.size(), 1U);
  EXPECT_TRUE(std::ranges::equal(told_[0].transfer.kept(), bytes(63)));
}

TEST_F(UsdoFollowerTest, ATransferWithoutOneOfItsFramesIsNotReported) {
  write_segments(200, true);
  hear(usdo::object_frame(to_client(), Command::download_response, kObject));
  hear(usdo::end_frame(to_client(), Command::upload_end, bytes(3)));
  hear(usdo::abort_frame(to_client(), kObject, AbortCode::read_only, usdo::AbortForm::one_byte));
  hear(usdo::initiate_frame(to_server(), Command::download_initiate, kObject, DataType::domain, 9));
  hear(usdo::end_frame(to_server(), Command::download_end, bytes(8)));  // one byte is missing
  hear(usdo::plain_frame(to_client(), Command::end_response));
  EXPECT_TRUE(told_.empty());
  write_segments(70);
  EXPECT_EQ(told_.size(), 1U);
}

TEST_F(UsdoFollowerTest, AbortsOfBothSidesInBothForms) {
  for (const auto form : {usdo::AbortForm::one_byte, usdo::AbortForm::four_bytes}) {
    for (const bool of_server : {true, false}) {
      told_.clear();
      hear(usdo::object_frame(to_server(), Command::upload, kObject));
      hear(usdo::abort_frame(of_server ? to_client() : to_server(), kObject, AbortCode::no_object,
                             form));
      ASSERT_EQ(told_.size(), 1U);
      EXPECT_TRUE(told_[0].transfer.aborted);
      EXPECT_EQ(told_[0].transfer.abort, AbortCode::no_object);
      EXPECT_EQ(told_[0].transfer.address, kObject);
    }
  }
}

TEST_F(UsdoFollowerTest, SessionsOfOneServerDoNotMix) {
  const auto request = [&](std::uint8_t client, std::uint8_t session, std::uint8_t sub) {
    hear(usdo::object_frame(to_server(client, session), Command::upload, {0x2000, sub}));
  };
  request(1, 1, 1);
  request(1, 2, 2);
  request(2, 1, 3);
  const auto answer = [&](std::uint8_t client, std::uint8_t session, std::uint8_t sub) {
    hear(usdo::expedited_frame(to_client(client, session), Command::upload_response, {0x2000, sub},
                               DataType::unsigned8, bytes(1, sub)));
  };
  answer(2, 1, 3);
  answer(1, 1, 1);
  answer(1, 2, 2);
  ASSERT_EQ(told_.size(), 3U);
  EXPECT_EQ(told_[0].client, 2);
  EXPECT_EQ(told_[0].transfer.address.sub, 3);
  EXPECT_EQ(told_[1].transfer.address.sub, 1);
  EXPECT_EQ(told_[2].transfer.data[0], std::byte{2});
}

TEST_F(UsdoFollowerTest, ManySessionsReplaceTheOldest) {
  for (unsigned i = 0; i <= UsdoFollower::kSessions; ++i) {
    now_ += std::chrono::microseconds(1);
    hear(usdo::object_frame(to_server(kClient, static_cast<std::uint8_t>(i + 1)), Command::upload,
                            kObject));
  }
  EXPECT_FALSE(follower_.object_of(kClient, kServer, 1));
  EXPECT_EQ(follower_.object_of(kClient, kServer, 2), kObject);
}

TEST_F(UsdoFollowerTest, AnAbandonedTransferIsNotContinued) {
  hear(usdo::object_frame(to_server(), Command::upload, kObject));
  now_ += UsdoFollower::kPatience + std::chrono::milliseconds(1);
  hear(usdo::expedited_frame(to_client(), Command::upload_response, kObject, DataType::unsigned8,
                             bytes(1)));
  EXPECT_TRUE(told_.empty());
}

// A master may use a session-ID again after a time-out: the answer to the request before is late.
TEST_F(UsdoFollowerTest, ALateAnswerToTheWriteBeforeHasNoEffect) {
  constexpr od::Address kNext{0x2000, 4};
  const can::Frame late_answers[] = {
      usdo::object_frame(to_client(), Command::download_response, kObject),
      usdo::abort_frame(to_client(), kObject, AbortCode::read_only, usdo::AbortForm::one_byte),
      usdo::abort_frame(to_client(), kObject, AbortCode::read_only, usdo::AbortForm::four_bytes)};
  for (const can::Frame& late : late_answers) {
    for (const bool refused : {false, true}) {
      told_.clear();
      write(kObject);
      write(kNext);
      hear(late);
      EXPECT_TRUE(told_.empty());
      hear(refused ? usdo::abort_frame(to_client(), kNext, AbortCode::read_only,
                                       usdo::AbortForm::one_byte)
                   : usdo::object_frame(to_client(), Command::download_response, kNext));
      ASSERT_EQ(told_.size(), 1U);
      EXPECT_EQ(told_[0].transfer.address, kNext);
      EXPECT_EQ(told_[0].transfer.aborted, refused);
    }
  }
}

TEST_F(UsdoFollowerTest, ALateAnswerToTheReadBeforeHasNoEffect) {
  constexpr od::Address kNext{0x2000, 4};
  hear(usdo::object_frame(to_server(), Command::upload, kObject));
  hear(usdo::object_frame(to_server(), Command::upload, kNext));
  hear(usdo::expedited_frame(to_client(), Command::upload_response, kObject, DataType::unsigned8,
                             bytes(1, 7)));
  hear(usdo::initiate_frame(to_client(), Command::upload_initiate, kObject, DataType::domain, 3));
  hear(usdo::end_frame(to_client(), Command::upload_end, bytes(3)));
  EXPECT_TRUE(told_.empty());
  hear(usdo::expedited_frame(to_client(), Command::upload_response, kNext, DataType::unsigned8,
                             bytes(1, 8)));
  ASSERT_EQ(told_.size(), 1U);
  EXPECT_EQ(told_[0].transfer.address, kNext);
  EXPECT_EQ(told_[0].transfer.data[0], std::byte{8});
}

TEST_F(UsdoFollowerTest, OnlyTheAnswerOfItsKindEndsADownload) {
  hear(usdo::initiate_frame(to_server(), Command::download_initiate, kObject, DataType::domain, 3));
  hear(usdo::object_frame(to_client(), Command::initiate_response, kObject));
  hear(usdo::end_frame(to_server(), Command::download_end, bytes(3)));
  hear(usdo::object_frame(to_client(), Command::download_response, kObject));
  EXPECT_TRUE(told_.empty());
  hear(usdo::plain_frame(to_client(), Command::end_response));
  ASSERT_EQ(told_.size(), 1U);
  write(kObject);
  hear(usdo::plain_frame(to_client(), Command::end_response));
  EXPECT_EQ(told_.size(), 1U);
  hear(usdo::object_frame(to_client(), Command::download_response, kObject));
  EXPECT_EQ(told_.size(), 2U);
}

// A server that has lost the session has no object to name.
TEST_F(UsdoFollowerTest, AnAbortWithoutAnObjectEndsTheTransfer) {
  write(kObject);
  hear(usdo::abort_frame(to_client(), {}, AbortCode::general, usdo::AbortForm::four_bytes));
  ASSERT_EQ(told_.size(), 1U);
  EXPECT_EQ(told_[0].transfer.address, kObject);
  EXPECT_TRUE(told_[0].transfer.aborted);
}

TEST_F(UsdoFollowerTest, AFrameThatIsIgnoredDoesNotExtendTheTransfer) {
  hear(usdo::object_frame(to_server(), Command::upload, kObject));
  now_ += UsdoFollower::kPatience - std::chrono::seconds(1);
  hear(usdo::expedited_frame(to_client(), Command::upload_response, {0x2000, 4},
                             DataType::unsigned8, bytes(1)));
  now_ += std::chrono::seconds(2);
  hear(usdo::expedited_frame(to_client(), Command::upload_response, kObject, DataType::unsigned8,
                             bytes(1)));
  EXPECT_TRUE(told_.empty());
}

TEST_F(UsdoFollowerTest, AWriteWithoutAnAnswerIsInDoubt) {
  write(kObject);
  hear(usdo::object_frame(to_server(), Command::upload, {0x1000, 0}));
  expect_doubt();
}

// Clients use another session-ID for each transfer.
TEST_F(UsdoFollowerTest, ARequestForTheSameObjectShowsThatAWriteIsInDoubt) {
  write(kObject, 1);
  hear(usdo::object_frame(to_server(kClient + 1, 2), Command::upload, kObject));
  hear(usdo::object_frame(to_server(kClient, 3), Command::upload, {0x1000, 0}));
  EXPECT_FALSE(follower_.pop_unanswered());
  hear(usdo::object_frame(to_server(kClient, 4), Command::upload, kObject));
  expect_doubt();
  hear(usdo::object_frame(to_server(kClient, 5), Command::upload, kObject));
  EXPECT_FALSE(follower_.pop_unanswered()) << "it was reported";
  hear(usdo::object_frame(to_client(kClient, 1), Command::download_response, kObject));
  EXPECT_EQ(told_.size(), 1U) << "the answer was late";
}

TEST_F(UsdoFollowerTest, AWriteThatTimedOutIsInDoubt) {
  write(kObject);
  now_ += UsdoFollower::kPatience + std::chrono::milliseconds(1);
  hear(usdo::object_frame(to_server(kClient + 1, 4), Command::upload, {0x1000, 0}));
  expect_doubt();
}

TEST_F(UsdoFollowerTest, ManyWritesAreInDoubtAtATime) {
  for (std::uint8_t i = 1; i <= UsdoFollower::kSessions; ++i) {
    write({0x2000, i}, i);
  }
  now_ += UsdoFollower::kPatience + std::chrono::milliseconds(1);
  hear(usdo::object_frame(to_server(), Command::upload, {0x1000, 0}));
  std::size_t count = 0;
  while (follower_.pop_unanswered()) {
    ++count;
  }
  EXPECT_EQ(count, UsdoFollower::kSessions);
}

TEST_F(UsdoFollowerTest, AWriteWhosePlaceAnotherTransferNeedsIsInDoubt) {
  write(kObject, 1);
  for (unsigned i = 0; i < UsdoFollower::kSessions; ++i) {
    now_ += std::chrono::microseconds(1);
    EXPECT_FALSE(follower_.pop_unanswered());
    hear(usdo::object_frame(to_server(kClient, static_cast<std::uint8_t>(i + 2)), Command::upload,
                            {0x1000, 0}));
  }
  expect_doubt();
}

// What a client sends that got no answer in time, and a server that gives no reason.
TEST_F(UsdoFollowerTest, AWriteThatTheClientAbortedIsInDoubt) {
  for (const auto form : {usdo::AbortForm::one_byte, usdo::AbortForm::four_bytes}) {
    write(kObject);
    hear(usdo::abort_frame(to_server(), kObject, AbortCode::timeout, form));
    expect_doubt();
  }
  write(kObject);
  hear(usdo::abort_frame(to_client(), kObject, usdo::Code::cannot_transfer,
                         usdo::AbortForm::one_byte));
  expect_doubt();
}

TEST_F(UsdoFollowerTest, AWriteThatTheServerRefusedIsNotInDoubt) {
  write(kObject);
  hear(usdo::abort_frame(to_client(), kObject, AbortCode::read_only, usdo::AbortForm::one_byte));
  EXPECT_FALSE(follower_.pop_unanswered());
  hear(usdo::initiate_frame(to_server(), Command::download_initiate, kObject, DataType::domain, 3));
  hear(usdo::abort_frame(to_server(), kObject, AbortCode::timeout, usdo::AbortForm::one_byte));
  EXPECT_FALSE(follower_.pop_unanswered()) << "it did not have all of its data";
}

TEST_F(UsdoFollowerTest, OtherFramesHaveNoEffect) {
  hear(can::make_frame(0x601, {5, 0x11, 9, 3, 0, 0x20, 0, 0}));  // classical
  can::Frame frame = usdo::object_frame(to_server(), Command::upload, kObject);
  frame.length = 5;
  hear(frame);
  frame.length = 0;
  hear(frame);
  frame = usdo::object_frame(to_server(), Command{0x55}, kObject);
  hear(frame);
  EXPECT_TRUE(told_.empty());
  EXPECT_FALSE(follower_.object_of(kClient, kServer, kSession));
}

// A value that is reported as complete has no more bytes than are kept.
TEST_F(UsdoFollowerTest, HostileFramesDoNoHarm) {
  std::mt19937 random(7);
  constexpr std::uint8_t kCommands[] = {0x01, 0x02, 0x03, 0x04, 0x11, 0x13, 0x21, 0x22, 0x23,
                                        0x24, 0x31, 0x32, 0x33, 0x34, 0x7F, 0x80, 0x55};
  for (int i = 0; i < 300'000; ++i) {
    can::Frame frame;
    frame.id = random() % 2 == 0 ? can::kSdoRequestBase : can::kSdoResponseBase;
    frame.id += 1 + static_cast<std::uint32_t>(random() % 3);
    frame.flags = can::Frame::kFd;
    frame.length = can::fd_length(random() % 65);
    for (std::size_t at = 0; at < frame.length; ++at) {
      frame.data[at] = static_cast<std::byte>(random() % 4 == 0 ? random() : random() % 4);
    }
    frame.data[1] = std::byte{kCommands[random() % std::size(kCommands)]};
    now_ += std::chrono::microseconds(random() % 100'000);
    hear(frame);
    (void)follower_.pop_unanswered();
  }
  EXPECT_FALSE(told_.empty());
  for (const UsdoTransfer& each : told_) {
    ASSERT_TRUE(!each.transfer.complete() || each.transfer.size <= Transfer::kKept);
  }
}

}  // namespace
}  // namespace linegate::observer

// SPDX-License-Identifier: Apache-2.0
#include "bridges/dds/request_tracker.h"

#include <optional>
#include <string>

#include <gtest/gtest.h>

#include "bridges/dds/command_samples.h"

#include "tests/dds/known_values.h"

namespace linegate::dds {
namespace {

using std::chrono::milliseconds;

constexpr Instant kStart{milliseconds(1'000)};

// Writers of two participants.
constexpr WriterGuid kGateway{1, 15, 1};
constexpr WriterGuid kStranger{1, 15, 2};

Request request_with(std::size_t data = 0) {
  Request request;
  request.target = {"g", "l", 0};
  request.id = 7;
  request.deadline = kStart + milliseconds(10'000);
  request.data = known::pattern(data, 1);
  return request;
}

v1::CommandReply reply(const std::vector<std::byte>& data, std::size_t offset) {
  v1::CommandReply sample;
  sample.gateway("g");
  sample.line("l");
  sample.id(7);
  set_chunk(data, offset, sample);
  return sample;
}

class Tracker : public testing::Test {
 protected:
  Tracker() { publishers.note("g", "l", kGateway, kStart); }

  std::optional<RequestTracker::Done> take(const v1::CommandReply& sample, Instant now,
                                           const WriterGuid& sender = kGateway) {
    return tracker.take(sample, participant_of(sender), publishers, now);
  }
  std::optional<RequestTracker::Done> disputed() {
    return tracker.disputed(publishers, [](const ParticipantPrefix& it) {
      return it == participant_of(kGateway) ? std::string("cabinet") : std::string();
    });
  }
  // The times at which the request is sent, in ms after kStart, up to `until`.
  std::vector<long> sent_at(long until) {
    std::vector<long> times;
    for (long ms = 0; ms <= until; ms += 50) {
      while (tracker.due(kStart + milliseconds(ms)) != nullptr)
        times.push_back(ms);
    }
    return times;
  }

  LinePublishers publishers;
  RequestTracker tracker{milliseconds(100)};
};

TEST_F(Tracker, WhatStaysUnansweredIsSentAgainEverMoreSlowly) {
  tracker.add(request_with(), kStart);
  EXPECT_EQ(sent_at(3'000), (std::vector<long>{0, 100, 300, 700, 1'500}));
}

// Each repetition sends all chunks of the request over the network.
TEST_F(Tracker, ALongRequestIsSentAgainMoreAndMoreSeldom) {
  tracker.add(request_with(20'000), kStart);
  EXPECT_EQ(sent_at(9'000), (std::vector<long>{0, 100, 300, 700, 1'500, 3'100, 6'300}));
}

TEST_F(Tracker, AnAnswerEndsIt) {
  tracker.add(request_with(), kStart);
  tracker.due(kStart);
  const auto done = take(reply(known::pattern(20, 2), 0), kStart);
  ASSERT_TRUE(done);
  EXPECT_EQ(done->result.id, 7U);
  EXPECT_TRUE(done->result.reply.ok());
  EXPECT_EQ(done->result.reply.bytes(), known::pattern(20, 2));
  EXPECT_TRUE(tracker.empty());
  EXPECT_EQ(tracker.next_wake(), kNever);
}

TEST_F(Tracker, AnotherParticipantSendsWhatNoGatewayCanCarryOutTwice) {
  const auto add = [&](std::uint64_t id, const line::Request& what) {
    Request request = request_with();
    request.id = id;
    request.request = what;
    request.participant = 1;
    tracker.add(request, kStart);
  };
  add(7, line::SdoWrite{.node = 1});
  add(8, line::SdoRead{.node = 1});
  (void)sent_at(0);
  add(9, line::SdoWrite{.node = 1});
  tracker.move(1, 2);
  EXPECT_EQ(tracker.participant_of(7), 1U) << "it was sent";
  EXPECT_EQ(tracker.participant_of(8), 2U) << "it only reads";
  EXPECT_EQ(tracker.participant_of(9), 2U) << "it was not sent yet";
  EXPECT_EQ(tracker.participant_of(10), 0U);
  EXPECT_TRUE(tracker.has_requests_of(1));
  tracker.cancel(7);
  EXPECT_FALSE(tracker.has_requests_of(1));
}

TEST_F(Tracker, ALongAnswerIsFetchedInRounds) {
  const auto data = known::pattern(100'000, 2);
  tracker.add(request_with(), kStart);
  tracker.due(kStart);
  for (std::size_t chunk = 0; chunk < 8; ++chunk) {
    EXPECT_EQ(tracker.due(kStart), nullptr);
    EXPECT_FALSE(take(reply(data, chunk * 8'192), kStart));
  }
  ASSERT_NE(tracker.due(kStart), nullptr);
  EXPECT_EQ(tracker.reply_offset(7), 65'536U);
  for (std::size_t offset = 65'536; offset + 8'192 < data.size(); offset += 8'192) {
    EXPECT_FALSE(take(reply(data, offset), kStart));
  }
  const auto done = take(reply(data, 98'304), kStart);
  ASSERT_TRUE(done);
  EXPECT_EQ(done->result.reply.bytes(), data);
}

TEST_F(Tracker, ChunksOutOfPlaceDoNotSpoilTheAnswer) {
  const auto data = known::pattern(20'000, 2);
  tracker.add(request_with(), kStart);
  tracker.due(kStart);
  EXPECT_FALSE(take(reply(data, 8'192), kStart));
  EXPECT_FALSE(take(reply(data, 0), kStart));
  EXPECT_FALSE(take(reply(data, 0), kStart));
  EXPECT_FALSE(take(reply(data, 16'384), kStart));
  EXPECT_FALSE(take(reply(data, 8'192), kStart));
  const auto done = take(reply(data, 16'384), kStart);
  ASSERT_TRUE(done);
  EXPECT_EQ(done->result.reply.bytes(), data);
}

TEST_F(Tracker, AnswersToOthersAreNotTaken) {
  tracker.add(request_with(), kStart);
  v1::CommandReply other = reply({}, 0);
  other.line("m");
  EXPECT_FALSE(take(other, kStart));
  other = reply({}, 0);
  other.gateway("h");
  EXPECT_FALSE(take(other, kStart));
  other = reply({}, 0);
  other.id(8);
  EXPECT_FALSE(take(other, kStart));
  EXPECT_TRUE(take(reply({}, 0), kStart));
}

TEST_F(Tracker, AReplyOfAnotherParticipantIsCountedAndIgnored) {
  tracker.add(request_with(), kStart);
  tracker.due(kStart);
  EXPECT_FALSE(take(reply(known::pattern(20, 3), 0), kStart, kStranger));
  EXPECT_EQ(tracker.foreign(), 1U);
  EXPECT_EQ(tracker.next_wake(), kStart + milliseconds(100)) << "it delays and hastens nothing";
  const auto done = take(reply(known::pattern(20, 2), 0), kStart);
  ASSERT_TRUE(done);
  EXPECT_EQ(done->result.reply.bytes(), known::pattern(20, 2));
  EXPECT_EQ(tracker.foreign(), 1U);
}

TEST_F(Tracker, AForeignChunkDoesNotSpoilALongAnswer) {
  const auto data = known::pattern(10'000, 2);
  tracker.add(request_with(), kStart);
  tracker.due(kStart);
  EXPECT_FALSE(take(reply(data, 0), kStart));
  EXPECT_FALSE(take(reply(known::pattern(10'000, 3), 8'192), kStart, kStranger));
  const auto done = take(reply(data, 8'192), kStart);
  ASSERT_TRUE(done);
  EXPECT_EQ(done->result.reply.bytes(), data);
}

TEST_F(Tracker, ATimeOutReportsForeignReplies) {
  tracker.add(request_with(), kStart);
  take(reply({}, 0), kStart, kStranger);
  const auto done = tracker.expired(kStart + milliseconds(10'000));
  ASSERT_TRUE(done);
  EXPECT_EQ(done->result.reply.error, line::to_error(line::Refusal::timed_out));
  EXPECT_NE(done->result.text.find("; 1 replies of participants"), std::string::npos)
      << done->result.text;
}

TEST_F(Tracker, AReplyBeforeTheFirstStateOfItsLineIsRequestedAgain) {
  publishers = {};
  tracker.add(request_with(), kStart);
  tracker.due(kStart);
  EXPECT_FALSE(take(reply({}, 0), kStart));
  EXPECT_EQ(tracker.foreign(), 0U);
  EXPECT_EQ(tracker.next_wake(), kStart + milliseconds(25));
  publishers.note("g", "l", kGateway, kStart);
  EXPECT_TRUE(take(reply({}, 0), kStart));
}

TEST_F(Tracker, TheReplyOfAGatewayThatStartedAgainIsTakenOnceTheEarlierOneIsSilent) {
  tracker.add(request_with(), kStart);
  publishers.note("g", "l", kStranger, kStart + milliseconds(500));
  EXPECT_FALSE(take(reply({}, 0), kStart + milliseconds(500), kStranger));
  EXPECT_EQ(tracker.foreign(), 0U);
  EXPECT_TRUE(take(reply({}, 0), kStart + milliseconds(2'000), kStranger));
}

TEST_F(Tracker, TwoPublishersAreAnErrorThatNamesBoth) {
  tracker.add(request_with(), kStart);
  EXPECT_FALSE(disputed());
  publishers.note("g", "l", kStranger, kStart);
  EXPECT_FALSE(disputed());
  publishers.note("g", "l", kGateway, kStart);
  EXPECT_FALSE(take(reply({}, 0), kStart, kStranger));
  EXPECT_FALSE(take(reply({}, 0), kStart, kGateway));
  EXPECT_EQ(tracker.foreign(), 2U);
  const auto done = disputed();
  ASSERT_TRUE(done);
  EXPECT_EQ(done->result.reply.error, line::to_error(line::Refusal::not_permitted));
  EXPECT_NE(
      done->result.text.find(": " + to_string(participant_of(kGateway)) + " at cabinet, " +
                             to_string(participant_of(kStranger)) + " at an unknown host; end"),
      std::string::npos)
      << done->result.text;
  EXPECT_TRUE(tracker.empty());
}

TEST_F(Tracker, ARequestThatWasSentBeforeTheDisputeMayHaveBeenCarriedOut) {
  tracker.add(request_with(), kStart);
  publishers.note("g", "l", kGateway, kStart);
  ASSERT_NE(tracker.due(kStart), nullptr);
  publishers.note("g", "l", kStranger, kStart);
  publishers.note("g", "l", kGateway, kStart);
  const auto done = disputed();
  ASSERT_TRUE(done);
  EXPECT_EQ(done->result.reply.error, line::to_error(line::Refusal::timed_out));
  EXPECT_NE(done->result.text.find("may have been carried out"), std::string::npos);
}

TEST_F(Tracker, ItTimesOut) {
  tracker.add(request_with(), kStart);
  EXPECT_FALSE(tracker.expired(kStart + milliseconds(9'999)));
  const auto done = tracker.expired(kStart + milliseconds(10'000));
  ASSERT_TRUE(done);
  EXPECT_EQ(done->result.reply.error, line::to_error(line::Refusal::timed_out));
  EXPECT_TRUE(tracker.empty());
}

TEST_F(Tracker, ARequestThatLostAChunkIsSentAgain) {
  tracker.add(request_with(20'000), kStart);
  tracker.due(kStart);
  v1::CommandReply refusal = reply({}, 0);
  refusal.domain(v1::RESULT_REFUSED);
  refusal.code(v1::REFUSAL_BAD_REQUEST);
  EXPECT_FALSE(take(refusal, kStart));
  EXPECT_EQ(sent_at(100), std::vector<long>{100});
}

TEST_F(Tracker, AShortRequestIsRefusedAtOnce) {
  tracker.add(request_with(20), kStart);
  v1::CommandReply refusal = reply({}, 0);
  refusal.domain(v1::RESULT_REFUSED);
  refusal.code(v1::REFUSAL_BAD_REQUEST);
  refusal.text("why");
  const auto done = take(refusal, kStart);
  ASSERT_TRUE(done);
  EXPECT_EQ(done->result.reply.error, line::to_error(line::Refusal::bad_request));
  EXPECT_EQ(done->result.text, "why");
}

// --- requests that write ------------------------------------------------------------------------

Request write_with(std::uint64_t id) {
  Request request = request_with();
  request.id = id;
  request.target.incarnation = 3;
  request.request = line::Request{line::SdoWrite{}};
  return request;
}

v1::CommandReply refusal_with(std::uint32_t code) {
  v1::CommandReply sample = reply({}, 0);
  sample.domain(v1::RESULT_REFUSED);
  sample.code(code);
  return sample;
}

TEST_F(Tracker, AWriteThatAnotherStartOfTheGatewayRefusesMayHaveBeenCarriedOut) {
  for (const auto code : {v1::REFUSAL_WRONG_INCARNATION, v1::REFUSAL_UNKNOWN_LINE}) {
    tracker.add(write_with(7), kStart);
    ASSERT_NE(tracker.due(kStart), nullptr);
    ASSERT_NE(tracker.due(kStart + milliseconds(100)), nullptr);
    const auto done = take(refusal_with(code), kStart + milliseconds(110));
    ASSERT_TRUE(done);
    EXPECT_EQ(done->result.reply.error, line::to_error(line::Refusal::timed_out));
    EXPECT_NE(done->result.text.find("may have been carried out"), std::string::npos);
  }
}

TEST_F(Tracker, AWriteThatIsRefusedTheFirstTimeWasNotCarriedOut) {
  tracker.add(write_with(7), kStart);
  ASSERT_NE(tracker.due(kStart), nullptr);
  const auto done = take(refusal_with(v1::REFUSAL_WRONG_INCARNATION), kStart);
  ASSERT_TRUE(done);
  EXPECT_EQ(done->result.reply.error, line::to_error(line::Refusal::wrong_incarnation));
}

TEST_F(Tracker, AWriteWithoutAnswerMayHaveBeenCarriedOut) {
  tracker.add(write_with(7), kStart);
  ASSERT_NE(tracker.due(kStart), nullptr);
  auto done = tracker.expired(kStart + milliseconds(10'000));
  ASSERT_TRUE(done);
  EXPECT_NE(done->result.text.find("may have been carried out"), std::string::npos);
  tracker.add(write_with(8), kStart);
  done = tracker.expired(kStart + milliseconds(10'000));
  ASSERT_TRUE(done);
  EXPECT_EQ(done->result.text.find("may have been"), std::string::npos) << "it was never sent";
}

// Then the gateway may not know it any more, and would carry it out again.
TEST_F(Tracker, AWriteIsNotRepeatedBehindManyOthers) {
  constexpr std::uint64_t kBefore = 100;
  constexpr std::uint64_t kId = 1'000;
  for (std::uint64_t id = 1; id <= kBefore; ++id)
    tracker.add(write_with(id), kStart);
  for (std::uint64_t id = 1; id <= kBefore; ++id)
    ASSERT_NE(tracker.due(kStart), nullptr);
  tracker.add(write_with(kId), kStart);
  ASSERT_NE(tracker.due(kStart), nullptr);
  for (std::uint64_t id = 1; id <= kBefore; ++id)
    tracker.cancel(id);
  for (std::uint64_t since = 1; since + kBefore < RequestTracker::kMostOthers; ++since) {
    tracker.add(write_with(kId + since), kStart);
    ASSERT_NE(tracker.due(kStart), nullptr);
    tracker.cancel(kId + since);
  }
  ASSERT_NE(tracker.due(kStart + milliseconds(100)), nullptr) << "the gateway certainly knows it";
  tracker.add(write_with(2 * kId), kStart);
  ASSERT_NE(tracker.due(kStart), nullptr);
  tracker.cancel(2 * kId);
  EXPECT_EQ(sent_at(9'000), std::vector<long>{});
  EXPECT_TRUE(tracker.expired(kStart + milliseconds(10'000)));
}

// --- requests that are carried out once -------------------------------------------------------

Request once_with(std::uint64_t id, std::size_t data = 0) {
  Request request = request_with(data);
  request.id = id;
  request.once = true;
  request.deadline = kStart + milliseconds(2'000);
  return request;
}

// The gateway counts its time-out from the reception: DDS may have kept the sample meanwhile.
TEST_F(Tracker, EachRepetitionHasTheTimeThatIsLeft) {
  Request request = once_with(7);
  const Duration left = RequestTracker::gateway_timeout(request, kStart + milliseconds(500));
  EXPECT_EQ(left, milliseconds(1'500) - kSampleLifetime);
  request.timeout = milliseconds(300);
  EXPECT_EQ(RequestTracker::gateway_timeout(request, kStart), milliseconds(300));
  request.once = false;
  EXPECT_EQ(RequestTracker::gateway_timeout(request, kStart + milliseconds(1'900)),
            milliseconds(300));
}

TEST_F(Tracker, ItIsNotSentWhenTooLittleTimeIsLeft) {
  tracker.add(once_with(7), kStart);
  EXPECT_EQ(sent_at(1'950), (std::vector<long>{0, 100, 300, 700, 1'500}));
  tracker.add(once_with(8), kStart + milliseconds(1'800));
  EXPECT_EQ(tracker.due(kStart + milliseconds(1'800)), nullptr);
  EXPECT_EQ(tracker.next_wake(), kStart + milliseconds(2'000)) << "it times out";
  EXPECT_TRUE(tracker.expired(kStart + milliseconds(2'000)));
}

// Then the gateway may not know it any more, and would carry it out again.
TEST_F(Tracker, ItIsNotRepeatedAfterManyOthers) {
  tracker.add(once_with(1), kStart);
  ASSERT_NE(tracker.due(kStart), nullptr);
  for (std::uint64_t id = 2; id <= RequestTracker::kMostSince; ++id) {
    tracker.add(once_with(id), kStart);
    ASSERT_NE(tracker.due(kStart), nullptr);
    tracker.cancel(id);
  }
  ASSERT_NE(tracker.due(kStart + milliseconds(100)), nullptr) << "the gateway certainly knows it";
  tracker.add(once_with(500), kStart);
  ASSERT_NE(tracker.due(kStart), nullptr);
  tracker.cancel(500);
  EXPECT_EQ(sent_at(1'700), std::vector<long>{});
  Request other = once_with(600);
  other.target.line = "m";
  tracker.add(std::move(other), kStart);
  EXPECT_EQ(sent_at(150), (std::vector<long>{0, 100})) << "another line keeps other answers";
}

// The gateway carries out nothing to answer that.
TEST_F(Tracker, TheRestOfItsAnswerIsRequestedNevertheless) {
  const auto data = known::pattern(20'000, 2);
  tracker.add(once_with(7), kStart);
  ASSERT_NE(tracker.due(kStart), nullptr);
  EXPECT_FALSE(take(reply(data, 0), kStart));
  EXPECT_EQ(tracker.due(kStart + milliseconds(50)), nullptr);
  EXPECT_NE(tracker.due(kStart + milliseconds(1'900)), nullptr);
  EXPECT_EQ(tracker.reply_offset(7), 8'192U);
}

}  // namespace
}  // namespace linegate::dds

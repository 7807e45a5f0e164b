// SPDX-License-Identifier: Apache-2.0
#include "stack/lss/master.h"

#include <gtest/gtest.h>

#include "tests/stack/lss/slaves.h"

namespace linegate::lss {
namespace {

using namespace std::chrono_literals;
using testing::Bytes;
using testing::bytes_of;
using Frames = std::vector<Bytes>;

class LssMaster : public ::testing::Test {
 protected:
  // The frames that it sends for a request, all at `when`.
  Frames send(const Request& request, Duration when = 0ms) {
    EXPECT_TRUE(master.start(request));
    Frames out;
    can::Frame frame;
    while (master.next_frame(frame, Instant{when})) {
      EXPECT_EQ(frame.id, 0x7E5U);
      EXPECT_EQ(frame.flags, 0);
      out.push_back(bytes_of(frame));
    }
    return out;
  }
  bool hear(const Bytes& bytes) { return master.receive(testing::frame_of(kSlaveId, bytes)); }
  // The outcome after that response, when the time for further responses has passed.
  Answer answered(const Bytes& bytes) {
    EXPECT_TRUE(hear(bytes));
    master.advance(Instant{kDefaultTimeout / kSettleShare});
    const auto answer = master.take();
    EXPECT_TRUE(answer);
    return answer.value_or(Answer{});
  }

  Master master;
};

TEST_F(LssMaster, SwitchStateGlobalIsNotAnswered) {
  EXPECT_EQ(send({.service = Service::switch_global, .configuration = true}),
            (Frames{{0x04, 1, 0, 0, 0, 0, 0, 0}}));
  EXPECT_EQ(master.take()->outcome, Outcome::done);
  EXPECT_EQ(send({.service = Service::switch_global}), (Frames{{0x04, 0, 0, 0, 0, 0, 0, 0}}));
  EXPECT_EQ(master.next_wake(), kNever);
}

TEST_F(LssMaster, SwitchStateSelective) {
  EXPECT_EQ(send({.service = Service::switch_selective, .address = testing::kAddress}),
            (Frames{{0x40, 0x11, 0x22, 0x33, 0x44, 0, 0, 0},
                    {0x41, 0x55, 0x66, 0x77, 0x88, 0, 0, 0},
                    {0x42, 0x99, 0xAA, 0xBB, 0xCC, 0, 0, 0},
                    {0x43, 0xED, 0xFE, 0x0F, 0x10, 0, 0, 0}}));
  EXPECT_EQ(answered({0x44, 0, 0, 0, 0, 0, 0, 0}).outcome, Outcome::done);
}

TEST_F(LssMaster, ConfigureNodeId) {
  EXPECT_EQ(send({.service = Service::configure_node_id, .node_id = 9}),
            (Frames{{0x11, 9, 0, 0, 0, 0, 0, 0}}));
  EXPECT_EQ(answered({0x11, 0, 0, 0, 0, 0, 0, 0}).outcome, Outcome::done);
  send({.service = Service::configure_node_id, .node_id = 9});
  const Answer refused = answered({0x11, 0xFF, 7, 0, 0, 0, 0, 0});
  EXPECT_EQ(refused.outcome, Outcome::refused);
  EXPECT_EQ(refused.error, 0xFF);
  EXPECT_EQ(refused.specific, 7);
}

TEST_F(LssMaster, ConfigureBitTiming) {
  EXPECT_EQ(send({.service = Service::configure_bit_timing, .table = 0, .index = 3}),
            (Frames{{0x13, 0, 3, 0, 0, 0, 0, 0}}));
  EXPECT_EQ(answered({0x13, 1, 0, 0, 0, 0, 0, 0}).outcome, Outcome::refused);
}

TEST_F(LssMaster, ActivateBitTimingIsNotAnswered) {
  EXPECT_EQ(send({.service = Service::activate_bit_timing, .delay_ms = 300}),
            (Frames{{0x15, 0x2C, 0x01, 0, 0, 0, 0, 0}}));
  EXPECT_EQ(master.take()->outcome, Outcome::done);
}

TEST_F(LssMaster, Store) {
  EXPECT_EQ(send({.service = Service::store}), (Frames{{0x17, 0, 0, 0, 0, 0, 0, 0}}));
  const Answer failed = answered({0x17, 2, 0, 0, 0, 0, 0, 0});
  EXPECT_EQ(failed.outcome, Outcome::refused);
  EXPECT_EQ(failed.error, kMediumFailed);
}

TEST_F(LssMaster, Inquire) {
  for (int part = 0; part < kParts; ++part) {
    EXPECT_EQ(send({.service = Service::inquire_part, .part = static_cast<Part>(part)}),
              (Frames{{0x5A + part, 0, 0, 0, 0, 0, 0, 0}}));
    EXPECT_EQ(answered({0x5A + part, 1, 2, 3, 4, 0, 0, 0}).value, 0x04030201U);
  }
  EXPECT_EQ(send({.service = Service::inquire_node_id}), (Frames{{0x5E, 0, 0, 0, 0, 0, 0, 0}}));
  EXPECT_EQ(answered({0x5E, 0xFF, 1, 0, 0, 0, 0, 0}).value, 0xFFU);
}

TEST_F(LssMaster, IdentifyRemoteSlaves) {
  EXPECT_EQ(send({.service = Service::identify,
                  .address = testing::kAddress,
                  .highest_revision = 0xFFFFFFFE,
                  .highest_serial = 0x7FFFFFFF}),
            (Frames{{0x46, 0x11, 0x22, 0x33, 0x44, 0, 0, 0},
                    {0x47, 0x55, 0x66, 0x77, 0x88, 0, 0, 0},
                    {0x48, 0x99, 0xAA, 0xBB, 0xCC, 0, 0, 0},
                    {0x49, 0xFE, 0xFF, 0xFF, 0xFF, 0, 0, 0},
                    {0x4A, 0xED, 0xFE, 0x0F, 0x10, 0, 0, 0},
                    {0x4B, 0xFF, 0xFF, 0xFF, 0x7F, 0, 0, 0}}));
  EXPECT_EQ(answered({0x4F, 0, 0, 0, 0, 0, 0, 0}).outcome, Outcome::done);
}

TEST_F(LssMaster, IdentifyNonConfigured) {
  EXPECT_EQ(send({.service = Service::identify_unconfigured}),
            (Frames{{0x4C, 0, 0, 0, 0, 0, 0, 0}}));
  EXPECT_EQ(answered({0x50, 0, 0, 0, 0, 0, 0, 0}).outcome, Outcome::done);
}

TEST_F(LssMaster, NoAnswerIsAResultAfterOneHundredMilliseconds) {
  send({.service = Service::switch_selective}, 50ms);
  EXPECT_FALSE(master.start({}));
  EXPECT_EQ(master.next_wake(), Instant{150ms});
  master.advance(Instant{149ms});
  EXPECT_FALSE(master.take());
  master.advance(Instant{150ms});
  EXPECT_EQ(master.take()->outcome, Outcome::no_answer);
  EXPECT_EQ(master.next_wake(), kNever);
  EXPECT_TRUE(hear({0x44, 0, 0, 0, 0, 0, 0, 0}));
  EXPECT_FALSE(master.take()) << "the response is too late";
  EXPECT_EQ(master.unexpected(), 1U);
}

TEST_F(LssMaster, TheTimeOutCanRunFromTheAcknowledgementOnTheBus) {
  ASSERT_TRUE(master.start({.service = Service::inquire_node_id}));
  can::Frame frame;
  ASSERT_TRUE(master.next_frame(frame, Instant{1s}, true));
  master.advance(Instant{20s});
  EXPECT_EQ(master.next_wake(), kNever);
  EXPECT_TRUE(master.busy());
  master.sent(Instant{20s});
  master.sent(Instant{30s});
  EXPECT_EQ(master.next_wake(), Instant{20s + kDefaultTimeout});
  master.advance(master.next_wake());
  EXPECT_EQ(master.take()->outcome, Outcome::no_answer);
}

TEST_F(LssMaster, AnAnswerBeforeTheLastFrameIsOutIsNone) {
  EXPECT_TRUE(master.start({.service = Service::switch_selective}));
  EXPECT_TRUE(hear({0x44, 0, 0, 0, 0, 0, 0, 0}));
  EXPECT_FALSE(master.take());
  EXPECT_TRUE(master.busy());
}

TEST_F(LssMaster, TwoAnswersToWhatOneDeviceAnswersAreCounted) {
  send({.service = Service::switch_selective});
  answered({0x44, 0, 0, 0, 0, 0, 0, 0});
  EXPECT_EQ(master.doubled(), 0U);
  send({.service = Service::inquire_node_id});
  EXPECT_TRUE(hear({0x44, 0, 0, 0, 0, 0, 0, 0}));
  EXPECT_EQ(master.doubled(), 1U);
  answered({0x5E, 5, 0, 0, 0, 0, 0, 0});
  EXPECT_TRUE(hear({0x5E, 5, 0, 0, 0, 0, 0, 0}));
  EXPECT_EQ(master.doubled(), 2U);
  send({.service = Service::identify_unconfigured});
  answered({0x50, 0, 0, 0, 0, 0, 0, 0});
  EXPECT_TRUE(hear({0x50, 0, 0, 0, 0, 0, 0, 0}));
  EXPECT_EQ(master.doubled(), 2U) << "several slaves may be unconfigured";
}

TEST_F(LssMaster, ASlowerDeviceDoesNotAnswerTheNextQuestion) {
  const Bytes here{0x4F, 0, 0, 0, 0, 0, 0, 0};
  send({.service = Service::question, .message = {.command = Command::fastscan}});
  EXPECT_TRUE(hear(here));
  EXPECT_FALSE(master.take()) << "other slaves may respond, too";
  EXPECT_EQ(master.next_wake(), Instant{10ms});
  EXPECT_TRUE(hear(here));
  master.advance(Instant{9ms});
  EXPECT_TRUE(master.busy());
  master.advance(Instant{10ms});
  EXPECT_EQ(master.take()->outcome, Outcome::done);
  EXPECT_EQ(master.unexpected(), 0U);
  send({.service = Service::question, .message = {.command = Command::fastscan}}, 10ms);
  master.advance(Instant{110ms});
  EXPECT_EQ(master.take()->outcome, Outcome::no_answer);
}

TEST_F(LssMaster, MalformedFramesAreCountedAndHarmless) {
  send({.service = Service::store});
  EXPECT_FALSE(hear({}));
  EXPECT_FALSE(hear({0x17, 0, 0, 0, 0, 0, 0}));
  EXPECT_FALSE(hear({0x18, 0, 0, 0, 0, 0, 0, 0}));
  EXPECT_FALSE(hear({0x51, 0, 0, 0, 0, 0, 0, 0}));
  EXPECT_EQ(master.malformed(), 4U);
  EXPECT_FALSE(master.take());
  EXPECT_EQ(answered({0x17, 0, 0, 0, 0, 0, 0, 0}).outcome, Outcome::done);
}

TEST_F(LssMaster, WhatIsCancelledHasNoAnswer) {
  EXPECT_TRUE(master.start({.service = Service::identify}));
  master.cancel();
  EXPECT_FALSE(master.wants_to_send());
  EXPECT_FALSE(master.busy());
  EXPECT_FALSE(master.take());
}

}  // namespace
}  // namespace linegate::lss

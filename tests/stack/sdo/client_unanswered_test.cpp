// SPDX-License-Identifier: Apache-2.0
// A request that timed out before it was sent is answered later: the response does not belong to
// the next request.
#include "stack/sdo/requests_under_way.h"

#include "tests/stack/sdo/client_fixture.h"

namespace linegate::sdo::test {
namespace {

class UnansweredTest : public ClientTest {
 protected:
  UnansweredTest() { client.follow(under_way, kNode); }

  // Hands the frames out to a controller, like drain().
  Frames hand_out() {
    const Frames out = drain(queue, kRequestId);
    for (std::size_t i = 0; i < out.size(); ++i) {
      under_way.handed_out(frame(kRequestId, out[i], now), ++number);
    }
    return out;
  }
  void acknowledge_all() { under_way.ended(number); }
  void begin(unsigned size) { client.write(kObject, pattern(size), kTimeout, now, queue); }
  void pass(Duration time) {
    const Instant until = now + time;
    while (client.next_wake() <= until) {
      now = client.next_wake();
      client.advance(now, queue);
    }
    now = until;
  }
  // A write of one byte times out, and one of two bytes to the same object begins.
  void stall() {
    begin(1);
    EXPECT_EQ(hand_out(), Frames{kFirst});
    pass(kTimeout);
    expect_abort(AbortCode::timeout);
    begin(2);
    EXPECT_EQ(hand_out(), Frames{kGivenUp});
  }
  void hear(const Bytes& data, Receipt expected) {
    EXPECT_EQ(client.receive(frame(kResponseId, data, now), queue), expected);
  }

  static constexpr std::uint8_t kNode = kRequestId & 0x7F;
  static constexpr od::Address kObject{0x2000, 5};
  const Bytes kFirst{0x2F, 0x00, 0x20, 5, 1, 0, 0, 0};
  const Bytes kSecond{0x2B, 0x00, 0x20, 5, 1, 2, 0, 0};
  const Bytes kTaken{0x60, 0x00, 0x20, 5, 0, 0, 0, 0};
  const Bytes kGivenUp = abort_bytes(0x2000, 5, 0x0504'0000);

  RequestsUnderWay under_way;
  std::uint64_t number = 0;
};

TEST_F(UnansweredTest, TheNextRequestWaitsForTheAnswer) {
  stall();
  acknowledge_all();
  pass(50ms);
  EXPECT_EQ(hand_out(), Frames{});
  hear(kTaken, Receipt::stray);
  EXPECT_EQ(hand_out(), Frames{kSecond});
  EXPECT_FALSE(client.take());
  EXPECT_EQ(client.next_wake(), now + kTimeout);
  hear(kTaken, Receipt::used);
  expect_data({});
}

TEST_F(UnansweredTest, TheAnswerMayComeBeforeTheAcknowledgement) {
  stall();
  hear(kTaken, Receipt::stray);
  EXPECT_EQ(hand_out(), Frames{});
  acknowledge_all();
  pass(10ms);
  EXPECT_EQ(hand_out(), Frames{kSecond});
  hear(kTaken, Receipt::used);
  expect_data({});
}

TEST_F(UnansweredTest, TheAnswerMayComeBeforeTheNextTransfer) {
  begin(1);
  hand_out();
  pass(kTimeout);
  expect_abort(AbortCode::timeout);
  hand_out();
  acknowledge_all();
  hear(kTaken, Receipt::stray);
  EXPECT_EQ(client.next_wake(), kNever);
  begin(2);
  EXPECT_EQ(hand_out(), Frames{kSecond});
}

TEST_F(UnansweredTest, ANodeThatDoesNotAnswerIsWaitedForAsLongAsItsTimeOut) {
  stall();
  acknowledge_all();
  pass(10ms + kTimeout - 1ns);
  EXPECT_EQ(hand_out(), Frames{});
  pass(1ns);
  EXPECT_EQ(hand_out(), Frames{kSecond});
  acknowledge_all();
  pass(kTimeout);
  expect_abort(AbortCode::timeout);
  begin(1);
  EXPECT_EQ(hand_out(), (Frames{kGivenUp, kFirst})) << "the second request was on the bus";
}

TEST_F(UnansweredTest, WhatWaitsTimesOutAndIsNeverSent) {
  stall();
  pass(kTimeout);
  expect_abort(AbortCode::timeout);
  EXPECT_EQ(hand_out(), Frames{});
  acknowledge_all();
  hear(kTaken, Receipt::stray);
  EXPECT_EQ(hand_out(), Frames{});
  begin(1);
  EXPECT_EQ(hand_out(), Frames{kFirst});
}

TEST_F(UnansweredTest, WhatWaitsIsCancelledWithoutAnAbort) {
  stall();
  client.abort(AbortCode::general, now, queue);
  expect_abort(AbortCode::general);
  acknowledge_all();
  pass(kTimeout + 10ms);
  EXPECT_EQ(hand_out(), Frames{});
}

TEST_F(UnansweredTest, WhatWaitsEndsWithANewConfiguration) {
  stall();
  client.configure(can::CobId{kRequestId});
  expect_abort(AbortCode::sdo_connection);
  begin(2);
  EXPECT_EQ(hand_out(), Frames{kSecond});
  hear(kTaken, Receipt::used);
  expect_data({});
}

// The segments that replace a block transfer wait, too: a response 60h may belong to either
// transfer.
TEST_F(UnansweredTest, SegmentsAfterABlockWait) {
  begin(200);
  EXPECT_EQ(hand_out(), (Frames{{0xC6, 0x00, 0x20, 5, 200, 0, 0, 0}}));
  pass(kTimeout);
  EXPECT_EQ(hand_out(), Frames{kGivenUp});
  acknowledge_all();
  pass(10ms);
  hear({0xA4, 0x00, 0x20, 5, 127, 0, 0, 0}, Receipt::stray);
  EXPECT_EQ(hand_out(), (Frames{{0x21, 0x00, 0x20, 5, 200, 0, 0, 0}}));
}

// A request that times out in the transmit queue: without acknowledgements it is unknown when it is
// on the bus.
TEST_F(UnansweredTest, WithoutAcknowledgementsARequestInTheQueueIsWaitedFor) {
  begin(1);
  pass(kTimeout);
  expect_abort(AbortCode::timeout);
  begin(2);
  EXPECT_EQ(drain(queue, kRequestId), (Frames{kFirst, kGivenUp}));
  hear(kTaken, Receipt::stray);
  EXPECT_EQ(drain(queue, kRequestId), Frames{kSecond});
}

TEST_F(UnansweredTest, WithoutAcknowledgementsWhatWasHandedOutIsOnTheBus) {
  begin(1);
  EXPECT_EQ(drain(queue, kRequestId), Frames{kFirst});
  under_way.handed_out(frame(kRequestId, kFirst, now), 0);
  pass(kTimeout);
  expect_abort(AbortCode::timeout);
  begin(2);
  EXPECT_EQ(drain(queue, kRequestId), (Frames{kGivenUp, kSecond}));
}

TEST_F(UnansweredTest, ARequestToAnotherNodeIsNoneToThis) {
  begin(1);
  hand_out();
  acknowledge_all();
  under_way.handed_out(frame(kRequestId + 1, kFirst, now), ++number);
  pass(kTimeout);
  expect_abort(AbortCode::timeout);
  begin(2);
  EXPECT_EQ(hand_out(), (Frames{kGivenUp, kSecond}));
}

}  // namespace
}  // namespace linegate::sdo::test

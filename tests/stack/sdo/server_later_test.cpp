// SPDX-License-Identifier: Apache-2.0
// The server when a hook of the object completes later (split indication).
#include "stack/sdo/block.h"

#include "tests/stack/sdo/block_frames.h"
#include "tests/stack/sdo/server_fixture.h"

namespace linegate::sdo::test {
namespace {

// Completes later for sub-indices from 2 on.
class Slow : public od::Hook {
 public:
  AbortCode before_read(od::Address address, const od::Variable&) override {
    return address.sub >= 2 ? od::kLater : AbortCode::none;
  }
  AbortCode check_write(od::Address address, std::span<const std::byte>) override {
    return address.sub >= 2 ? od::kLater : AbortCode::none;
  }
  void put_off(od::Address, od::Ticket number) override { ticket = number; }
  void cancelled(od::Ticket number) override { given_up = number; }

  od::Ticket ticket = 0;
  od::Ticket given_up = 0;
};

class LaterServerTest : public ServerTest {
 protected:
  LaterServerTest() { EXPECT_TRUE(dictionary.set_hook(0x2000, &slow)); }

  // The frame that the server sends without a request; empty if none.
  Bytes later() {
    server.advance(now, queue);
    const std::vector<Bytes> answers = drain(queue, kResponseId);
    EXPECT_LE(answers.size(), 1U);
    return answers.empty() ? Bytes{} : answers.front();
  }

  Slow slow;
};

TEST_F(LaterServerTest, ExpeditedUploadIsAnsweredWhenTheHookHasTheValue) {
  EXPECT_EQ(ask({0x40, 0x00, 0x20, 2, 0, 0, 0, 0}), Bytes{});
  EXPECT_TRUE(server.busy());
  now += 5s;
  EXPECT_EQ(later(), Bytes{});
  EXPECT_GT(server.next_wake(), now);
  ASSERT_TRUE(dictionary.set({0x2000, 2}, 0xABCD));
  ASSERT_TRUE(dictionary.complete(slow.ticket, AbortCode::none));
  EXPECT_LE(server.next_wake(), now);
  EXPECT_EQ(later(), (Bytes{0x4B, 0x00, 0x20, 2, 0xCD, 0xAB, 0, 0}));
  EXPECT_FALSE(server.busy());
  EXPECT_EQ(server.next_wake(), kNever);
  EXPECT_EQ(server.counters().uploads, 1U);
  EXPECT_EQ(later(), Bytes{});
}

TEST_F(LaterServerTest, SegmentedUploadBeginsWhenTheHookHasTheValue) {
  EXPECT_EQ(ask({0x40, 0x00, 0x20, 5, 0, 0, 0, 0}), Bytes{});
  ASSERT_TRUE(dictionary.complete(slow.ticket, AbortCode::none));
  EXPECT_EQ(later(), (Bytes{0x41, 0x00, 0x20, 5, 8, 0, 0, 0}));
  EXPECT_EQ(ask({0x60, 0, 0, 0, 0, 0, 0, 0}).front(), 0x00);
  EXPECT_EQ(ask({0x70, 0, 0, 0, 0, 0, 0, 0}).front(), 0x1D);
  EXPECT_EQ(server.counters().uploads, 1U);
}

TEST_F(LaterServerTest, ExpeditedDownloadIsAnsweredAndStoredThen) {
  const Bytes before = value({0x2000, 2});
  EXPECT_EQ(ask({0x2B, 0x00, 0x20, 2, 0xA1, 0xA2, 0, 0}), Bytes{});
  EXPECT_EQ(value({0x2000, 2}), before);
  ASSERT_TRUE(dictionary.complete(slow.ticket, AbortCode::none));
  EXPECT_EQ(later(), (Bytes{0x60, 0x00, 0x20, 2, 0, 0, 0, 0}));
  EXPECT_EQ(value({0x2000, 2}), (Bytes{0xA1, 0xA2}));
  EXPECT_EQ(server.counters().downloads, 1U);
}

TEST_F(LaterServerTest, SegmentedDownloadIsAnsweredAndStoredThen) {
  ask({0x21, 0x00, 0x20, 5, 8, 0, 0, 0});
  EXPECT_EQ(ask({0x00, 1, 2, 3, 4, 5, 6, 7}), (Bytes{0x20, 0, 0, 0, 0, 0, 0, 0}));
  EXPECT_EQ(ask({0x1D, 8, 0, 0, 0, 0, 0, 0}), Bytes{});
  ASSERT_TRUE(dictionary.complete(slow.ticket, AbortCode::none));
  EXPECT_EQ(later(), (Bytes{0x30, 0, 0, 0, 0, 0, 0, 0}));
  EXPECT_EQ(value({0x2000, 5}), (Bytes{1, 2, 3, 4, 5, 6, 7, 8}));
}

TEST_F(LaterServerTest, BlockUploadBeginsWhenTheHookHasTheValue) {
  EXPECT_EQ(ask({0xA4, 0x00, 0x20, 5, 127, 0, 0, 0}), Bytes{});
  ASSERT_TRUE(dictionary.complete(slow.ticket, AbortCode::none));
  EXPECT_EQ(later(), (Bytes{0xC6, 0x00, 0x20, 5, 8, 0, 0, 0}));
  server.receive(frame(kRequestId, {0xA3, 0, 0, 0, 0, 0, 0, 0}, now), queue);
  EXPECT_EQ(drain(queue, kResponseId).size(), 2U);
}

TEST_F(LaterServerTest, BlockUploadOfAFewBytesIsAnsweredExpeditedThen) {
  EXPECT_EQ(ask({0xA4, 0x00, 0x20, 2, 127, 4, 0, 0}), Bytes{});
  ASSERT_TRUE(dictionary.complete(slow.ticket, AbortCode::none));
  EXPECT_EQ(later(), (Bytes{0x4B, 0x00, 0x20, 2, 0x21, 0x22, 0, 0}));
}

TEST_F(LaterServerTest, BlockDownloadIsConfirmedAndStoredThen) {
  const auto sent = pattern(8);
  ask({0xC6, 0x00, 0x20, 5, 8, 0, 0, 0});
  ask({0x01, 1, 2, 3, 4, 5, 6, 7});
  EXPECT_EQ(ask({0x82, 8, 0, 0, 0, 0, 0, 0}), block_ack(2, 127));
  const Bytes end = end_request(sent, crc_of(sent));
  EXPECT_EQ(ask(end), Bytes{});
  EXPECT_EQ(ask(end), Bytes{}) << "a repeated frame";
  EXPECT_EQ(slow.given_up, 0U);
  ASSERT_TRUE(dictionary.complete(slow.ticket, AbortCode::none));
  EXPECT_EQ(later(), (Bytes{0xA1, 0, 0, 0, 0, 0, 0, 0}));
  EXPECT_EQ(value({0x2000, 5}), numbers(sent));
  EXPECT_EQ(server.counters().downloads, 1U);
}

TEST_F(LaterServerTest, TheLateAnswerMayBeARefusal) {
  const Bytes before = value({0x2000, 2});
  ask({0x2B, 0x00, 0x20, 2, 0xA1, 0xA2, 0, 0});
  ASSERT_TRUE(dictionary.complete(slow.ticket, AbortCode::hardware));
  EXPECT_EQ(later(), abort_bytes(0x2000, 2, 0x0606'0000));
  EXPECT_EQ(value({0x2000, 2}), before);
  ask({0x40, 0x00, 0x20, 2, 0, 0, 0, 0});
  ASSERT_TRUE(dictionary.complete(slow.ticket, AbortCode::no_data));
  EXPECT_EQ(later(), abort_bytes(0x2000, 2, 0x0800'0024));
  EXPECT_EQ(server.counters().aborts, 2U);
  EXPECT_FALSE(server.busy());
}

TEST_F(LaterServerTest, AHookThatNeverAnswersIsGivenUp) {
  ask({0x40, 0x00, 0x20, 2, 0, 0, 0, 0});
  const Instant end = now + ServerOptions{}.answer_timeout;
  EXPECT_EQ(server.next_wake(), end);
  now = end - 1ms;
  EXPECT_EQ(later(), Bytes{});
  now = end;
  EXPECT_EQ(later(), abort_bytes(0x2000, 2, 0x0504'0000));
  EXPECT_EQ(slow.given_up, slow.ticket);
  EXPECT_FALSE(dictionary.complete(slow.ticket, AbortCode::none));
  EXPECT_EQ(later(), Bytes{});
}

TEST_F(LaterServerTest, AnAbortOfTheClientEndsTheWaiting) {
  const Bytes before = value({0x2000, 2});
  ask({0x2B, 0x00, 0x20, 2, 0xA1, 0xA2, 0, 0});
  EXPECT_EQ(ask(abort_bytes(0x2000, 2, 0x0504'0000)), Bytes{});
  EXPECT_EQ(slow.given_up, slow.ticket);
  EXPECT_FALSE(dictionary.complete(slow.ticket, AbortCode::none));
  EXPECT_EQ(later(), Bytes{});
  EXPECT_EQ(value({0x2000, 2}), before);
  EXPECT_EQ(server.counters().aborts, 1U);
}

TEST_F(LaterServerTest, ANewInitiateEndsTheWaiting) {
  ask({0x2B, 0x00, 0x20, 2, 0xA1, 0xA2, 0, 0});
  EXPECT_EQ(ask({0x40, 0x00, 0x20, 1, 0, 0, 0, 0}), (Bytes{0x4F, 0x00, 0x20, 1, 0x11, 0, 0, 0}));
  EXPECT_EQ(slow.given_up, slow.ticket);
  EXPECT_EQ(later(), Bytes{});
}

// The completion of a hook for the previous request must not answer the new request.
TEST_F(LaterServerTest, ALateAnswerToTheRequestBeforeIsNone) {
  ask({0x2B, 0x00, 0x20, 2, 0xA1, 0xA2, 0, 0});
  const od::Ticket old = slow.ticket;
  ask({0x2B, 0x00, 0x20, 2, 0xB1, 0xB2, 0, 0});
  EXPECT_FALSE(dictionary.complete(old, AbortCode::none));
  EXPECT_EQ(later(), Bytes{});
  EXPECT_TRUE(dictionary.complete(slow.ticket, AbortCode::none));
  EXPECT_EQ(later(), (Bytes{0x60, 0x00, 0x20, 2, 0, 0, 0, 0}));
  EXPECT_EQ(value({0x2000, 2}), (Bytes{0xB1, 0xB2}));
}

TEST_F(LaterServerTest, ASegmentWhileTheServerWaitsIsRefused) {
  ask({0x40, 0x00, 0x20, 5, 0, 0, 0, 0});
  EXPECT_EQ(ask({0x60, 0, 0, 0, 0, 0, 0, 0}), abort_bytes(0x2000, 5, 0x0504'0001));
  EXPECT_EQ(slow.given_up, slow.ticket);
}

TEST_F(LaterServerTest, AResetEndsTheWaiting) {
  ask({0x40, 0x00, 0x20, 5, 0, 0, 0, 0});
  server.reset();
  EXPECT_EQ(slow.given_up, slow.ticket);
  EXPECT_EQ(server.next_wake(), kNever);
}

TEST_F(LaterServerTest, OtherServersGoOn) {
  Server other(dictionary, can::CobId{0x640}, can::CobId{0x5C0}, events);
  ask({0x40, 0x00, 0x20, 2, 0, 0, 0, 0});
  const od::Ticket first = slow.ticket;
  other.receive(frame(0x640, {0x40, 0x00, 0x20, 1, 0, 0, 0, 0}, now), queue);
  EXPECT_EQ(drain(queue, 0x5C0).size(), 1U);
  other.receive(frame(0x640, {0x40, 0x00, 0x20, 2, 0, 0, 0, 0}, now), queue);
  ASSERT_TRUE(dictionary.complete(slow.ticket, AbortCode::none));
  other.advance(now, queue);
  EXPECT_EQ(drain(queue, 0x5C0).size(), 1U);
  EXPECT_EQ(later(), Bytes{});
  ASSERT_TRUE(dictionary.complete(first, AbortCode::none));
  EXPECT_EQ(later().front(), 0x4B);
}

}  // namespace
}  // namespace linegate::sdo::test

// SPDX-License-Identifier: Apache-2.0
#include "stack/usdo/client.h"

#include "tests/stack/usdo/support.h"

namespace linegate::usdo::test {
namespace {

using sdo::Receipt;

class UsdoClientTest : public testing::Test {
 protected:
  static constexpr Duration kTimeout = 500ms;
  static constexpr od::Address kDomain{0x2100, 0};

  std::vector<Bytes> read(od::Address address, sdo::TransferOptions options = {}) {
    client.read(address, kTimeout, now, queue, options);
    return drain_fd(queue, kRequestId);
  }
  std::vector<Bytes> write(od::Address address, const std::vector<std::byte>& data,
                           sdo::TransferOptions options = {}) {
    client.write(address, data, kTimeout, now, queue, options);
    return drain_fd(queue, kRequestId);
  }
  // The request that follows one answer; empty if there is none.
  Bytes answer(const Bytes& data, Receipt expected = Receipt::used) {
    EXPECT_EQ(client.receive(fd_frame(kResponseId, data, now), queue), expected);
    const std::vector<Bytes> requests = drain_fd(queue, kRequestId);
    EXPECT_LE(requests.size(), 1U);
    return requests.empty() ? Bytes{} : requests.front();
  }
  void expect_data(const Bytes& data) {
    const std::optional<sdo::Outcome> outcome = client.take();
    ASSERT_TRUE(outcome);
    EXPECT_EQ(outcome->abort, AbortCode::none);
    EXPECT_EQ(numbers(outcome->data), data);
    EXPECT_EQ(client.next_wake(), kNever);
  }
  void expect_abort(AbortCode code, bool refused = false) {
    const std::optional<sdo::Outcome> outcome = client.take();
    ASSERT_TRUE(outcome);
    EXPECT_EQ(outcome->abort, code);
    EXPECT_EQ(outcome->refused, refused);
    EXPECT_FALSE(client.busy());
  }

  can::TransmitQueue queue{4};
  Client client{kClient, kServer};
  Instant now = at(1s);
};

TEST_F(UsdoClientTest, ThePublishedExample) {
  EXPECT_EQ(read({0x1000, 0}), (std::vector<Bytes>{{0x05, 0x11, 0x01, 0x00, 0x00, 0x10}}));
  EXPECT_EQ(answer({0x01, 0x31, 0x01, 0x00, 0x00, 0x10, 0x07, 0x04, 0x91, 0x01, 0x0F, 0x00}),
            Bytes{});
  expect_data({0x91, 0x01, 0x0F, 0x00});
}

TEST_F(UsdoClientTest, ExpeditedDownloadsHaveATypeByTheirLength) {
  const std::pair<std::size_t, std::uint8_t> rows[] = {{0, 0x0F}, {1, 5},    {2, 6},    {3, 0x0F},
                                                       {4, 7},    {8, 0x1B}, {56, 0x0F}};
  std::uint8_t session = 0;
  for (const auto& [size, type] : rows) {
    ++session;
    const Bytes head{5, 0x01, session, 1, 0, 0x20, type, static_cast<std::uint8_t>(size)};
    EXPECT_EQ(write({0x2000, 1}, pattern(size)),
              std::vector<Bytes>{padded(head, numbers_from(0, size))});
    EXPECT_EQ(answer({1, 0x21, session, 1, 0, 0x20}), Bytes{});
    expect_data({});
  }
}

TEST_F(UsdoClientTest, SegmentedDownload) {
  EXPECT_EQ(write(kDomain, pattern(122)),
            (std::vector<Bytes>{{5, 0x02, 1, 0, 0, 0x21, 0x0F, 0, 122, 0, 0, 0}}));
  EXPECT_EQ(answer({1, 0x22, 1, 0, 0, 0x21}), padded({5, 0x03, 1, 0}, numbers_from(0, 60)));
  EXPECT_EQ(answer({1, 0x23, 1, 0}), padded({5, 0x03, 1, 1}, numbers_from(60, 60)));
  EXPECT_EQ(answer({1, 0x23, 1, 1}), padded({5, 0x04, 1, 2}, numbers_from(120, 2)));
  EXPECT_EQ(answer({1, 0x24, 1}), Bytes{});
  expect_data({});
}

TEST_F(UsdoClientTest, SegmentedUpload) {
  read(kDomain);
  EXPECT_EQ(answer({1, 0x32, 1, 0, 0, 0x21, 0x0F, 0, 62, 0, 0, 0}), (Bytes{5, 0x13, 1, 0}));
  EXPECT_EQ(answer(padded({1, 0x33, 1, 0}, numbers_from(0, 60))), (Bytes{5, 0x13, 1, 1}));
  EXPECT_EQ(answer(padded({1, 0x34, 1, 2}, numbers_from(60, 2))), Bytes{});
  expect_data(numbers_from(0, 62));
}

TEST_F(UsdoClientTest, EveryTransferHasANewSession) {
  for (unsigned i = 1; i <= 300; ++i) {
    const auto session = static_cast<std::uint8_t>((i - 1) % 255 + 1);
    EXPECT_EQ(read({0x1001, 0}).front().at(2), session);
    answer({1, 0x31, session, 0, 1, 0x10, 5, 1, 0});
    expect_data({0});
  }
}

TEST_F(UsdoClientTest, TimeOutIsPerFrame) {
  read(kDomain);
  now += 400ms;
  answer({1, 0x32, 1, 0, 0, 0x21, 0x0F, 0, 62, 0, 0, 0});
  EXPECT_EQ(client.next_wake(), now + kTimeout);
  now += kTimeout;
  client.advance(now, queue);
  EXPECT_EQ(drain_fd(queue, kRequestId), (std::vector<Bytes>{{5, 0x7F, 1, 0, 0, 0x21, 0x60}}));
  expect_abort(AbortCode::timeout);
}

TEST_F(UsdoClientTest, LateAnswersAreStrays) {
  read({0x1000, 0});
  now += kTimeout;
  client.advance(now, queue);
  client.take();
  drain_fd(queue, kRequestId);
  answer({1, 0x31, 1, 0, 0, 0x10, 7, 4, 1, 2, 3, 4}, Receipt::stray);
  EXPECT_EQ(read({0x1000, 0}).front().at(2), 2);
  answer({1, 0x31, 1, 0, 0, 0x10, 7, 4, 1, 2, 3, 4}, Receipt::stray);
  answer({1, 0x31, 2, 0, 0, 0x10, 7, 4, 5, 6, 7, 8});
  expect_data({5, 6, 7, 8});
}

TEST_F(UsdoClientTest, AnswersToOtherClientsAndFramesThatAreNotUsdo) {
  read({0x1000, 0});
  answer({2, 0x31, 1, 0, 0, 0x10, 7, 4, 1, 2, 3, 4}, Receipt::elsewhere);
  answer({1, 0x31}, Receipt::malformed);
  EXPECT_EQ(client.receive(can::make_frame(kResponseId, {1, 0x31, 1, 0, 0, 0x10, 7, 4}), queue),
            Receipt::malformed);
  EXPECT_TRUE(client.busy());
}

TEST_F(UsdoClientTest, AbortsOfTheServerInBothForms) {
  read({0x1000, 0});
  EXPECT_EQ(answer({1, 0x7F, 1, 0, 0, 0x10, 0x34}), Bytes{});
  expect_abort(AbortCode::no_sub_index, true);
  read({0x1000, 0});
  EXPECT_EQ(answer({1, 0x80, 2, 0, 0, 0x10, 0x31, 0, 9, 6}), Bytes{});
  expect_abort(AbortCode::value_too_high, true);
}

TEST_F(UsdoClientTest, WrongAnswersToAnInitiate) {
  const std::pair<Bytes, std::uint8_t> rows[] = {
      {{1, 0x21, 0, 0, 0, 0x10}, 0x13},                       // of a download
      {{1, 0x31, 0, 1, 0, 0x10, 7, 4, 1, 2, 3, 4}, 0x60},     // another object
      {{1, 0x31, 0, 0, 0, 0x10, 7, 5, 1, 2, 3, 4}, 0x15},     // more bytes than the frame has
      {{1, 0x31, 0, 0, 0, 0x10}, 0x15},                       // no length
      {{1, 0x99, 0, 0, 0, 0x10, 7, 4, 1, 2, 3, 4}, 0x13},     // unknown
      {{1, 0x34, 0, 4, 1, 2, 3, 4}, 0x13},                    // not begun
      {{1, 0x32, 0, 0, 0, 0x10, 7, 0, 0, 0, 0, 0x40}, 0x60},  // absurd size
  };
  std::uint8_t session = 0;
  for (auto [response, code] : rows) {
    read({0x1000, 0});
    response[2] = ++session;
    EXPECT_EQ(answer(response), (Bytes{5, 0x7F, session, 0, 0, 0x10, code})) << int{session};
    EXPECT_TRUE(client.take());
  }
}

TEST_F(UsdoClientTest, WrongAnswersToASegment) {
  const std::pair<Bytes, std::uint8_t> rows[] = {
      {padded({1, 0x33, 0, 1}, numbers_from(0, 60)), 0x14},  // counter
      {{1, 0x33, 0, 0, 1, 2, 3}, 0x15},                      // less than a segment
      {{1, 0x34, 0, 9, 1, 2, 3}, 0x15},                      // more bytes than the frame has
      {{1, 0x34, 0, 3, 1, 2, 3}, 0x38},                      // fewer than announced
      {{1, 0x23, 0, 0}, 0x13},
  };
  std::uint8_t session = 0;
  for (auto [response, code] : rows) {
    read(kDomain);
    ++session;
    answer({1, 0x32, session, 0, 0, 0x21, 0x0F, 0, 62, 0, 0, 0});
    response[2] = session;
    EXPECT_EQ(answer(response), (Bytes{5, 0x7F, session, 0, 0, 0x21, code})) << int{session};
    EXPECT_TRUE(client.take());
  }
  read(kDomain);
  ++session;
  answer({1, 0x32, session, 0, 0, 0x21, 0x0F, 0, 62, 0, 0, 0});
  answer(padded({1, 0x33, session, 0}, numbers_from(0, 60)));
  EXPECT_EQ(answer({1, 0x34, session, 3, 1, 2, 3}), (Bytes{5, 0x7F, session, 0, 0, 0x21, 0x37}));
}

TEST_F(UsdoClientTest, RepeatsWhereItIsAskedTo) {
  read({0x1000, 0}, {.repeats = 1});
  now += kTimeout;
  client.advance(now, queue);
  EXPECT_EQ(drain_fd(queue, kRequestId),
            (std::vector<Bytes>{{5, 0x7F, 1, 0, 0, 0x10, 0x60}, {5, 0x11, 2, 0, 0, 0x10}}));
  now += kTimeout;
  client.advance(now, queue);
  drain_fd(queue, kRequestId);
  expect_abort(AbortCode::timeout);
}

TEST_F(UsdoClientTest, ADownloadIsNotRepeatedAfterItsEnd) {
  write(kDomain, pattern(57), {.repeats = 1});
  EXPECT_EQ(answer({1, 0x22, 1, 0, 0, 0x21}), padded({5, 0x04, 1, 57}, numbers_from(0, 57)));
  now += kTimeout;
  client.advance(now, queue);
  drain_fd(queue, kRequestId);
  expect_abort(AbortCode::timeout);
}

TEST_F(UsdoClientTest, ASegmentThatTheServerDoesNotKnowIsALoss) {
  write(kDomain, pattern(61), {.repeats = 1});
  answer({1, 0x22, 1, 0, 0, 0x21});
  EXPECT_EQ(answer({1, 0x7F, 1, 0, 0, 0x21, 0x21}),
            (Bytes{5, 0x02, 2, 0, 0, 0x21, 0x0F, 0, 61, 0, 0, 0}));
  answer({1, 0x22, 2, 0, 0, 0x21});
  EXPECT_EQ(answer({1, 0x7F, 2, 0, 0, 0x21, 0x21}), Bytes{});
  expect_abort(AbortCode::sdo_connection, true);
}

// The server has not stored the value, whatever the reason is. While the result is unknown it sends
// no abort.
TEST_F(UsdoClientTest, AnAbortAfterAllOfADownloadIsARefusal) {
  write(kDomain, pattern(57), {.repeats = 1});
  answer({1, 0x22, 1, 0, 0, 0x21});
  EXPECT_EQ(answer({1, 0x7F, 1, 0, 0, 0x21, 0x60}), Bytes{});
  expect_abort(AbortCode::cannot_transfer, true);
  write(kDomain, pattern(57));
  answer({1, 0x22, 2, 0, 0, 0x21});
  EXPECT_EQ(answer({1, 0x7F, 2, 0, 0, 0x21, 0x36}), Bytes{});
  expect_abort(AbortCode::length_mismatch, true);
  write({0x2000, 1}, pattern(1), {.repeats = 1});
  EXPECT_EQ(answer({1, 0x7F, 3, 1, 0, 0x20, 0x60}), Bytes{});
  expect_abort(AbortCode::cannot_transfer, true);
}

TEST_F(UsdoClientTest, AReadIsAbortedAsSoonAsItIsLongerThanPermitted) {
  read(kDomain, {.longest = 120});
  EXPECT_EQ(answer({1, 0x32, 1, 0, 0, 0x21, 0x0F, 0, 121, 0, 0, 0}),
            (Bytes{5, 0x7F, 1, 0, 0, 0x21, 0x60}));
  expect_abort(AbortCode::out_of_memory);
  read(kDomain, {.longest = 60});  // without a size
  EXPECT_EQ(answer({1, 0x32, 2, 0, 0, 0x21, 0x0F, 0, 0, 0, 0, 0}), (Bytes{5, 0x13, 2, 0}));
  EXPECT_EQ(answer(padded({1, 0x33, 2, 0}, numbers_from(0, 60))), (Bytes{5, 0x13, 2, 1}));
  EXPECT_EQ(answer(padded({1, 0x33, 2, 1}, numbers_from(60, 60))),
            (Bytes{5, 0x7F, 2, 0, 0, 0x21, 0x60}));
  expect_abort(AbortCode::out_of_memory);
}

TEST_F(UsdoClientTest, AnExpeditedDownloadOfMoreThan4BytesIsNotRepeatedOnceItWasSent) {
  write({0x2000, 5}, pattern(5), {.repeats = 1});
  now += kTimeout;
  client.advance(now, queue);
  EXPECT_EQ(drain_fd(queue, kRequestId), (std::vector<Bytes>{{5, 0x7F, 1, 5, 0, 0x20, 0x60}}));
  expect_abort(AbortCode::timeout);
  write({0x2000, 1}, pattern(4), {.repeats = 1});
  now += kTimeout;
  client.advance(now, queue);
  EXPECT_EQ(drain_fd(queue, kRequestId).size(), 2U) << "the abort and the repetition";
}

// Nothing takes the frames out of the queue, as on a bus without another node.
TEST_F(UsdoClientTest, ARequestThatStillWaitsInTheQueueIsDropped) {
  for (unsigned i = 0; i < 20; ++i) {
    client.write({0x2000, 5}, pattern(8), kTimeout, now, queue, {.repeats = i % 2});
    now += kTimeout;
    client.advance(now, queue);
    EXPECT_EQ(queue.queued(can::TransmitClass::sdo), i % 2) << "a repetition";
    client.abort(AbortCode::general, now, queue);
    EXPECT_EQ(queue.queued(can::TransmitClass::sdo), 0U);
    EXPECT_TRUE(client.take());
  }
}

TEST_F(UsdoClientTest, TheNextRequestWaitsForTheAcknowledgementOfTheOneBefore) {
  sdo::RequestsUnderWay under_way;
  client.follow(under_way);
  const auto hand_out = [&](std::uint64_t number) {
    can::Frame frame;
    EXPECT_TRUE(queue.pop_rest(frame));
    under_way.handed_out(frame, number);
    return numbers(frame.bytes());
  };
  client.write({0x2000, 1}, pattern(1), kTimeout, now, queue, {});
  hand_out(1);
  now += kTimeout;
  client.advance(now, queue);
  expect_abort(AbortCode::timeout);
  for (unsigned i = 0; i < 3; ++i) {
    client.write({0x2000, 1}, pattern(1), kTimeout, now, queue, {});
    now += kTimeout;
    client.advance(now, queue);
    expect_abort(AbortCode::timeout);
  }
  EXPECT_EQ(hand_out(2), (Bytes{5, 0x7F, 1, 1, 0, 0x20, 0x60}));
  EXPECT_TRUE(queue.empty());
  client.read({0x1000, 0}, kTimeout, now, queue, {});
  answer({1, 0x31, 5, 0, 0, 0x10, 7, 4, 1, 2, 3, 4}, Receipt::stray);
  EXPECT_LE(client.next_wake(), now + 10ms);
  now += 10ms;
  client.advance(now, queue);
  EXPECT_TRUE(queue.empty());
  under_way.ended(2);
  now += 10ms;
  client.advance(now, queue);
  EXPECT_EQ(drain_fd(queue, kRequestId), (std::vector<Bytes>{{5, 0x11, 5, 0, 0, 0x10}}));
  EXPECT_EQ(client.next_wake(), now + kTimeout);
  answer({1, 0x31, 5, 0, 0, 0x10, 7, 4, 1, 2, 3, 4});
  expect_data({1, 2, 3, 4});
}

TEST_F(UsdoClientTest, AnAbortByTheCallerIsSent) {
  read({0x1000, 0});
  client.abort(AbortCode::general, now, queue);
  EXPECT_EQ(drain_fd(queue, kRequestId), (std::vector<Bytes>{{5, 0x7F, 1, 0, 0, 0x10, 0x60}}));
  expect_abort(AbortCode::general);
}

TEST_F(UsdoClientTest, AbortsOfFourBytesIfChosen) {
  Client other{kClient, kServer, AbortForm::four_bytes};
  other.read({0x1000, 0}, kTimeout, now, queue, {});
  drain_fd(queue, kRequestId);
  other.abort(AbortCode::general, now, queue);
  EXPECT_EQ(drain_fd(queue, kRequestId).back(), (Bytes{5, 0x80, 1, 0, 0, 0x10, 0, 0, 0, 8, 0, 0}));
}

TEST_F(UsdoClientTest, AFullQueueDelaysTheRequest) {
  while (queue.room(can::TransmitClass::sdo) > 0) {
    queue.push(can::TransmitClass::sdo, fd_frame(kRequestId, {0, 0, 0}));
  }
  client.read({0x1000, 0}, kTimeout, now, queue, {});
  EXPECT_EQ(drain_fd(queue, kRequestId).back(), (Bytes{0, 0, 0}));
  EXPECT_EQ(client.next_wake(), now + 1ms);
  now += 1ms;
  client.advance(now, queue);
  EXPECT_EQ(drain_fd(queue, kRequestId), (std::vector<Bytes>{{5, 0x11, 1, 0, 0, 0x10}}));
}

}  // namespace
}  // namespace linegate::usdo::test

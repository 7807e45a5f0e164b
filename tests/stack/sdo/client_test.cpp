// SPDX-License-Identifier: Apache-2.0
// The client compared with the frames of CiA 301, 7.2.4.3.
#include "tests/stack/sdo/client_fixture.h"

namespace linegate::sdo::test {
namespace {

TEST_F(ClientTest, ExpeditedUpload) {
  EXPECT_EQ(read({0x1018, 1}), (Frames{{0x40, 0x18, 0x10, 1, 0, 0, 0, 0}}));
  EXPECT_TRUE(client.busy());
  EXPECT_EQ(answer({0x43, 0x18, 0x10, 1, 1, 2, 3, 4}), Frames{});
  expect_data({1, 2, 3, 4});
  read({0x1018, 1});
  answer({0x47, 0x18, 0x10, 1, 1, 2, 3, 4});
  expect_data({1, 2, 3});
  read({0x1018, 1});
  answer({0x4B, 0x18, 0x10, 1, 1, 2, 3, 4});
  expect_data({1, 2});
  read({0x1018, 1});
  answer({0x4F, 0x18, 0x10, 1, 1, 2, 3, 4});
  expect_data({1});
}

TEST_F(ClientTest, ExpeditedUploadWithoutSizeIsFourBytes) {
  read({0x1018, 1});
  answer({0x42, 0x18, 0x10, 1, 1, 2, 3, 4});
  expect_data({1, 2, 3, 4});
}

TEST_F(ClientTest, SegmentedUpload) {
  read({0x1008, 0});
  EXPECT_EQ(answer({0x41, 0x08, 0x10, 0, 9, 0, 0, 0}), (Frames{{0x60, 0, 0, 0, 0, 0, 0, 0}}));
  EXPECT_EQ(answer({0x00, 1, 2, 3, 4, 5, 6, 7}), (Frames{{0x70, 0, 0, 0, 0, 0, 0, 0}}));
  EXPECT_EQ(answer({0x1B, 8, 9, 0, 0, 0, 0, 0}), Frames{});
  expect_data({1, 2, 3, 4, 5, 6, 7, 8, 9});
}

TEST_F(ClientTest, SegmentedUploadWithoutSize) {
  read({0x1008, 0});
  EXPECT_EQ(answer({0x40, 0x08, 0x10, 0, 0, 0, 0, 0}), (Frames{{0x60, 0, 0, 0, 0, 0, 0, 0}}));
  // Segments need not be full.
  EXPECT_EQ(answer({0x0A, 1, 2, 0, 0, 0, 0, 0}), (Frames{{0x70, 0, 0, 0, 0, 0, 0, 0}}));
  EXPECT_EQ(answer({0x1F, 0, 0, 0, 0, 0, 0, 0}), Frames{});
  expect_data({1, 2});
}

TEST_F(ClientTest, ExpeditedDownload) {
  EXPECT_EQ(write({0x2000, 1}, pattern(1)), (Frames{{0x2F, 0x00, 0x20, 1, 1, 0, 0, 0}}));
  EXPECT_EQ(answer({0x60, 0x00, 0x20, 1, 0, 0, 0, 0}), Frames{});
  expect_data({});
  EXPECT_EQ(write({0x2000, 2}, pattern(2)), (Frames{{0x2B, 0x00, 0x20, 2, 1, 2, 0, 0}}));
  answer({0x60, 0x00, 0x20, 2, 0, 0, 0, 0});
  expect_data({});
  EXPECT_EQ(write({0x2000, 3}, pattern(3)), (Frames{{0x27, 0x00, 0x20, 3, 1, 2, 3, 0}}));
  answer({0x60, 0x00, 0x20, 3, 0, 0, 0, 0});
  expect_data({});
  EXPECT_EQ(write({0x2000, 4}, pattern(4)), (Frames{{0x23, 0x00, 0x20, 4, 1, 2, 3, 4}}));
  answer({0x60, 0x00, 0x20, 4, 0, 0, 0, 0});
  expect_data({});
}

TEST_F(ClientTest, SegmentedDownload) {
  EXPECT_EQ(write({0x2000, 5}, pattern(9)), (Frames{{0x21, 0x00, 0x20, 5, 9, 0, 0, 0}}));
  EXPECT_EQ(answer({0x60, 0x00, 0x20, 5, 0, 0, 0, 0}), (Frames{{0x00, 1, 2, 3, 4, 5, 6, 7}}));
  EXPECT_EQ(answer({0x20, 0, 0, 0, 0, 0, 0, 0}), (Frames{{0x1B, 8, 9, 0, 0, 0, 0, 0}}));
  EXPECT_EQ(answer({0x30, 0, 0, 0, 0, 0, 0, 0}), Frames{});
  expect_data({});
}

TEST_F(ClientTest, EmptyDownload) {
  EXPECT_EQ(write({0x2000, 8}, {}), (Frames{{0x21, 0x00, 0x20, 8, 0, 0, 0, 0}}));
  EXPECT_EQ(answer({0x60, 0x00, 0x20, 8, 0, 0, 0, 0}), (Frames{{0x0F, 0, 0, 0, 0, 0, 0, 0}}));
  EXPECT_EQ(answer({0x20, 0, 0, 0, 0, 0, 0, 0}), Frames{});
  expect_data({});
}

TEST_F(ClientTest, AbortOfTheServerAtEveryStep) {
  const Bytes abort = abort_bytes(0x2000, 5, 0x0609'0011);
  read({0x2000, 5});
  EXPECT_EQ(answer(abort), Frames{});
  expect_abort(AbortCode::no_sub_index);

  read({0x2000, 5});
  answer({0x41, 0x00, 0x20, 5, 9, 0, 0, 0});
  EXPECT_EQ(answer(abort), Frames{});
  expect_abort(AbortCode::no_sub_index);

  write({0x2000, 5}, pattern(8));
  EXPECT_EQ(answer(abort), Frames{});
  expect_abort(AbortCode::no_sub_index);

  write({0x2000, 5}, pattern(8));
  answer({0x60, 0x00, 0x20, 5, 0, 0, 0, 0});
  EXPECT_EQ(answer(abort), Frames{});
  expect_abort(AbortCode::no_sub_index);
}

TEST_F(ClientTest, AnAbortWithCodeZeroIsNoSuccess) {
  read({0x2000, 5});
  answer(abort_bytes(0x2000, 5, 0));
  expect_abort(AbortCode::general);
}

// Inside the stack this code means that a hook completes later.
TEST_F(ClientTest, AnAbortWithTheCodeOfALateAnswerIsGeneral) {
  read({0x2000, 5});
  answer(abort_bytes(0x2000, 5, 0xFFFF'FFFF));
  expect_abort(AbortCode::general);
}

TEST_F(ClientTest, WrongCommandSpecifier) {
  for (const std::uint8_t command : Bytes{0x60, 0x00, 0x20, 0xA0, 0xC0, 0xE0}) {
    Client fresh{can::CobId{kRequestId}};
    fresh.read({0x2000, 5}, kTimeout, now, queue);
    drain(queue, kRequestId);
    EXPECT_EQ(fresh.receive(frame(kResponseId, {command, 0x00, 0x20, 5, 0, 0, 0, 0}, now), queue),
              Receipt::used);
    EXPECT_EQ(drain(queue, kRequestId), (Frames{abort_bytes(0x2000, 5, 0x0504'0001)}));
    EXPECT_EQ(fresh.take()->abort, AbortCode::command_specifier);
  }
}

TEST_F(ClientTest, WrongCommandSpecifierBetweenSegments) {
  read({0x1008, 0});
  answer({0x41, 0x08, 0x10, 0, 9, 0, 0, 0});
  EXPECT_EQ(answer({0x41, 0x08, 0x10, 0, 9, 0, 0, 0}),
            (Frames{abort_bytes(0x1008, 0, 0x0504'0001)}));
  expect_abort(AbortCode::command_specifier);
}

TEST_F(ClientTest, WrongCommandSpecifierBetweenDownloadSegments) {
  write({0x2000, 5}, pattern(8));
  answer({0x60, 0x00, 0x20, 5, 0, 0, 0, 0});
  EXPECT_EQ(answer({0x00, 0, 0, 0, 0, 0, 0, 0}), (Frames{abort_bytes(0x2000, 5, 0x0504'0001)}));
  expect_abort(AbortCode::command_specifier);
}

TEST_F(ClientTest, WrongMultiplexer) {
  read({0x1018, 1});
  EXPECT_EQ(answer({0x43, 0x18, 0x10, 2, 1, 2, 3, 4}),
            (Frames{abort_bytes(0x1018, 1, 0x0604'0043)}));
  expect_abort(AbortCode::parameter_incompatible);
}

// A controller that misses the end of a frame receives it again (ISO 11898-1): a repeated response
// belongs to the previous request, not to the present one.
TEST_F(ClientTest, AnAnswerThatComesTwiceIsNoneToTheNextQuestion) {
  const Bytes taken = {0x60, 0x00, 0x20, 5, 0, 0, 0, 0};
  const Bytes refused = abort_bytes(0x2000, 6, 0x0609'0030);
  write({0x2000, 5}, pattern(1));
  answer(taken);
  expect_data({});
  write({0x2000, 6}, pattern(1));
  EXPECT_EQ(answer(taken, Receipt::stray), Frames{});
  answer(refused);
  expect_abort(AbortCode::invalid_value);
  write({0x2000, 7}, pattern(1));
  EXPECT_EQ(answer(refused, Receipt::stray), Frames{});
  answer({0x60, 0x00, 0x20, 7, 0, 0, 0, 0});
  expect_data({});
}

TEST_F(ClientTest, SaysWhetherTheServerRefusedOrOneCannotKnow) {
  const auto refused = [this](const Bytes& bytes) {
    write({0x2000, 5}, pattern(1));
    answer(bytes);
    const std::optional<Outcome> outcome = client.take();
    return outcome.has_value() && outcome->refused;
  };
  EXPECT_TRUE(refused(abort_bytes(0x2000, 5, 0x0609'0030)));
  EXPECT_TRUE(refused(abort_bytes(0, 0, 0x0609'0030))) << "some servers omit the object";
  EXPECT_FALSE(refused(abort_bytes(0x2000, 6, 0x0609'0030)));
  EXPECT_FALSE(refused(abort_bytes(0x2000, 5, 0)));
  EXPECT_FALSE(refused({0x60, 0x00, 0x20, 7, 0, 0, 0, 0}));
}

TEST_F(ClientTest, AnAnswerToTheSameQuestionAskedBeforeLeavesTheSecondAnswerAsAStray) {
  read({0x1000, 0});
  client.abort(AbortCode::general, now, queue);
  drain(queue, kRequestId);
  client.take();
  read({0x1000, 0});
  answer({0x43, 0x00, 0x10, 0, 1, 2, 3, 4});  // the response to the first request
  EXPECT_EQ(client.take()->abort, AbortCode::none);
  read({0x1018, 1});
  // The response to the second request
  EXPECT_EQ(answer({0x43, 0x00, 0x10, 0, 1, 2, 3, 4}, Receipt::stray), Frames{});
  answer({0x43, 0x18, 0x10, 1, 5, 6, 7, 8});
  EXPECT_EQ(client.take()->abort, AbortCode::none);
}

// On a bus that acknowledges nothing, the first request is still queued when its time-out expires.
TEST_F(ClientTest, AnAnswerBeforeTheRequestWasHandedOutIsOfAnEarlierTransfer) {
  write({0x2000, 5}, pattern(1));
  now += kTimeout;
  client.advance(now, queue);
  expect_abort(AbortCode::timeout);
  client.write({0x2000, 5}, pattern(2), kTimeout, now, queue);
  const Bytes taken = {0x60, 0x00, 0x20, 5, 0, 0, 0, 0};
  EXPECT_EQ(client.receive(frame(kResponseId, taken, now), queue), Receipt::stray);
  EXPECT_EQ(client.receive(frame(kResponseId, abort_bytes(0x2000, 5, 0x0504'0001), now), queue),
            Receipt::stray);
  EXPECT_EQ(drain(queue, kRequestId),
            (Frames{abort_bytes(0x2000, 5, 0x0504'0000), {0x2B, 0x00, 0x20, 5, 1, 2, 0, 0}}));
  EXPECT_FALSE(client.take());
  answer(taken);
  expect_data({});
}

// As above, with the same object, while the request is in the transmit queue.
TEST_F(ClientTest, AnAnswerThatComesTwiceIsNoneToTheSameQuestionThatWaits) {
  const Bytes taken = {0x60, 0x00, 0x20, 5, 0, 0, 0, 0};
  write({0x2000, 5}, pattern(1));
  answer(taken);
  expect_data({});
  client.write({0x2000, 5}, pattern(2), kTimeout, now, queue);
  EXPECT_EQ(answer(taken, Receipt::stray), (Frames{{0x2B, 0x00, 0x20, 5, 1, 2, 0, 0}}));
  EXPECT_FALSE(client.take());
  answer(taken);
  expect_data({});
}

// It belongs to another client, or to the previous line before a restart.
TEST_F(ClientTest, AnAnswerBeforeTheFirstRequestIsNotToIt) {
  const Bytes taken = {0x60, 0x00, 0x20, 5, 0, 0, 0, 0};
  client.write({0x2000, 5}, pattern(2), kTimeout, now, queue);
  EXPECT_EQ(answer(taken, Receipt::unasked), (Frames{{0x2B, 0x00, 0x20, 5, 1, 2, 0, 0}}));
  EXPECT_FALSE(client.take());
  answer(taken);
  expect_data({});
}

TEST_F(ClientTest, WrongToggleBit) {
  read({0x1008, 0});
  answer({0x41, 0x08, 0x10, 0, 9, 0, 0, 0});
  EXPECT_EQ(answer({0x10, 1, 2, 3, 4, 5, 6, 7}), (Frames{abort_bytes(0x1008, 0, 0x0503'0000)}));
  expect_abort(AbortCode::toggle_bit);

  write({0x2000, 5}, pattern(8));
  answer({0x60, 0x00, 0x20, 5, 0, 0, 0, 0});
  EXPECT_EQ(answer({0x30, 0, 0, 0, 0, 0, 0, 0}), (Frames{abort_bytes(0x2000, 5, 0x0503'0000)}));
  expect_abort(AbortCode::toggle_bit);
}

TEST_F(ClientTest, ADuplicatedSegmentHasTheWrongToggleBit) {
  read({0x1008, 0});
  answer({0x41, 0x08, 0x10, 0, 20, 0, 0, 0});
  answer({0x00, 1, 2, 3, 4, 5, 6, 7});
  EXPECT_EQ(answer({0x00, 1, 2, 3, 4, 5, 6, 7}), (Frames{abort_bytes(0x1008, 0, 0x0503'0000)}));
  expect_abort(AbortCode::toggle_bit);
}

TEST_F(ClientTest, MoreOrFewerBytesThanIndicated) {
  read({0x1008, 0});
  answer({0x41, 0x08, 0x10, 0, 5, 0, 0, 0});
  EXPECT_EQ(answer({0x00, 1, 2, 3, 4, 5, 6, 7}), (Frames{abort_bytes(0x1008, 0, 0x0607'0012)}));
  expect_abort(AbortCode::length_too_high);

  read({0x1008, 0});
  answer({0x41, 0x08, 0x10, 0, 5, 0, 0, 0});
  EXPECT_EQ(answer({0x0B, 1, 2, 0, 0, 0, 0, 0}), (Frames{abort_bytes(0x1008, 0, 0x0607'0013)}));
  expect_abort(AbortCode::length_too_low);
}

TEST_F(ClientTest, AnAbsurdSizeIsRefused) {
  read({0x1008, 0});
  EXPECT_EQ(answer({0x41, 0x08, 0x10, 0, 0xFF, 0xFF, 0xFF, 0xFF}),
            (Frames{abort_bytes(0x1008, 0, 0x0504'0005)}));
  expect_abort(AbortCode::out_of_memory);
}

TEST_F(ClientTest, TimeOutIsPerAnswer) {
  read({0x1008, 0});
  EXPECT_EQ(client.next_wake(), now + kTimeout);
  now += 400ms;
  answer({0x41, 0x08, 0x10, 0, 20, 0, 0, 0});
  EXPECT_EQ(client.next_wake(), now + kTimeout);
  client.advance(now + kTimeout - 1ns, queue);
  EXPECT_TRUE(client.busy());
  client.advance(now + kTimeout, queue);
  EXPECT_EQ(drain(queue, kRequestId), (Frames{abort_bytes(0x1008, 0, 0x0504'0000)}));
  expect_abort(AbortCode::timeout);
}

TEST_F(ClientTest, ALateAnswerIsNotTakenForTheNextOne) {
  read({0x1018, 1});
  client.advance(now + kTimeout, queue);
  drain(queue, kRequestId);
  expect_abort(AbortCode::timeout);
  read({0x1018, 2});
  EXPECT_EQ(answer({0x43, 0x18, 0x10, 1, 9, 9, 9, 9}, Receipt::stray), Frames{});
  answer({0x43, 0x18, 0x10, 2, 1, 2, 3, 4});
  expect_data({1, 2, 3, 4});
}

TEST_F(ClientTest, ALateAnswerToAnotherServiceOrALateAbortIsNotTakenEither) {
  write({0x1018, 1}, pattern(9));
  answer({0x60, 0x18, 0x10, 1, 0, 0, 0, 0});
  client.advance(now + kTimeout, queue);
  drain(queue, kRequestId);
  expect_abort(AbortCode::timeout);
  read({0x1018, 2});
  EXPECT_EQ(answer({0x20, 0, 0, 0, 0, 0, 0, 0}, Receipt::stray), Frames{});
  EXPECT_EQ(answer(abort_bytes(0x1018, 1, 0x0504'0000), Receipt::stray), Frames{});
  answer({0x43, 0x18, 0x10, 2, 1, 2, 3, 4});
  expect_data({1, 2, 3, 4});
}

TEST_F(ClientTest, AnAbortWithoutMultiplexerCounts) {
  read({0x1018, 1});
  client.advance(now + kTimeout, queue);
  drain(queue, kRequestId);
  expect_abort(AbortCode::timeout);
  read({0x1018, 2});
  answer(abort_bytes(0, 0, 0x0504'0001));
  expect_abort(AbortCode::command_specifier);
}

TEST_F(ClientTest, AnswersWhenNothingIsUnderWay) {
  answer({0x43, 0x18, 0x10, 1, 1, 2, 3, 4}, Receipt::unasked);
  read({0x1018, 1});
  answer({0x43, 0x18, 0x10, 1, 1, 2, 3, 4});
  expect_data({1, 2, 3, 4});
  answer({0x43, 0x18, 0x10, 1, 1, 2, 3, 4}, Receipt::stray);  // a repetition of the last response
  answer({0x43, 0x18, 0x10, 1, 9, 9, 9, 9}, Receipt::unasked);
}

TEST_F(ClientTest, MalformedFramesAreNotProcessed) {
  read({0x1018, 1});
  answer({0x43, 0x18, 0x10, 1, 1, 2, 3}, Receipt::malformed);
  answer({}, Receipt::malformed);
  EXPECT_TRUE(client.busy());
  answer({0x43, 0x18, 0x10, 1, 1, 2, 3, 4});
  expect_data({1, 2, 3, 4});
}

TEST_F(ClientTest, AbortByTheCaller) {
  client.abort(AbortCode::general, now, queue);
  EXPECT_TRUE(queue.empty());
  read({0x1018, 1});
  client.abort(AbortCode::local_control, now, queue);
  EXPECT_EQ(drain(queue, kRequestId), (Frames{abort_bytes(0x1018, 1, 0x0800'0021)}));
  expect_abort(AbortCode::local_control);
}

TEST_F(ClientTest, AWriteMayBeCarriedOutOnceAllOfItWasSent) {
  read({0x2000, 0});
  EXPECT_FALSE(client.may_be_carried_out()) << "it changes nothing";
  answer({0x4F, 0x00, 0x20, 0, 1, 0, 0, 0});
  client.take();
  write({0x2000, 1}, pattern(4));
  EXPECT_TRUE(client.may_be_carried_out());
  answer({0x60, 0x00, 0x20, 1, 0, 0, 0, 0});
  EXPECT_FALSE(client.may_be_carried_out()) << "it was carried out";
  client.take();
  write({0x2000, 5}, pattern(9));
  EXPECT_FALSE(client.may_be_carried_out());
  answer({0x60, 0x00, 0x20, 5, 0, 0, 0, 0});
  EXPECT_FALSE(client.may_be_carried_out());
  answer({0x20, 0, 0, 0, 0, 0, 0, 0});
  EXPECT_TRUE(client.may_be_carried_out());
  answer({0x30, 0, 0, 0, 0, 0, 0, 0});
  client.take();
  write({0x2000, 8}, {});
  EXPECT_FALSE(client.may_be_carried_out()) << "an empty value is a segment";
  answer({0x60, 0x00, 0x20, 8, 0, 0, 0, 0});
  EXPECT_TRUE(client.may_be_carried_out());
}

TEST_F(ClientTest, ABlockWriteMayBeCarriedOutFromItsEndOn) {
  write({0x2000, 5}, pattern(7), {.transfer = Transfer::block});
  EXPECT_FALSE(client.may_be_carried_out());
  answer({0xA4, 0x00, 0x20, 5, 127, 0, 0, 0});
  EXPECT_FALSE(client.may_be_carried_out()) << "the end request is missing";
  EXPECT_EQ(answer({0xA2, 1, 127, 0, 0, 0, 0, 0}).size(), 1U);
  EXPECT_TRUE(client.may_be_carried_out());
}

TEST_F(ClientTest, AWriteThatIsNotSentIsNotCarriedOutUnlessAnEarlierAttemptWas) {
  while (queue.push(can::TransmitClass::sdo, can::make_frame(0x123, {1}))) {
  }
  client.write({0x2000, 0}, pattern(4), kTimeout, now, queue, {.repeats = 1});
  EXPECT_FALSE(client.may_be_carried_out()) << "the queue is full";
  drain(queue, 0x123);
  now += 10ms;
  client.advance(now, queue);
  EXPECT_TRUE(client.may_be_carried_out());
  while (queue.push(can::TransmitClass::sdo, can::make_frame(0x123, {1}))) {
  }
  now += kTimeout;
  client.advance(now, queue);
  EXPECT_TRUE(client.busy()) << "repeated";
  EXPECT_TRUE(client.may_be_carried_out());
}

TEST_F(ClientTest, AFullQueueDelaysTheRequest) {
  while (queue.push(can::TransmitClass::sdo, can::make_frame(0x123, {1}))) {
  }
  client.read({0x1018, 1}, kTimeout, now, queue);
  EXPECT_EQ(client.next_wake(), now + 1ms);
  drain(queue, 0x123);
  client.advance(now + 1ms, queue);
  EXPECT_EQ(drain(queue, kRequestId), (Frames{{0x40, 0x18, 0x10, 1, 0, 0, 0, 0}}));
}

TEST_F(ClientTest, AnAbortWaitsBeforeTheNextRequest) {
  read({0x1018, 1});
  while (queue.push(can::TransmitClass::sdo, can::make_frame(0x123, {1}))) {
  }
  client.advance(now + kTimeout, queue);
  expect_abort(AbortCode::timeout);
  client.read({0x1018, 2}, kTimeout, now + kTimeout, queue);
  drain(queue, 0x123);
  client.advance(now + kTimeout + 1ms, queue);
  EXPECT_EQ(drain(queue, kRequestId),
            (Frames{abort_bytes(0x1018, 1, 0x0504'0000), {0x40, 0x18, 0x10, 2, 0, 0, 0, 0}}));
}

TEST_F(ClientTest, ABusWithoutRoomIsATimeOut) {
  while (queue.push(can::TransmitClass::sdo, can::make_frame(0x123, {1}))) {
  }
  client.read({0x1018, 1}, kTimeout, now, queue);
  client.advance(now + kTimeout, queue);
  expect_abort(AbortCode::timeout);
  drain(queue, 0x123);
  client.advance(now + kTimeout + 1ms, queue);
  EXPECT_EQ(drain(queue, kRequestId), (Frames{abort_bytes(0x1018, 1, 0x0504'0000)}));
}

TEST_F(ClientTest, ReportsTheSegmentsThatTheServerAcknowledged) {
  AcknowledgedSource source(10);
  client.write({0x2100, 0}, source, kTimeout, now, queue, {.transfer = Transfer::segmented});
  drain(queue, kRequestId);
  answer({0x60, 0x00, 0x21, 0, 0, 0, 0, 0});
  EXPECT_TRUE(source.counts.empty()) << "the first segment was only sent";
  answer({0x20, 0, 0, 0, 0, 0, 0, 0});
  EXPECT_EQ(source.counts, (std::vector<std::size_t>{7}));
  answer({0x30, 0, 0, 0, 0, 0, 0, 0});
  EXPECT_EQ(source.counts, (std::vector<std::size_t>{7, 10}));
  expect_data({});
}

}  // namespace
}  // namespace linegate::sdo::test

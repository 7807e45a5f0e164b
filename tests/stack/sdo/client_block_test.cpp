// SPDX-License-Identifier: Apache-2.0
// Block transfer of the client compared with the frames of CiA 301, 7.2.4.3.9 to 7.2.4.3.16, and
// the conditions under which it is used.
#include "stack/sdo/block.h"

#include "tests/stack/sdo/block_frames.h"
#include "tests/stack/sdo/client_fixture.h"

namespace linegate::sdo::test {
namespace {

constexpr TransferOptions kInBlocks{.transfer = Transfer::block};

class ClientBlockTest : public ClientTest {
 protected:
  // The frames that the client sends until it waits for a response.
  Frames all() {
    Frames out;
    for (bool more = true; more;) {
      const Frames some = drain(queue, kRequestId);
      out.insert(out.end(), some.begin(), some.end());
      more = !some.empty();
      now += 1ms;
      client.advance(now, queue);
    }
    return out;
  }
  Frames answer_all(const Bytes& data) {
    EXPECT_EQ(client.receive(frame(kResponseId, data, now), queue), Receipt::used);
    return all();
  }
  // Until the segments of a value of 20 bytes are sent or expected.
  void begin_download() {
    write({0x2100, 0}, pattern(20), kInBlocks);
    answer_all({0xA4, 0x00, 0x21, 0, 127, 0, 0, 0});
  }
  void begin_upload() {
    read({0x2100, 0}, kInBlocks);
    answer({0xC6, 0x00, 0x21, 0, 20, 0, 0, 0});
  }
  void give(const Frames& frames) {
    for (const Bytes& each : frames) {
      EXPECT_EQ(answer(each), Frames{});
    }
  }
};

TEST_F(ClientBlockTest, Download) {
  const auto value = pattern(20);
  EXPECT_EQ(write({0x2100, 0}, value, kInBlocks), (Frames{{0xC6, 0x00, 0x21, 0, 20, 0, 0, 0}}));
  EXPECT_EQ(answer_all({0xA4, 0x00, 0x21, 0, 127, 0, 0, 0}), segments(value, 0, 3));
  EXPECT_EQ(answer(block_ack(3, 127)), (Frames{end_request(value, crc_of(value))}));
  EXPECT_TRUE(client.busy());
  EXPECT_EQ(answer({0xA1, 0, 0, 0, 0, 0, 0, 0}), Frames{});
  expect_data({});
}

TEST_F(ClientBlockTest, DownloadWithoutCheckSumOfTheServer) {
  write({0x2100, 0}, pattern(14), kInBlocks);
  answer_all({0xA0, 0x00, 0x21, 0, 127, 0, 0, 0});
  EXPECT_EQ(answer(block_ack(2, 127)), (Frames{end_request(pattern(14), 0)}));
}

TEST_F(ClientBlockTest, DownloadInSubBlocksOfTheServersSize) {
  const auto value = pattern(70);
  write({0x2100, 0}, value, kInBlocks);
  EXPECT_EQ(answer_all({0xA4, 0x00, 0x21, 0, 4, 0, 0, 0}), segments(value, 0, 4));
  EXPECT_EQ(answer_all(block_ack(4, 3)), segments(value, 4, 3));
  EXPECT_EQ(answer_all(block_ack(1, 127)), segments(value, 5, 5));  // two segments were lost
  EXPECT_EQ(answer_all(block_ack(0, 127)), segments(value, 5, 5));
  EXPECT_EQ(answer(block_ack(5, 1)), (Frames{end_request(value, crc_of(value))}));
}

TEST_F(ClientBlockTest, Upload) {
  const auto value = pattern(20);
  EXPECT_EQ(read({0x2100, 0}, kInBlocks), (Frames{{0xA4, 0x00, 0x21, 0, 127, 21, 0, 0}}));
  EXPECT_EQ(answer({0xC6, 0x00, 0x21, 0, 20, 0, 0, 0}), (Frames{{0xA3, 0, 0, 0, 0, 0, 0, 0}}));
  give(segments(value, 0, 2));
  EXPECT_EQ(answer(segments(value, 0, 3)[2]), (Frames{block_ack(3, 127)}));
  EXPECT_EQ(answer(end_request(value, crc_of(value))), (Frames{{0xA1, 0, 0, 0, 0, 0, 0, 0}}));
  expect_data(numbers(value));
}

TEST_F(ClientBlockTest, UploadWithoutSizeAndCheckSum) {
  read({0x2100, 0}, kInBlocks);
  EXPECT_EQ(answer({0xC0, 0x00, 0x21, 0, 0, 0, 0, 0}), (Frames{{0xA3, 0, 0, 0, 0, 0, 0, 0}}));
  EXPECT_EQ(answer({0x81, 1, 2, 0, 0, 0, 0, 0}), (Frames{block_ack(1, 127)}));
  EXPECT_EQ(answer({0xD5, 0, 0, 0, 0, 0, 0, 0}), (Frames{{0xA1, 0, 0, 0, 0, 0, 0, 0}}));
  expect_data({1, 2});
}

TEST_F(ClientBlockTest, TheServerMaySwitchToSegmentsOrExpedited) {
  read({0x2100, 0}, kInBlocks);
  EXPECT_EQ(answer({0x41, 0x00, 0x21, 0, 9, 0, 0, 0}), (Frames{{0x60, 0, 0, 0, 0, 0, 0, 0}}));
  answer({0x00, 1, 2, 3, 4, 5, 6, 7});
  answer({0x1B, 8, 9, 0, 0, 0, 0, 0});
  expect_data({1, 2, 3, 4, 5, 6, 7, 8, 9});
  read({0x2100, 0}, kInBlocks);
  EXPECT_EQ(answer({0x43, 0x00, 0x21, 0, 1, 2, 3, 4}), Frames{});
  expect_data({1, 2, 3, 4});
}

TEST_F(ClientBlockTest, WritesChooseBySize) {
  EXPECT_EQ(write({0x2100, 0}, pattern(4)).at(0)[0], 0x23);
  client.abort(AbortCode::general, now, queue);
  EXPECT_EQ(write({0x2100, 0}, pattern(127)).at(1)[0], 0x21);
  client.abort(AbortCode::general, now, queue);
  EXPECT_EQ(write({0x2100, 0}, pattern(128)).at(1)[0], 0xC6);
  client.abort(AbortCode::general, now, queue);
  EXPECT_EQ(write({0x2100, 0}, pattern(128), {.transfer = Transfer::segmented}).at(1)[0], 0x21);
}

TEST_F(ClientBlockTest, ReadsChooseByTheSizeTheServerTells) {
  read({0x2100, 0});
  EXPECT_EQ(answer({0x41, 0x00, 0x21, 0, 127, 0, 0, 0}), (Frames{{0x60, 0, 0, 0, 0, 0, 0, 0}}));
  client.abort(AbortCode::general, now, queue);
  drain(queue, kRequestId);
  read({0x2100, 0});
  EXPECT_EQ(answer({0x41, 0x00, 0x21, 0, 128, 0, 0, 0}),
            (Frames{abort_bytes(0x2100, 0, 0x0800'0000), {0xA4, 0x00, 0x21, 0, 127, 0, 0, 0}}));
  EXPECT_EQ(answer({0xC6, 0x00, 0x21, 0, 128, 0, 0, 0}), (Frames{{0xA3, 0, 0, 0, 0, 0, 0, 0}}));
}

TEST_F(ClientBlockTest, AServerThatRefusesBlocksGetsSegments) {
  const Bytes refusal = abort_bytes(0x2100, 0, 0x0504'0001);
  write({0x2100, 0}, pattern(200));
  EXPECT_EQ(answer(refusal), (Frames{{0x21, 0x00, 0x21, 0, 200, 0, 0, 0}}));
  EXPECT_EQ(answer({0x60, 0x00, 0x21, 0, 0, 0, 0, 0}), (Frames{{0x00, 1, 2, 3, 4, 5, 6, 7}}));
  client.abort(AbortCode::general, now, queue);
  drain(queue, kRequestId);
  // From now on the client uses segments without a first attempt in blocks.
  EXPECT_EQ(write({0x2100, 0}, pattern(200)).at(0)[0], 0x21);
  client.abort(AbortCode::general, now, queue);
  drain(queue, kRequestId);
  // It uses blocks if the caller requests them, or if the device may have been replaced.
  EXPECT_EQ(write({0x2100, 0}, pattern(200), kInBlocks).at(0)[0], 0xC6);
  for (int unanswered = 0; unanswered < 2; ++unanswered) {
    now += kTimeout;
    client.advance(now, queue);
    drain(queue, kRequestId);
  }
  expect_abort(AbortCode::timeout);
  EXPECT_EQ(write({0x2100, 0}, pattern(200)).at(0)[0], 0xC6);
}

TEST_F(ClientBlockTest, ARefusedReadGoesOnInSegments) {
  read({0x2100, 0}, kInBlocks);
  EXPECT_EQ(answer(abort_bytes(0x2100, 0, 0x0504'0001)),
            (Frames{{0x40, 0x00, 0x21, 0, 0, 0, 0, 0}}));
  EXPECT_EQ(answer({0x41, 0x00, 0x21, 0, 200, 0, 0, 0}), (Frames{{0x60, 0, 0, 0, 0, 0, 0, 0}}));
}

// The server reported the size, so the object can be read, whatever the abort code of the block
// transfer is.
TEST_F(ClientBlockTest, AReadThatChangedToBlocksFallsBackUponAnyAbort) {
  read({0x2100, 0});
  answer({0x41, 0x00, 0x21, 0, 200, 0, 0, 0});
  EXPECT_EQ(answer(abort_bytes(0x2100, 0, 0x0800'0022)),
            (Frames{{0x40, 0x00, 0x21, 0, 0, 0, 0, 0}}));
  EXPECT_EQ(answer({0x41, 0x00, 0x21, 0, 200, 0, 0, 0}), (Frames{{0x60, 0, 0, 0, 0, 0, 0, 0}}));
}

TEST_F(ClientBlockTest, AnAbortOfTheInitiateThatIsAboutTheObjectEndsTheTransfer) {
  for (const std::uint32_t code :
       {0x0601'0001U, 0x0601'0002U, 0x0602'0000U, 0x0606'0000U, 0x0607'0010U, 0x0607'0012U,
        0x0609'0011U, 0x0609'0030U, 0x0609'FFFFU, 0x0800'0020U, 0x0800'0021U, 0x0800'0022U}) {
    SCOPED_TRACE(code);
    write({0x2100, 0}, pattern(200));
    EXPECT_EQ(answer(abort_bytes(0x2100, 0, code)), Frames{});
    expect_abort(static_cast<AbortCode>(code));
    read({0x2100, 0}, kInBlocks);
    EXPECT_EQ(answer(abort_bytes(0x2100, 0, code)), Frames{});
    expect_abort(static_cast<AbortCode>(code));
  }
}

TEST_F(ClientBlockTest, AnyOtherAbortOfTheInitiateIsFollowedBySegments) {
  for (const std::uint32_t code :
       {0x0503'0000U, 0x0504'0000U, 0x0504'0002U, 0x0504'0005U, 0x0601'0000U, 0x060A'0023U,
        0x0800'0000U, 0x0800'0030U, 0x1234'5678U}) {
    SCOPED_TRACE(code);
    write({0x2100, 0}, pattern(200));
    EXPECT_EQ(answer(abort_bytes(0x2100, 0, code)), (Frames{{0x21, 0x00, 0x21, 0, 200, 0, 0, 0}}));
    client.abort(AbortCode::general, now, queue);
    drain(queue, kRequestId);
    client.take();
    read({0x2100, 0}, kInBlocks);
    EXPECT_EQ(answer(abort_bytes(0x2100, 0, code)), (Frames{{0x40, 0x00, 0x21, 0, 0, 0, 0, 0}}));
    client.abort(AbortCode::general, now, queue);
    drain(queue, kRequestId);
    client.take();
  }
}

TEST_F(ClientBlockTest, AnInitiateThatIsNotAnsweredIsFollowedBySegments) {
  const Frames upload{abort_bytes(0x2100, 0, 0x0504'0000), {0x40, 0x00, 0x21, 0, 0, 0, 0, 0}};
  const Frames download{abort_bytes(0x2100, 0, 0x0504'0000), {0x21, 0x00, 0x21, 0, 200, 0, 0, 0}};
  const auto wait = [this] {
    now += kTimeout;
    client.advance(now, queue);
    return drain(queue, kRequestId);
  };
  read({0x2100, 0}, kInBlocks);
  EXPECT_EQ(wait(), upload);
  EXPECT_EQ(answer({0x43, 0x00, 0x21, 0, 1, 2, 3, 4}), Frames{});
  expect_data({1, 2, 3, 4});
  write({0x2100, 0}, pattern(200));
  EXPECT_EQ(wait(), download);
  EXPECT_EQ(answer({0xA4, 0x00, 0x21, 0, 127, 0, 0, 0}, Receipt::stray), Frames{}) << "late answer";
  EXPECT_EQ(answer({0x60, 0x00, 0x21, 0, 0, 0, 0, 0}), (Frames{{0x00, 1, 2, 3, 4, 5, 6, 7}}));
  client.abort(AbortCode::general, now, queue);
  drain(queue, kRequestId);
  client.take();
  EXPECT_EQ(write({0x2100, 0}, pattern(200)).at(0)[0], 0x21) << "two requests were not answered";
}

TEST_F(ClientBlockTest, BlocksCanBeLimitedOrSwitchedOff) {
  const auto begins = [this](std::size_t size, std::uint32_t from) {
    const std::uint8_t command = write({0x2100, 0}, pattern(size), {.block_from = from}).back()[0];
    client.abort(AbortCode::general, now, queue);
    drain(queue, kRequestId);
    client.take();
    return command;
  };
  EXPECT_EQ(begins(999, 1000), 0x21);
  EXPECT_EQ(begins(1000, 1000), 0xC6);
  EXPECT_EQ(begins(5, 5), 0xC6);
  EXPECT_EQ(begins(100'000, kNoBlocks), 0x21);
  read({0x2100, 0}, {.block_from = kNoBlocks});
  EXPECT_EQ(answer({0x41, 0x00, 0x21, 0, 0, 1, 0, 0}), (Frames{{0x60, 0, 0, 0, 0, 0, 0, 0}}));
}

TEST_F(ClientBlockTest, BlockSizesThereAreNot) {
  for (const std::uint8_t wrong : Bytes{0, 128}) {
    write({0x2100, 0}, pattern(20), kInBlocks);
    EXPECT_EQ(answer({0xA4, 0x00, 0x21, 0, wrong, 0, 0, 0}),
              (Frames{abort_bytes(0x2100, 0, 0x0504'0002)}));
    expect_abort(AbortCode::block_size);
    begin_download();
    EXPECT_EQ(answer(block_ack(2, wrong)), (Frames{abort_bytes(0x2100, 0, 0x0504'0002)}));
    expect_abort(AbortCode::block_size);
  }
}

TEST_F(ClientBlockTest, MoreAcknowledgedThanSent) {
  begin_download();
  EXPECT_EQ(answer(block_ack(4, 127)), (Frames{abort_bytes(0x2100, 0, 0x0504'0003)}));
  expect_abort(AbortCode::sequence_number);
}

// ackseq 0 and the acknowledgement crossed the segments: both are of the first transmission.
TEST_F(ClientBlockTest, AnAcknowledgementMayPrecedeTheRepetition) {
  constexpr std::uint8_t kSegments = 43;
  const auto value = pattern(kSegments * 7);
  write({0x2100, 0}, value, kInBlocks);
  EXPECT_EQ(answer_all({0xA4, 0x00, 0x21, 0, 127, 0, 0, 0}), segments(value, 0, kSegments));
  Frames repeated = segments(value, 0, kSegments);
  repeated.push_back(end_request(value, crc_of(value)));
  client.receive(frame(kResponseId, block_ack(0, 127), now), queue);
  client.receive(frame(kResponseId, block_ack(kSegments, 127), now), queue);
  EXPECT_EQ(all(), repeated);
  answer({0xA1, 0, 0, 0, 0, 0, 0, 0});
  expect_data({});
}

TEST_F(ClientBlockTest, ASequenceNumberThereIsNot) {
  begin_upload();
  EXPECT_EQ(answer({0x00, 1, 2, 3, 4, 5, 6, 7}), (Frames{abort_bytes(0x2100, 0, 0x0504'0003)}));
  expect_abort(AbortCode::sequence_number);
}

TEST_F(ClientBlockTest, AWrongCheckSum) {
  begin_upload();
  give(segments(pattern(20), 0, 2));
  answer(segments(pattern(20), 0, 3)[2]);
  EXPECT_EQ(answer(end_request(pattern(20), static_cast<std::uint16_t>(crc_of(pattern(20)) + 1))),
            (Frames{abort_bytes(0x2100, 0, 0x0504'0004)}));
  expect_abort(AbortCode::crc);
}

TEST_F(ClientBlockTest, MoreOrFewerBytesThanIndicated) {
  begin_upload();
  give(segments(pattern(70), 0, 3));
  EXPECT_EQ(answer(segments(pattern(70), 0, 4)[3]), (Frames{abort_bytes(0x2100, 0, 0x0607'0012)}));
  expect_abort(AbortCode::length_too_high);
  begin_upload();
  answer({0x81, 1, 2, 3, 4, 5, 6, 7});
  EXPECT_EQ(answer(end_request(pattern(7), crc_of(pattern(7)))),
            (Frames{abort_bytes(0x2100, 0, 0x0607'0013)}));
  expect_abort(AbortCode::length_too_low);
  read({0x2100, 0}, kInBlocks);
  EXPECT_EQ(answer({0xC6, 0x00, 0x21, 0, 0xFF, 0xFF, 0xFF, 0xFF}),
            (Frames{abort_bytes(0x2100, 0, 0x0504'0005)}));
  expect_abort(AbortCode::out_of_memory);
}

TEST_F(ClientBlockTest, WrongMultiplexerAndSpecifierOfAnInitiate) {
  struct Row {
    Bytes answer;
    AbortCode code;
  };
  for (const bool writing : {false, true}) {
    const std::uint8_t good = writing ? 0xA4 : 0xC6;
    for (const Row& row :
         {Row{{good, 0x00, 0x21, 1, 127, 0, 0, 0}, AbortCode::parameter_incompatible},
          Row{{0xA2, 0, 127, 0, 0, 0, 0, 0}, AbortCode::command_specifier},
          Row{{0xC1, 0, 0, 0, 0, 0, 0, 0}, AbortCode::command_specifier},
          Row{{writing ? std::uint8_t{0x60} : std::uint8_t{0xA4}, 0x00, 0x21, 0, 127, 0, 0, 0},
              AbortCode::command_specifier}}) {
      Client fresh{can::CobId{kRequestId}};
      if (writing) {
        fresh.write({0x2100, 0}, pattern(20), kTimeout, now, queue, kInBlocks);
      } else {
        fresh.read({0x2100, 0}, kTimeout, now, queue, kInBlocks);
      }
      drain(queue, kRequestId);
      EXPECT_EQ(fresh.receive(frame(kResponseId, row.answer, now), queue), Receipt::used);
      EXPECT_EQ(fresh.take()->abort, row.code);
      drain(queue, kRequestId);
    }
  }
}

// The response to the initiate request was lost, and the server waits for segments: the transfer
// times out.
TEST_F(ClientBlockTest, ALateAcknowledgementInsteadOfTheInitiateIsAStray) {
  write({0x2100, 0}, pattern(20), kInBlocks);
  now += 200ms;
  EXPECT_EQ(answer(block_ack(0, 127), Receipt::stray), Frames{});
  now += 300ms;
  client.advance(now, queue);
  EXPECT_EQ(drain(queue, kRequestId),
            (Frames{abort_bytes(0x2100, 0, 0x0504'0000), {0x21, 0x00, 0x21, 0, 20, 0, 0, 0}}));
}

// So many segments are not lost at once: the server did not receive the start.
TEST_F(ClientBlockTest, AnUploadThatDoesNotBeginIsNotAcknowledged) {
  for (const std::uint8_t size : {std::uint8_t{57}, std::uint8_t{0}}) {  // 0: size not indicated
    read({0x2100, 0}, kInBlocks);
    answer({static_cast<std::uint8_t>(size != 0 ? 0xC6 : 0xC4), 0x00, 0x21, 0, size, 0, 0, 0});
    while (client.busy()) {
      now = client.next_wake();
      client.advance(now, queue);
      EXPECT_LE(drain(queue, kRequestId).size(), client.busy() ? 0U : 1U);
    }
    expect_abort(AbortCode::timeout);
  }
}

// All of a few segments may be lost: ackseq 0 requests them again, a limited number of times.
TEST_F(ClientBlockTest, AllSegmentsOfAShortUploadAreAskedForAgain) {
  const auto stall = [this] {
    EXPECT_EQ(client.next_wake(), now + kTimeout * 2 / 5);
    now += kTimeout * 2 / 5;
    client.advance(now, queue);
    return drain(queue, kRequestId);
  };
  begin_upload();
  EXPECT_EQ(stall(), (Frames{block_ack(0, 127)}));
  give(segments(pattern(20), 0, 2));
  EXPECT_EQ(answer(segments(pattern(20), 0, 3)[2]), (Frames{block_ack(3, 127)}));
  answer(end_request(pattern(20), crc_of(pattern(20))));
  expect_data(numbers(pattern(20)));

  begin_upload();
  EXPECT_EQ(stall(), (Frames{block_ack(0, 127)}));
  EXPECT_EQ(stall(), (Frames{block_ack(0, 127)}));
  EXPECT_EQ(stall(), Frames{});
  now = client.next_wake();
  client.advance(now, queue);
  EXPECT_EQ(drain(queue, kRequestId), (Frames{abort_bytes(0x2100, 0, 0x0504'0000)}));
  expect_abort(AbortCode::timeout);
}

// A server that did not receive the start cannot interpret ackseq 0.
TEST_F(ClientBlockTest, AStartThatWasLostIsATimeOutAndRepeated) {
  const Bytes refusal = abort_bytes(0x2100, 0, 0x0504'0001);
  const auto stall = [this] {
    now += kTimeout * 2 / 5;
    client.advance(now, queue);
    EXPECT_EQ(drain(queue, kRequestId), (Frames{block_ack(0, 127)}));
  };
  begin_upload();
  stall();
  EXPECT_EQ(answer(refusal), Frames{});
  expect_abort(AbortCode::timeout);

  begin_upload();
  stall();
  answer(segments(pattern(20), 0, 1)[0]);
  EXPECT_EQ(answer(refusal), Frames{});
  expect_abort(AbortCode::command_specifier);

  read({0x2100, 0}, {.transfer = Transfer::block, .repeats = 1});
  answer({0xC6, 0x00, 0x21, 0, 20, 0, 0, 0});
  stall();
  EXPECT_EQ(answer(refusal), (Frames{{0xA4, 0x00, 0x21, 0, 127, 21, 0, 0}}));
  answer({0xC6, 0x00, 0x21, 0, 20, 0, 0, 0});
  give(segments(pattern(20), 0, 2));
  answer(segments(pattern(20), 0, 3)[2]);
  answer(end_request(pattern(20), crc_of(pattern(20))));
  expect_data(numbers(pattern(20)));
}

// The segments were only late, and arrive twice.
TEST_F(ClientBlockTest, SegmentsThatWereAskedForWhileUnderWayAreTakenOnce) {
  begin_upload();
  now += kTimeout * 2 / 5;
  client.advance(now, queue);
  drain(queue, kRequestId);
  give(segments(pattern(20), 0, 2));
  answer(segments(pattern(20), 0, 3)[2]);
  for (const Bytes& again : segments(pattern(20), 0, 3)) {
    EXPECT_EQ(client.receive(frame(kResponseId, again, now), queue), Receipt::stray);
  }
  answer(end_request(pattern(20), crc_of(pattern(20))));
  expect_data(numbers(pattern(20)));
}

TEST_F(ClientBlockTest, WrongFramesInEachState) {
  const Bytes wrong{0x20, 0, 0, 0, 0, 0, 0, 0};
  const Frames refusal{abort_bytes(0x2100, 0, 0x0504'0001)};
  begin_download();
  EXPECT_EQ(answer(wrong), refusal);
  expect_abort(AbortCode::command_specifier);
  client = Client{can::CobId{kRequestId}};
  begin_download();
  answer(block_ack(3, 127));
  EXPECT_EQ(answer(wrong), refusal);
  expect_abort(AbortCode::command_specifier);
  client = Client{can::CobId{kRequestId}};
  begin_upload();
  give(segments(pattern(20), 0, 2));
  answer(segments(pattern(20), 0, 3)[2]);
  EXPECT_EQ(answer(wrong), refusal);
  expect_abort(AbortCode::command_specifier);
}

TEST_F(ClientBlockTest, AbortOfTheServerInEachState) {
  const Bytes abort = abort_bytes(0x2100, 0, 0x0800'0022);
  begin_download();
  EXPECT_EQ(answer(abort), Frames{});
  expect_abort(AbortCode::device_state);
  begin_download();
  answer(block_ack(3, 127));
  EXPECT_EQ(answer(abort), Frames{});
  expect_abort(AbortCode::device_state);
  begin_upload();
  give(segments(pattern(20), 0, 2));
  EXPECT_EQ(answer(abort), Frames{});
  expect_abort(AbortCode::device_state);
  begin_upload();
  give(segments(pattern(20), 0, 2));
  answer(segments(pattern(20), 0, 3)[2]);
  EXPECT_EQ(answer(abort), Frames{});
  expect_abort(AbortCode::device_state);
}

TEST_F(ClientBlockTest, FramesThatCameTwiceAreStrays) {
  const auto value = pattern(70);
  write({0x2100, 0}, value, kInBlocks);
  answer_all({0xA4, 0x00, 0x21, 0, 8, 0, 0, 0});
  EXPECT_EQ(client.receive(frame(kResponseId, block_ack(1, 9), now), queue), Receipt::used);
  EXPECT_EQ(client.receive(frame(kResponseId, block_ack(1, 9), now), queue), Receipt::stray);
  EXPECT_EQ(all(), segments(value, 1, 9));
  answer(block_ack(9, 127));
  EXPECT_EQ(answer(block_ack(9, 127), Receipt::stray), Frames{});
  answer({0xA1, 0, 0, 0, 0, 0, 0, 0});
  expect_data({});

  begin_upload();
  give(segments(pattern(20), 0, 2));
  answer(segments(pattern(20), 0, 3)[2]);
  EXPECT_EQ(answer(segments(pattern(20), 0, 3)[2], Receipt::stray), Frames{});
  answer(end_request(pattern(20), crc_of(pattern(20))));
  expect_data(numbers(pattern(20)));
}

// The last sub-block has as many segments as the one before, so the repeated acknowledgement would
// fit it. The same bytes acknowledge it when its segments were handed out.
TEST_F(ClientBlockTest, AnAcknowledgementTwiceDoesNotAcknowledgeWaitingSegments) {
  const auto value = pattern(28);
  write({0x2100, 0}, value, kInBlocks);
  EXPECT_EQ(answer_all({0xA4, 0x00, 0x21, 0, 2, 0, 0, 0}), segments(value, 0, 2));
  EXPECT_EQ(client.receive(frame(kResponseId, block_ack(2, 9), now), queue), Receipt::used);
  EXPECT_EQ(client.receive(frame(kResponseId, block_ack(2, 9), now), queue), Receipt::stray);
  EXPECT_EQ(all(), segments(value, 2, 2));
  EXPECT_EQ(answer(block_ack(2, 9)), (Frames{end_request(value, crc_of(value))}));
  EXPECT_EQ(answer({0xA1, 0, 0, 0, 0, 0, 0, 0}), Frames{});
  expect_data({});
}

TEST_F(ClientBlockTest, LateSegmentsOfAnAbortedUploadAreStrays) {
  begin_upload();
  give(segments(pattern(20), 0, 1));
  client.abort(AbortCode::general, now, queue);
  drain(queue, kRequestId);
  client.take();
  answer(segments(pattern(20), 0, 3)[1], Receipt::stray);
  read({0x1000, 0});
  answer(segments(pattern(20), 0, 3)[2], Receipt::stray);  // 83h: looks like an abort
  answer({0x43, 0x00, 0x10, 0, 1, 2, 3, 4});
  expect_data({1, 2, 3, 4});
}

TEST_F(ClientBlockTest, AStalledSubBlockIsAcknowledged) {
  begin_upload();
  give(segments(pattern(20), 0, 2));
  EXPECT_EQ(client.next_wake(), now + kTimeout * 2 / 5);
  now += kTimeout * 2 / 5;
  client.advance(now, queue);
  EXPECT_EQ(drain(queue, kRequestId), (Frames{block_ack(2, 64)}));
  EXPECT_EQ(answer({0x81, 15, 16, 17, 18, 19, 20, 0}), (Frames{block_ack(1, 65)}));
  answer(end_request(pattern(20), crc_of(pattern(20))));
  expect_data(numbers(pattern(20)));
}

TEST_F(ClientBlockTest, EachStateTimesOut) {
  const auto gives_up = [this] {
    Frames sent;
    while (client.busy() && now < at(20s)) {
      now = client.next_wake();
      client.advance(now, queue);
      sent = drain(queue, kRequestId);
    }
    EXPECT_EQ(sent, (Frames{abort_bytes(0x2100, 0, 0x0504'0000)}));
    expect_abort(AbortCode::timeout);
  };
  write({0x2100, 0}, pattern(20), kInBlocks);
  gives_up();
  read({0x2100, 0}, kInBlocks);
  gives_up();
  begin_download();
  gives_up();
  begin_download();
  answer(block_ack(3, 127));
  gives_up();
  begin_upload();
  gives_up();
  begin_upload();
  give(segments(pattern(20), 0, 2));
  gives_up();
}

// The server may have stored the value: a repetition would store it twice.
TEST_F(ClientBlockTest, AWriteIsNotRepeatedAfterItsLastSegment) {
  for (const Transfer transfer : {Transfer::block, Transfer::segmented}) {
    write({0x2100, 0}, pattern(7), {.transfer = transfer, .repeats = 3});
    transfer == Transfer::block ? answer_all({0xA4, 0x00, 0x21, 0, 127, 0, 0, 0})
                                : answer({0x60, 0x00, 0x21, 0, 0, 0, 0, 0});
    now += kTimeout;
    client.advance(now, queue);
    EXPECT_EQ(drain(queue, kRequestId), (Frames{abort_bytes(0x2100, 0, 0x0504'0000)}));
    expect_abort(AbortCode::timeout);
  }
}

TEST_F(ClientBlockTest, RepeatsWhereItIsAskedTo) {
  write({0x2100, 0}, pattern(20), {.transfer = Transfer::block, .repeats = 1});
  answer_all({0xA4, 0x00, 0x21, 0, 2, 0, 0, 0});
  now += kTimeout;
  client.advance(now, queue);
  EXPECT_EQ(drain(queue, kRequestId),
            (Frames{abort_bytes(0x2100, 0, 0x0504'0000), {0xC6, 0x00, 0x21, 0, 20, 0, 0, 0}}));
  EXPECT_EQ(answer_all({0xA4, 0x00, 0x21, 0, 2, 0, 0, 0}), segments(pattern(20), 0, 2));
  now += kTimeout;
  client.advance(now, queue);
  EXPECT_EQ(drain(queue, kRequestId), (Frames{abort_bytes(0x2100, 0, 0x0504'0000)}));
  expect_abort(AbortCode::timeout);
  // Only errors that a lost frame can cause.
  read({0x2100, 0}, {.repeats = 1});
  EXPECT_EQ(answer(abort_bytes(0x2100, 0, 0x0602'0000)), Frames{});
  expect_abort(AbortCode::no_object);
}

TEST_F(ClientBlockTest, ReportsTheSegmentsThatTheServerAcknowledged) {
  AcknowledgedSource source(20);
  client.write({0x2100, 0}, source, kTimeout, now, queue, kInBlocks);
  drain(queue, kRequestId);
  answer_all({0xA4, 0x00, 0x21, 0, 2, 0, 0, 0});
  EXPECT_TRUE(source.counts.empty()) << "two segments were only sent";
  answer_all({0xA2, 1, 2, 0, 0, 0, 0, 0});
  EXPECT_EQ(source.counts, (std::vector<std::size_t>{7})) << "the second one was lost";
  answer_all({0xA2, 2, 2, 0, 0, 0, 0, 0});
  EXPECT_EQ(source.counts, (std::vector<std::size_t>{7, 20}));
  answer_all({0xA1, 0, 0, 0, 0, 0, 0, 0});
  expect_data({});
}

}  // namespace
}  // namespace linegate::sdo::test

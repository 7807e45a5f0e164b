// SPDX-License-Identifier: Apache-2.0
// Block transfer of the server compared with the frames of CiA 301, 7.2.4.3.9 to 7.2.4.3.16.
#include <random>

#include "stack/sdo/block.h"

#include "tests/stack/sdo/block_frames.h"
#include "tests/stack/sdo/server_fixture.h"

namespace linegate::sdo::test {
namespace {

class ServerBlockTest : public ServerTest {
 protected:
  // The frames that the server sends until it waits for a request.
  Frames all() {
    Frames out;
    for (bool more = true; more;) {
      const Frames some = drain(queue, kResponseId);
      out.insert(out.end(), some.begin(), some.end());
      more = !some.empty();
      now += 1ms;
      server.advance(now, queue);
    }
    return out;
  }
  Frames ask_all(const Bytes& request) {
    server.receive(frame(kRequestId, request, now), queue);
    return all();
  }
  void give(const Frames& frames) {
    for (const Bytes& each : frames) {
      EXPECT_EQ(ask(each), Bytes{});
    }
  }
  // What the server sends if nothing arrives for its stall.
  Frames stall() {
    now += 200ms;
    server.advance(now, queue);
    return drain(queue, kResponseId);
  }
  // The same until it gives the transfer up.
  Frames until_given_up() {
    Frames out;
    while (server.busy()) {
      if (now >= at(10s)) {
        ADD_FAILURE() << "the server waits endlessly";
        break;
      }
      now = server.next_wake();
      server.advance(now, queue);
      const Frames some = drain(queue, kResponseId);
      out.insert(out.end(), some.begin(), some.end());
    }
    return out;
  }
  // Begins a download of unknown size without a CRC; the client pauses after 20 segments, which are
  // acknowledged.
  void begin_and_pause(const std::vector<std::byte>& value_) {
    set_domain(0);
    ask({0xC0, 0x00, 0x21, 0, 0, 0, 0, 0});
    give(segments(value_, 0, 20));
    EXPECT_EQ(stall(), Frames{block_ack(20, 63)});
  }
  void set_domain(std::size_t size) {
    ASSERT_TRUE(dictionary.set({0x2100, 0}, std::span<const std::byte>(pattern(size))));
  }
  // Begins a download of 20 bytes; the responses are not checked.
  void begin_download() { ask({0xC6, 0x00, 0x21, 0, 20, 0, 0, 0}); }
  void begin_upload(std::uint8_t block_size = 127) {
    ask({0xA4, 0x00, 0x21, 0, block_size, 0, 0, 0});
  }
};

TEST(Crc, CheckValueOf123456789) {
  EXPECT_EQ(crc_of(std::as_bytes(std::span("123456789", 9))), 0x31C3);
  EXPECT_EQ(crc_of({}), 0);
}

TEST_F(ServerBlockTest, Download) {
  const auto value_ = pattern(20);
  EXPECT_EQ(ask({0xC6, 0x00, 0x21, 0, 20, 0, 0, 0}), (Bytes{0xA4, 0x00, 0x21, 0, 127, 0, 0, 0}));
  EXPECT_EQ(ask({0x01, 1, 2, 3, 4, 5, 6, 7}), Bytes{});
  EXPECT_EQ(ask({0x02, 8, 9, 10, 11, 12, 13, 14}), Bytes{});
  EXPECT_EQ(ask({0x83, 15, 16, 17, 18, 19, 20, 0}), block_ack(3, 127));
  EXPECT_EQ(value({0x2100, 0}), Bytes{});
  EXPECT_EQ(ask(end_request(value_, crc_of(value_))), (Bytes{0xA1, 0, 0, 0, 0, 0, 0, 0}));
  EXPECT_EQ(value({0x2100, 0}), numbers(value_));
  EXPECT_EQ(server.counters().downloads, 1U);
  EXPECT_FALSE(server.busy());
  EXPECT_EQ(server.next_wake(), kNever);
}

TEST_F(ServerBlockTest, DownloadWithoutSizeAndCheckSum) {
  const auto value_ = pattern(14);
  EXPECT_EQ(ask({0xC0, 0x00, 0x21, 0, 0, 0, 0, 0}), (Bytes{0xA4, 0x00, 0x21, 0, 127, 0, 0, 0}));
  give(segments(value_, 0, 1));
  EXPECT_EQ(ask({0x82, 8, 9, 10, 11, 12, 13, 14}), block_ack(2, 127));
  EXPECT_EQ(ask(end_request(value_, 0)), (Bytes{0xA1, 0, 0, 0, 0, 0, 0, 0}));
  EXPECT_EQ(value({0x2100, 0}), numbers(value_));
}

TEST_F(ServerBlockTest, DownloadOfFewBytesAndOfNone) {
  ask({0xC6, 0x00, 0x20, 2, 2, 0, 0, 0});
  EXPECT_EQ(ask({0x81, 0xA1, 0xA2, 0, 0, 0, 0, 0}), block_ack(1, 127));
  EXPECT_EQ(ask(end_request(bytes({1, 2}), crc_of(bytes({0xA1, 0xA2}))))[0], 0xA1);
  EXPECT_EQ(value({0x2000, 2}), (Bytes{0xA1, 0xA2}));
  ask({0xC6, 0x00, 0x20, 9, 0, 0, 0, 0});
  EXPECT_EQ(ask({0x81, 0, 0, 0, 0, 0, 0, 0}), block_ack(1, 127));
  EXPECT_EQ(ask({0xDD, 0, 0, 0, 0, 0, 0, 0})[0], 0xA1);
  EXPECT_EQ(value({0x2000, 9}), Bytes{});
}

TEST_F(ServerBlockTest, DownloadOfSeveralSubBlocks) {
  const auto value_ = pattern(300 * 7);
  EXPECT_EQ(ask({0xC6, 0x00, 0x21, 0, 0x34, 0x08, 0, 0})[4], 127);
  give(segments(value_, 0, 126));
  // 173 segments are left: two equal sub-blocks, so that the last one is not short.
  EXPECT_EQ(ask({0x7F, 121, 122, 123, 124, 125, 126, 127})[0], 0xA2);
  EXPECT_EQ(server.next_wake(), now + 200ms);
}

TEST_F(ServerBlockTest, TheLastSubBlockIsNeverShort) {
  const auto value_ = pattern(130 * 7);
  EXPECT_EQ(ask({0xC6, 0x00, 0x21, 0, 0x8E, 0x03, 0, 0})[4], 65);
  give(segments(value_, 0, 64));
  EXPECT_EQ(ask(segments(value_, 0, 65).back()), block_ack(65, 127));
  give(segments(value_, 65, 64));
  EXPECT_EQ(ask(segments(value_, 65, 65).back()), block_ack(65, 127));
  EXPECT_EQ(ask(end_request(value_, crc_of(value_)))[0], 0xA1);
  EXPECT_EQ(value({0x2100, 0}), numbers(value_));
}

TEST_F(ServerBlockTest, WhatIsLostComesInTheNextSubBlock) {
  const auto value_ = pattern(70);
  const Frames sent = segments(value_, 0, 10);
  for (std::size_t lost = 0; lost < 10; ++lost) {
    SCOPED_TRACE(lost);
    set_domain(0);
    ask({0xC6, 0x00, 0x21, 0, 70, 0, 0, 0});
    Bytes answer;
    for (std::size_t i = 0; i < 10; ++i) {
      answer = i == lost ? answer : ask(sent[i]);
    }
    if (lost == 9) {  // the last segment was not received
      EXPECT_EQ(answer, Bytes{});
      server.advance(now + 199ms, queue);
      EXPECT_EQ(drain(queue, kResponseId), Frames{});
      server.advance(now + 200ms, queue);
      answer = drain(queue, kResponseId).at(0);
    }
    EXPECT_EQ(answer, block_ack(static_cast<std::uint8_t>(lost), 63));
    for (const Bytes& each : segments(value_, lost, 10 - lost)) {
      answer = ask(each);
    }
    EXPECT_EQ(answer, block_ack(static_cast<std::uint8_t>(10 - lost), 64));
    EXPECT_EQ(ask(end_request(value_, crc_of(value_)))[0], 0xA1);
    EXPECT_EQ(value({0x2100, 0}), numbers(value_));
  }
}

// The block size is halved after a sub-block with a loss, and increased by one after a sub-block
// without.
TEST_F(ServerBlockTest, TheBlockSizeFollowsLosses) {
  const auto value_ = pattern(7000);
  set_domain(0);
  ask({0xC0, 0x00, 0x21, 0, 0, 0, 0, 0});
  std::size_t begin = 0;
  // Returns the next block size. lost: number of the lost segment, 0 = none.
  const auto sub_block = [&](std::size_t size, std::size_t lost) {
    const Frames sent = segments(value_, begin, size);
    Bytes answer;
    for (std::size_t i = 0; i < size; ++i) {
      answer = i + 1 == lost ? answer : ask(sent[i]);
    }
    const std::size_t in_order = lost == 0 ? size : lost - 1;
    EXPECT_EQ(answer[1], in_order);
    begin += in_order;
    return unsigned{answer[2]};
  };
  EXPECT_EQ(sub_block(127, 0), 127U);
  EXPECT_EQ(sub_block(127, 50), 63U);
  EXPECT_EQ(sub_block(63, 0), 64U);
  EXPECT_EQ(sub_block(64, 0), 65U);
  EXPECT_EQ(sub_block(65, 1), 32U);
  EXPECT_EQ(sub_block(32, 31), 16U);
  EXPECT_EQ(sub_block(16, 9), 8U);
  EXPECT_EQ(sub_block(8, 2), 8U) << "the minimum block size";
  EXPECT_EQ(sub_block(8, 0), 9U);
  // A known remainder that does not fit is divided into two halves, so that neither of them is
  // short.
  EXPECT_EQ(BlockReceiver::best_block_size(7 * 15, 9), 8U);
  EXPECT_EQ(BlockReceiver::best_block_size(7 * 18, 9), 9U);
  EXPECT_EQ(BlockReceiver::best_block_size(7 * 9, 9), 9U);
}

// Without previous losses a client may pause; after losses a missing segment was probably lost.
TEST_F(ServerBlockTest, AfterALossTheEndOfASubBlockIsMissedSoon) {
  const auto value_ = pattern(7000);
  set_domain(0);
  ask({0xC0, 0x00, 0x21, 0, 0, 0, 0, 0});
  const auto give_slowly = [&](const Frames& sent, std::size_t lost, Duration gap) {
    Bytes answer;
    for (std::size_t i = 0; i < sent.size(); ++i) {
      now += gap;
      answer = i + 1 == lost ? answer : ask(sent[i]);
    }
    return answer;
  };
  EXPECT_EQ(give_slowly(segments(value_, 0, 126), 0, 100us), Bytes{});
  EXPECT_EQ(server.next_wake(), now + 200ms) << "no loss yet";
  EXPECT_EQ(ask(segments(value_, 0, 127).back()), block_ack(127, 127));
  EXPECT_EQ(give_slowly(segments(value_, 127, 127), 7, 100us), block_ack(6, 63));
  EXPECT_EQ(server.next_wake(), now + 200ms) << "the client may need time for its next sub-block";
  EXPECT_EQ(give_slowly(segments(value_, 133, 62), 0, 100us), Bytes{});
  EXPECT_EQ(server.next_wake(), now + 10ms);
  now = server.next_wake();
  server.advance(now, queue);
  EXPECT_EQ(drain(queue, kResponseId), Frames{block_ack(62, 31)});
  EXPECT_EQ(give_slowly(segments(value_, 195, 30), 0, 10ms), Bytes{});
  EXPECT_EQ(server.next_wake(), now + 200ms) << "a slow client has more time";
}

// The late segments have the numbers of the sub-block that was acknowledged without them.
TEST_F(ServerBlockTest, SegmentsMayComeAfterAllWithMoreThanTheNextSubBlockHas) {
  const auto value_ = pattern(70 * 7);
  set_domain(0);
  ask({0xC0, 0x00, 0x21, 0, 0, 0, 0, 0});
  const Frames sent = segments(pattern(7000), 0, 127);
  give({sent.begin(), sent.begin() + 20});
  EXPECT_EQ(stall(), Frames{block_ack(20, 63)});
  give({sent.begin() + 100, sent.end()});
  const Frames rest = segments(value_, 20, 50);
  give({rest.begin(), rest.end() - 1});
  EXPECT_EQ(ask(rest.back()), block_ack(50, 64));
}

// Until a segment comes that cannot be late, because its number is not above those received before.
TEST_F(ServerBlockTest, SegmentsThatMayBeLateAreNotThoseOfTheNextSubBlock) {
  const auto value_ = pattern(70 * 7);
  const Frames sent = segments(value_, 0, 70);
  begin_and_pause(value_);
  give({sent.begin() + 20, sent.end()});
  EXPECT_EQ(server.next_wake(), now + 200ms);
  EXPECT_EQ(stall(), Frames{}) << "the acknowledgement was not read yet";
  const Frames rest = segments(value_, 20, 50);
  give({rest.begin(), rest.end() - 1});
  EXPECT_EQ(ask(rest.back()), block_ack(50, 64));
  EXPECT_EQ(ask(end_request(value_, 0))[0], 0xA1);
  EXPECT_EQ(value({0x2100, 0}), numbers(value_));
}

// A loss is still found by the segments that cannot be late.
TEST_F(ServerBlockTest, TheFirstSegmentAfterAnEarlyAcknowledgementMayBeLost) {
  const auto value_ = pattern(70 * 7);
  begin_and_pause(value_);
  const Frames rest = segments(value_, 20, 50);
  give({rest.begin() + 1, rest.end() - 1});
  EXPECT_EQ(ask(rest.back()), block_ack(0, 31));
}

TEST_F(ServerBlockTest, ASegmentTwiceAfterAnEarlyAcknowledgementIsIgnored) {
  ask({0xC4, 0x00, 0x21, 0, 0, 0, 0, 0});
  const Frames sent = segments(pattern(7000), 0, 127);
  give({sent.begin(), sent.begin() + 100});
  EXPECT_EQ(stall(), Frames{block_ack(100, 63)});
  give({sent[99]});
}

// No. 34 looks like a write of 1017h.
TEST_F(ServerBlockTest, LateSegmentsAfterAResetAreNoRequests) {
  std::vector<std::byte> value_ = pattern(70 * 7);
  std::ranges::copy(bytes({0x17, 0x10, 0, 0x55, 0, 0, 0}), value_.begin() + 33 * 7);
  const Frames sent = segments(value_, 0, 70);
  begin_and_pause(value_);
  give({sent.begin() + 20, sent.begin() + 30});
  server.reset();
  give({sent.begin() + 30, sent.end()});
}

// What is refused is no segment: those behind it still are.
TEST_F(ServerBlockTest, SegmentsAfterAWrongNumberAreNoRequests) {
  std::vector<std::byte> value_ = pattern(63 * 7);
  std::ranges::copy(bytes({0x17, 0x10, 0, 0x55, 0, 0, 0}), value_.begin() + 33 * 7);
  const Frames sent = segments(value_, 0, 63);
  for (const std::uint8_t wrong : {std::uint8_t{0}, std::uint8_t{0x7F}}) {
    SCOPED_TRACE(unsigned{wrong});
    ask({0xC0, 0x00, 0x21, 0, 0, 0, 0, 0});
    const Frames before = segments(pattern(7000), 0, 127);
    give({before.begin() + 1, before.end() - 1});
    EXPECT_EQ(ask(before.back()), block_ack(0, 63)) << "the first was lost";
    give({sent.begin(), sent.begin() + 20});
    EXPECT_EQ(ask({wrong, 0, 0, 0, 0, 0, 0, 0}), abort_bytes(0x2100, 0, 0x0504'0003));
    give({sent.begin() + 20, sent.end()});
  }
}

// A client ignores an equal acknowledgement within a sub-block, as a repeated frame.
TEST_F(ServerBlockTest, AnEarlyAcknowledgementDiffersFromThePrevious) {
  const auto value_ = pattern(7000);
  set_domain(0);
  ask({0xC0, 0x00, 0x21, 0, 0, 0, 0, 0});
  Frames acknowledgements;
  for (std::size_t begin = 0; begin < 35; begin += 5) {
    give(segments(value_, begin, 5));
    now = server.next_wake();
    server.advance(now, queue);
    acknowledgements.push_back(drain(queue, kResponseId).at(0));
  }
  EXPECT_EQ(acknowledgements,
            (Frames{block_ack(5, 63), block_ack(5, 31), block_ack(5, 15), block_ack(5, 8),
                    block_ack(5, 7), block_ack(5, 8), block_ack(5, 7)}));
}

TEST_F(ServerBlockTest, AllOfAShortSubBlockMayBeLost) {
  const auto value_ = pattern(14);
  ask({0xC6, 0x00, 0x21, 0, 14, 0, 0, 0});
  for (int i = 0; i < 2; ++i) {
    EXPECT_EQ(stall(), (Frames{block_ack(0, 127)}));
  }
  ask(segments(value_, 0, 2)[0]);
  EXPECT_EQ(ask(segments(value_, 0, 2)[1]), block_ack(2, 127));
  EXPECT_EQ(ask(end_request(value_, crc_of(value_)))[0], 0xA1);
}

// Without a CRC nothing would reveal a repetition that began elsewhere.
TEST_F(ServerBlockTest, NothingIsRequestedAgainWithoutACheckSum) {
  ask({0xC2, 0x00, 0x21, 0, 14, 0, 0, 0});
  EXPECT_EQ(until_given_up(), (Frames{abort_bytes(0x2100, 0, 0x0504'0000)}));
}

// Few segments were requested again, and were only late: they come twice.
TEST_F(ServerBlockTest, SegmentsThatWereRequestedTwiceAreIgnoredAfterTheLast) {
  const auto value_ = pattern(20);
  const Frames sent = segments(value_, 0, 3);
  ask({0xC6, 0x00, 0x21, 0, 20, 0, 0, 0});
  EXPECT_EQ(stall(), (Frames{block_ack(0, 127)}));
  give({sent[0], sent[1]});
  EXPECT_EQ(ask(sent[2]), block_ack(3, 127));
  give(sent);
  EXPECT_EQ(ask(end_request(value_, crc_of(value_)))[0], 0xA1);
  EXPECT_EQ(value({0x2100, 0}), numbers(value_));
}

TEST_F(ServerBlockTest, ASilentClientIsGivenUp) {
  ask({0xC6, 0x00, 0x21, 0, 14, 0, 0, 0});
  EXPECT_EQ(until_given_up(),
            (Frames{block_ack(0, 127), block_ack(0, 127), abort_bytes(0x2100, 0, 0x0504'0000)}));
}

TEST_F(ServerBlockTest, ASegmentTwiceIsTakenOnce) {
  const auto value_ = pattern(21);
  ask({0xC2, 0x00, 0x21, 0, 21, 0, 0, 0});
  for (const Bytes& each : segments(value_, 0, 2)) {
    give({each, each});
  }
  EXPECT_EQ(ask(segments(value_, 0, 3)[2]), block_ack(3, 127));
  EXPECT_EQ(ask(segments(value_, 0, 3)[2]), Bytes{});
  EXPECT_EQ(ask(end_request(value_, 0))[0], 0xA1);
  EXPECT_EQ(value({0x2100, 0}), numbers(value_));
}

TEST_F(ServerBlockTest, AWrongCheckSum) {
  const auto value_ = pattern(20);
  begin_download();
  give(segments(value_, 0, 2));
  ask(segments(value_, 0, 3)[2]);
  EXPECT_EQ(ask(end_request(value_, static_cast<std::uint16_t>(crc_of(value_) ^ 1U))),
            abort_bytes(0x2100, 0, 0x0504'0004));
  EXPECT_EQ(value({0x2100, 0}), Bytes{});
  EXPECT_FALSE(server.busy());
}

TEST_F(ServerBlockTest, ASequenceNumberThereIsNot) {
  begin_download();
  EXPECT_EQ(ask({0x00, 1, 2, 3, 4, 5, 6, 7}), abort_bytes(0x2100, 0, 0x0504'0003));
  EXPECT_FALSE(server.busy());
  ask({0xC6, 0x00, 0x21, 0, 0x8E, 0x03, 0, 0});  // 65 segments in a sub-block
  EXPECT_EQ(ask({66, 1, 2, 3, 4, 5, 6, 7}), abort_bytes(0x2100, 0, 0x0504'0003));
}

// The acknowledgement of a client that receives blocks looks like segment 34, which is the last
// one: without a limit each side would answer the other endlessly.
TEST_F(ServerBlockTest, SubBlocksWithoutTheirFirstSegmentDoNotGoOnForEver) {
  const Bytes eighth{0x88, 0, 0, 0, 0, 0, 0, 0};
  begin_download();
  for (const unsigned size : {63U, 31U, 15U, 8U, 8U, 8U, 8U, 8U}) {
    EXPECT_EQ(ask(eighth), block_ack(0, static_cast<std::uint8_t>(size)));
  }
  EXPECT_EQ(ask(eighth), abort_bytes(0x2100, 0, 0x0504'0003));
  EXPECT_FALSE(server.busy());
  // The other side also receives blocks: its acknowledgement is segment 34 for this server.
  begin_download();
  EXPECT_EQ(ask(block_ack(0, 127)), block_ack(0, 63));
  EXPECT_EQ(ask(block_ack(0, 127)), block_ack(0, 31));
  EXPECT_EQ(ask(block_ack(0, 127)), abort_bytes(0x2100, 0, 0x0504'0003));
  EXPECT_FALSE(server.busy());
}

TEST_F(ServerBlockTest, LengthOfABlockDownload) {
  EXPECT_EQ(ask({0xC6, 0x00, 0x20, 5, 9, 0, 0, 0}), abort_bytes(0x2000, 5, 0x0607'0012));
  EXPECT_EQ(ask({0xC6, 0x00, 0x20, 5, 7, 0, 0, 0}), abort_bytes(0x2000, 5, 0x0607'0013));
  EXPECT_EQ(ask({0xC6, 0x00, 0x21, 0, 0x21, 0x4E, 0, 0}), abort_bytes(0x2100, 0, 0x0504'0005));
  // More bytes than announced, and fewer.
  ask({0xC6, 0x00, 0x21, 0, 10, 0, 0, 0});
  give(segments(pattern(40), 0, 2));
  EXPECT_EQ(ask(segments(pattern(40), 0, 3)[2]), abort_bytes(0x2100, 0, 0x0607'0012));
  ask({0xC6, 0x00, 0x21, 0, 10, 0, 0, 0});
  ask({0x81, 1, 2, 3, 4, 5, 6, 7});
  EXPECT_EQ(ask({0xC1, 0, 0, 0, 0, 0, 0, 0}), abort_bytes(0x2100, 0, 0x0504'0004));
  ask({0xC2, 0x00, 0x21, 0, 10, 0, 0, 0});
  ask({0x81, 1, 2, 3, 4, 5, 6, 7});
  EXPECT_EQ(ask({0xC1, 0, 0, 0, 0, 0, 0, 0}), abort_bytes(0x2100, 0, 0x0607'0013));
}

TEST_F(ServerBlockTest, RightsAndExistence) {
  EXPECT_EQ(ask({0xC6, 0x34, 0x12, 0, 8, 0, 0, 0}), abort_bytes(0x1234, 0, 0x0602'0000));
  EXPECT_EQ(ask({0xC6, 0x00, 0x20, 10, 8, 0, 0, 0}), abort_bytes(0x2000, 10, 0x0609'0011));
  EXPECT_EQ(ask({0xC6, 0x08, 0x10, 0, 8, 0, 0, 0}), abort_bytes(0x1008, 0, 0x0601'0002));
  EXPECT_EQ(ask({0xA4, 0x34, 0x12, 0, 127, 0, 0, 0}), abort_bytes(0x1234, 0, 0x0602'0000));
  EXPECT_EQ(ask({0xA4, 0x00, 0x20, 6, 127, 0, 0, 0}), abort_bytes(0x2000, 6, 0x0601'0001));
}

// Segments look like requests: 22h and 23h would write to the object that their data addresses.
TEST_F(ServerBlockTest, LateSegmentsOfAnAbortedDownloadAreNotTakenForRequests) {
  ask({0xC2, 0x00, 0x21, 0, 200, 0, 0, 0});
  Frames sent = segments(pattern(127 * 7), 0, 40);
  sent[33] = {0x22, 0x00, 0x20, 4, 0xEE, 0xEE, 0xEE, 0xEE};  // segment 34
  Frames answers;
  for (const Bytes& each : sent) {
    const Bytes answer = ask(each);
    if (!answer.empty()) {
      answers.push_back(answer);
    }
  }
  EXPECT_EQ(answers, (Frames{abort_bytes(0x2100, 0, 0x0607'0012)}));
  EXPECT_EQ(value({0x2000, 4}), (Bytes{0x41, 0x42, 0x43, 0x44}));
  EXPECT_FALSE(server.busy());
  EXPECT_EQ(ask({0x21, 0x00, 0x20, 5, 8, 0, 0, 0})[0], 0x60);
}

TEST_F(ServerBlockTest, ARequestAfterTheLateSegmentsIsARequest) {
  begin_download();
  ask({0x00, 0, 0, 0, 0, 0, 0, 0});
  EXPECT_EQ(ask({0x01, 0, 0, 0, 0, 0, 0, 0}), Bytes{});
  now += LateSegments::kQuiet;
  EXPECT_EQ(ask({0x02, 0, 0, 0, 0, 0, 0, 0}), abort_bytes(0, 0, 0x0504'0001));
}

TEST_F(ServerBlockTest, Upload) {
  set_domain(20);
  EXPECT_EQ(ask({0xA4, 0x00, 0x21, 0, 127, 0, 0, 0}), (Bytes{0xC6, 0x00, 0x21, 0, 20, 0, 0, 0}));
  EXPECT_EQ(ask_all({0xA3, 0, 0, 0, 0, 0, 0, 0}), segments(pattern(20), 0, 3));
  EXPECT_EQ(ask(block_ack(3, 127)), end_request(pattern(20), crc_of(pattern(20))));
  EXPECT_TRUE(server.busy());
  EXPECT_EQ(ask({0xA1, 0, 0, 0, 0, 0, 0, 0}), Bytes{});
  EXPECT_FALSE(server.busy());
  EXPECT_EQ(server.counters().uploads, 1U);
  EXPECT_EQ(server.next_wake(), kNever);
}

TEST_F(ServerBlockTest, UploadWithoutCheckSum) {
  set_domain(14);
  EXPECT_EQ(ask({0xA0, 0x00, 0x21, 0, 2, 0, 0, 0}), (Bytes{0xC6, 0x00, 0x21, 0, 14, 0, 0, 0}));
  EXPECT_EQ(ask_all({0xA3, 0, 0, 0, 0, 0, 0, 0}), segments(pattern(14), 0, 2));
  EXPECT_EQ(ask(block_ack(2, 127)), end_request(pattern(14), 0));
}

TEST_F(ServerBlockTest, UploadOfAnEmptyValue) {
  EXPECT_EQ(ask({0xA4, 0x00, 0x20, 8, 127, 0, 0, 0}), (Bytes{0xC6, 0x00, 0x20, 8, 0, 0, 0, 0}));
  EXPECT_EQ(ask_all({0xA3, 0, 0, 0, 0, 0, 0, 0}), (Frames{{0x81, 0, 0, 0, 0, 0, 0, 0}}));
  EXPECT_EQ(ask(block_ack(1, 127)), (Bytes{0xDD, 0, 0, 0, 0, 0, 0, 0}));
}

TEST_F(ServerBlockTest, UploadInSubBlocksOfTheClientsSize) {
  set_domain(70);
  begin_upload(4);
  EXPECT_EQ(ask_all({0xA3, 0, 0, 0, 0, 0, 0, 0}), segments(pattern(70), 0, 4));
  EXPECT_EQ(ask_all(block_ack(4, 3)), segments(pattern(70), 4, 3));
  EXPECT_EQ(ask_all(block_ack(1, 127)), segments(pattern(70), 5, 5));
  EXPECT_EQ(ask_all(block_ack(0, 127)), segments(pattern(70), 5, 5));
  EXPECT_EQ(ask_all(block_ack(5, 1)), (Frames{end_request(pattern(70), crc_of(pattern(70)))}));
}

TEST_F(ServerBlockTest, TheProtocolSwitchThreshold) {
  set_domain(20);
  EXPECT_EQ(ask({0xA4, 0x00, 0x21, 0, 127, 19, 0, 0})[0], 0xC6);
  EXPECT_EQ(ask({0xA4, 0x00, 0x21, 0, 127, 20, 0, 0}), (Bytes{0x41, 0x00, 0x21, 0, 20, 0, 0, 0}));
  EXPECT_EQ(ask({0x60, 0, 0, 0, 0, 0, 0, 0}), (Bytes{0x00, 1, 2, 3, 4, 5, 6, 7}));
  EXPECT_EQ(ask({0xA4, 0x00, 0x20, 2, 127, 4, 0, 0}),
            (Bytes{0x4B, 0x00, 0x20, 2, 0x21, 0x22, 0, 0}));
  EXPECT_FALSE(server.busy());
}

TEST_F(ServerBlockTest, BlockSizesThereAreNot) {
  set_domain(20);
  EXPECT_EQ(ask({0xA4, 0x00, 0x21, 0, 0, 0, 0, 0}), abort_bytes(0x2100, 0, 0x0504'0002));
  EXPECT_EQ(ask({0xA4, 0x00, 0x21, 0, 128, 0, 0, 0}), abort_bytes(0x2100, 0, 0x0504'0002));
  for (const std::uint8_t wrong : {std::uint8_t{0}, std::uint8_t{128}}) {
    begin_upload(2);
    ask_all({0xA3, 0, 0, 0, 0, 0, 0, 0});
    EXPECT_EQ(ask(block_ack(2, wrong)), abort_bytes(0x2100, 0, 0x0504'0002));
    EXPECT_FALSE(server.busy());
  }
}

// ackseq 0 and the acknowledgement crossed the segments: both are of the first transmission.
TEST_F(ServerBlockTest, AnAcknowledgementMayPrecedeTheRepetition) {
  constexpr std::uint8_t kSegments = 43;  // more than are sent at once
  const auto value_ = pattern(kSegments * 7);
  set_domain(value_.size());
  begin_upload();
  EXPECT_EQ(ask_all({0xA3, 0, 0, 0, 0, 0, 0, 0}), segments(value_, 0, kSegments));
  server.receive(frame(kRequestId, block_ack(0, 127), now), queue);
  server.receive(frame(kRequestId, block_ack(kSegments, 127), now), queue);
  Frames repeated = segments(value_, 0, kSegments);
  repeated.push_back(end_request(value_, crc_of(value_)));
  EXPECT_EQ(all(), repeated);
  EXPECT_EQ(ask({0xA1, 0, 0, 0, 0, 0, 0, 0}), Bytes{});
  EXPECT_EQ(server.counters().uploads, 1U);
}

// Nothing would reveal that the client took the repetition for new segments.
TEST_F(ServerBlockTest, WithoutACheckSumAnAcknowledgementDoesNotPrecedeTheRepetition) {
  constexpr std::uint8_t kSegments = 43;
  set_domain(kSegments * 7);
  ask({0xA0, 0x00, 0x21, 0, 127, 0, 0, 0});
  EXPECT_EQ(ask_all({0xA3, 0, 0, 0, 0, 0, 0, 0}).size(), kSegments);
  server.receive(frame(kRequestId, block_ack(0, 127), now), queue);
  server.receive(frame(kRequestId, block_ack(kSegments, 127), now), queue);
  EXPECT_EQ(all().back(), abort_bytes(0x2100, 0, 0x0504'0003));
}

TEST_F(ServerBlockTest, AnAcknowledgementOfMoreThanIsRepeatedIsRefused) {
  set_domain(35);
  begin_upload();
  EXPECT_EQ(ask_all({0xA3, 0, 0, 0, 0, 0, 0, 0}), segments(pattern(35), 0, 5));
  EXPECT_EQ(ask_all(block_ack(0, 3)), segments(pattern(35), 0, 3));
  EXPECT_EQ(ask(block_ack(5, 3)), abort_bytes(0x2100, 0, 0x0504'0003));
}

TEST_F(ServerBlockTest, MoreAcknowledgedThanSent) {
  set_domain(20);
  begin_upload(2);
  ask_all({0xA3, 0, 0, 0, 0, 0, 0, 0});
  EXPECT_EQ(ask(block_ack(3, 127)), abort_bytes(0x2100, 0, 0x0504'0003));
}

TEST_F(ServerBlockTest, FramesTwiceInAnUpload) {
  set_domain(70);
  begin_upload(8);
  EXPECT_EQ(ask_all({0xA3, 0, 0, 0, 0, 0, 0, 0}), segments(pattern(70), 0, 8));
  EXPECT_EQ(ask_all({0xA3, 0, 0, 0, 0, 0, 0, 0}), Frames{});
  server.receive(frame(kRequestId, block_ack(1, 9), now), queue);
  server.receive(frame(kRequestId, block_ack(1, 9), now), queue);  // while it is sending
  EXPECT_EQ(all(), segments(pattern(70), 1, 9));
  EXPECT_EQ(ask(block_ack(9, 127)), end_request(pattern(70), crc_of(pattern(70))));
  EXPECT_EQ(ask(block_ack(9, 127)), Bytes{});
  ask({0xA1, 0, 0, 0, 0, 0, 0, 0});
  EXPECT_EQ(server.counters().uploads, 1U);
}

// The last sub-block has as many segments as the one before, so the repeated acknowledgement would
// fit it. The same bytes acknowledge it when its segments were handed out.
TEST_F(ServerBlockTest, AnAcknowledgementTwiceDoesNotAcknowledgeWaitingSegments) {
  set_domain(28);
  begin_upload(2);
  EXPECT_EQ(ask_all({0xA3, 0, 0, 0, 0, 0, 0, 0}), segments(pattern(28), 0, 2));
  server.receive(frame(kRequestId, block_ack(2, 2), now), queue);
  server.receive(frame(kRequestId, block_ack(2, 2), now), queue);
  EXPECT_EQ(all(), segments(pattern(28), 2, 2));
  EXPECT_EQ(ask(block_ack(2, 2)), end_request(pattern(28), crc_of(pattern(28))));
}

// Frames that are wrong in the state: the response to them, and that the transfer has ended.
TEST_F(ServerBlockTest, WrongFramesInEachState) {
  set_domain(20);
  const Bytes start{0xA3, 0, 0, 0, 0, 0, 0, 0};
  const Bytes wrong_abort = abort_bytes(0x2100, 0, 0x0504'0001);
  const auto segment_requests = {Bytes{0x60, 0, 0, 0, 0, 0, 0, 0}, Bytes{0x00, 1, 2, 3, 4, 5, 6, 7},
                                 Bytes{0xE0, 0, 0, 0, 0, 0, 0, 0}};
  for (const Bytes& wrong : segment_requests) {
    begin_upload();
    EXPECT_EQ(ask(wrong), wrong_abort);  // before the start
    begin_upload();
    ask_all(start);
    EXPECT_EQ(ask(wrong), wrong_abort);  // instead of an acknowledgement
    begin_upload();
    ask_all(start);
    ask(block_ack(3, 127));
    EXPECT_EQ(ask(wrong), wrong_abort);  // instead of the end
    begin_download();
    give(segments(pattern(20), 0, 2));
    ask(segments(pattern(20), 0, 3)[2]);
    EXPECT_EQ(ask(wrong), wrong_abort);  // instead of the end
    EXPECT_FALSE(server.busy());
  }
  begin_upload();
  EXPECT_EQ(ask(block_ack(0, 127)), wrong_abort);
  begin_upload();
  EXPECT_EQ(ask({0xA1, 0, 0, 0, 0, 0, 0, 0}), wrong_abort);
  for (const std::uint8_t command : Bytes{0xA1, 0xA2, 0xA3, 0xC1}) {  // frames without a transfer
    EXPECT_EQ(ask({command, 0xFF, 0xFF, 0xFF, 0, 0, 0, 0}), abort_bytes(0, 0, 0x0504'0001));
  }
}

TEST_F(ServerBlockTest, ANewInitiateDropsABlockTransfer) {
  set_domain(20);
  const Bytes read{0x40, 0x01, 0x10, 0, 0, 0, 0, 0};
  const Bytes answer{0x4F, 0x01, 0x10, 0, 0x7F, 0, 0, 0};
  begin_upload();
  EXPECT_EQ(ask(read), answer);
  begin_upload();
  ask_all({0xA3, 0, 0, 0, 0, 0, 0, 0});
  EXPECT_EQ(ask(read), answer);
  begin_download();
  give(segments(pattern(20), 0, 2));
  ask(segments(pattern(20), 0, 3)[2]);
  EXPECT_EQ(ask(read), answer);
  EXPECT_EQ(server.counters().aborts, 3U);
  begin_upload();
  EXPECT_EQ(ask({0xC6, 0x00, 0x21, 0, 20, 0, 0, 0})[0], 0xA4);
  EXPECT_EQ(value({0x2100, 0}), numbers(pattern(20)));
}

TEST_F(ServerBlockTest, AnAbortOfTheClientEndsEachState) {
  set_domain(20);
  const Bytes abort = abort_bytes(0x2100, 0, 0x0800'0000);
  begin_upload();
  EXPECT_EQ(ask(abort), Bytes{});
  EXPECT_FALSE(server.busy());
  begin_upload();
  ask_all({0xA3, 0, 0, 0, 0, 0, 0, 0});
  EXPECT_EQ(ask(abort), Bytes{});
  EXPECT_FALSE(server.busy());
  begin_download();
  give(segments(pattern(20), 0, 2));
  EXPECT_EQ(ask(abort), Bytes{});
  EXPECT_FALSE(server.busy());
  EXPECT_EQ(server.counters().aborts, 3U);
}

TEST_F(ServerBlockTest, EachStateTimesOut) {
  set_domain(20);
  const auto gives_up = [this] {
    const Instant wake = now + kTimeout;
    server.advance(wake - 2ms, queue);
    drain(queue, kResponseId);
    EXPECT_TRUE(server.busy());
    now = wake;
    server.advance(now, queue);
    EXPECT_EQ(drain(queue, kResponseId), (Frames{abort_bytes(0x2100, 0, 0x0504'0000)}));
    EXPECT_FALSE(server.busy());
    EXPECT_EQ(server.next_wake(), kNever);
  };
  begin_upload();
  gives_up();
  begin_upload(2);
  server.receive(frame(kRequestId, {0xA3, 0, 0, 0, 0, 0, 0, 0}, now), queue);
  gives_up();
  begin_upload(3);
  server.receive(frame(kRequestId, {0xA3, 0, 0, 0, 0, 0, 0, 0}, now), queue);
  drain(queue, kResponseId);
  ask(block_ack(3, 127));
  gives_up();
  begin_download();
  give(segments(pattern(20), 0, 2));
  ask(segments(pattern(20), 0, 3)[2]);
  gives_up();
}

TEST_F(ServerBlockTest, AFullQueueDelaysSegments) {
  set_domain(70);
  begin_upload();
  server.receive(frame(kRequestId, {0xA3, 0, 0, 0, 0, 0, 0, 0}, now), queue);
  EXPECT_EQ(queue.room(can::TransmitClass::sdo), 0U);
  EXPECT_EQ(server.next_wake(), now + 1ms);
  server.advance(now + 1ms, queue);
  EXPECT_EQ(server.next_wake(), now + 2ms);
  now += 1ms;
  EXPECT_EQ(all(), segments(pattern(70), 0, 10));
}

TEST_F(ServerBlockTest, MalformedFramesDoNotDisturbATransfer) {
  begin_download();
  give(segments(pattern(20), 0, 2));
  EXPECT_EQ(ask({0x83, 1, 2}), Bytes{});
  EXPECT_EQ(server.counters().malformed, 1U);
  EXPECT_EQ(drain(events).at(0).kind(), EventKind::malformed_frame);
  EXPECT_EQ(ask(segments(pattern(20), 0, 3)[2]), block_ack(3, 127));
}

TEST_F(ServerBlockTest, RandomFramesNeverBreakABlockTransfer) {
  std::mt19937 random(99);
  std::uniform_int_distribution<unsigned> any(0, 255);
  for (int round = 0; round < 4'000; ++round) {
    round % 2 == 0 ? begin_upload(5) : begin_download();
    if (round % 4 == 0) {
      ask_all({0xA3, 0, 0, 0, 0, 0, 0, 0});
    }
    for (int i = 0; i < 3; ++i) {
      Bytes request(8);
      for (std::uint8_t& b : request) {
        b = static_cast<std::uint8_t>(any(random));
      }
      ask_all(request);
    }
    now += 500ms;
    server.advance(now, queue);
    ask(abort_bytes(0, 0, 0x0800'0000));
    drain(queue, kResponseId);
    ASSERT_EQ(ask({0x40, 0x01, 0x10, 0, 0, 0, 0, 0}), (Bytes{0x4F, 0x01, 0x10, 0, 0x7F, 0, 0, 0}))
        << "round " << round;
    drain(events);
  }
}

}  // namespace
}  // namespace linegate::sdo::test

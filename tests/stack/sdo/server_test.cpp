// SPDX-License-Identifier: Apache-2.0
// The server compared with the frames of CiA 301, 7.2.4.3.
#include "tests/stack/sdo/server_fixture.h"

namespace linegate::sdo::test {
namespace {

TEST_F(ServerTest, ExpeditedUploadTellsTheSize) {
  EXPECT_EQ(ask({0x40, 0x00, 0x20, 1, 0, 0, 0, 0}), (Bytes{0x4F, 0x00, 0x20, 1, 0x11, 0, 0, 0}));
  EXPECT_EQ(ask({0x40, 0x00, 0x20, 2, 0, 0, 0, 0}), (Bytes{0x4B, 0x00, 0x20, 2, 0x21, 0x22, 0, 0}));
  EXPECT_EQ(ask({0x40, 0x00, 0x20, 3, 0, 0, 0, 0}),
            (Bytes{0x47, 0x00, 0x20, 3, 0x31, 0x32, 0x33, 0}));
  EXPECT_EQ(ask({0x40, 0x00, 0x20, 4, 0, 0, 0, 0}),
            (Bytes{0x43, 0x00, 0x20, 4, 0x41, 0x42, 0x43, 0x44}));
  EXPECT_EQ(server.counters().uploads, 4U);
  EXPECT_FALSE(server.busy());
}

TEST_F(ServerTest, ReservedBytesOfARequestDoNotMatter) {
  EXPECT_EQ(ask({0x5F, 0x00, 0x10, 0, 9, 9, 9, 9}), (Bytes{0x43, 0x00, 0x10, 0, 1, 2, 3, 4}));
}

TEST_F(ServerTest, SegmentedUploadAlternatesTheToggleBit) {
  EXPECT_EQ(ask({0x40, 0x08, 0x10, 0, 0, 0, 0, 0}), (Bytes{0x41, 0x08, 0x10, 0, 15, 0, 0, 0}));
  EXPECT_TRUE(server.busy());
  EXPECT_EQ(ask({0x60, 0, 0, 0, 0, 0, 0, 0}), (Bytes{0x00, 'L', 'i', 'n', 'e', 'g', 'a', 't'}));
  EXPECT_EQ(ask({0x70, 0, 0, 0, 0, 0, 0, 0}), (Bytes{0x10, 'e', ' ', 'd', 'e', 'v', 'i', 'c'}));
  EXPECT_EQ(ask({0x60, 0, 0, 0, 0, 0, 0, 0}), (Bytes{0x0D, 'e', 0, 0, 0, 0, 0, 0}));
  EXPECT_FALSE(server.busy());
  EXPECT_EQ(server.counters().uploads, 1U);
}

TEST_F(ServerTest, AnEmptyValueIsOneEmptySegment) {
  EXPECT_EQ(ask({0x40, 0x00, 0x20, 8, 0, 0, 0, 0}), (Bytes{0x41, 0x00, 0x20, 8, 0, 0, 0, 0}));
  EXPECT_EQ(ask({0x60, 0, 0, 0, 0, 0, 0, 0}), (Bytes{0x0F, 0, 0, 0, 0, 0, 0, 0}));
}

TEST_F(ServerTest, SubIndexFFhGivesTheStructure) {
  EXPECT_EQ(ask({0x40, 0x17, 0x10, 0xFF, 0, 0, 0, 0}), (Bytes{0x43, 0x17, 0x10, 0xFF, 7, 6, 0, 0}));
}

TEST_F(ServerTest, SubIndexFFhCannotBeWritten) {
  EXPECT_EQ(ask({0x23, 0x17, 0x10, 0xFF, 7, 6, 0, 0}), abort_bytes(0x1017, 0xFF, 0x0601'0002));
  EXPECT_EQ(ask({0x21, 0x17, 0x10, 0xFF, 4, 0, 0, 0}), abort_bytes(0x1017, 0xFF, 0x0601'0002));
}

TEST_F(ServerTest, ExpeditedDownload) {
  EXPECT_EQ(ask({0x2F, 0x00, 0x20, 1, 0xA1, 0, 0, 0}), (Bytes{0x60, 0x00, 0x20, 1, 0, 0, 0, 0}));
  EXPECT_EQ(ask({0x2B, 0x00, 0x20, 2, 0xA1, 0xA2, 0, 0}), (Bytes{0x60, 0x00, 0x20, 2, 0, 0, 0, 0}));
  EXPECT_EQ(ask({0x27, 0x00, 0x20, 3, 0xA1, 0xA2, 0xA3, 0}),
            (Bytes{0x60, 0x00, 0x20, 3, 0, 0, 0, 0}));
  EXPECT_EQ(ask({0x23, 0x00, 0x20, 4, 0xA1, 0xA2, 0xA3, 0xA4}),
            (Bytes{0x60, 0x00, 0x20, 4, 0, 0, 0, 0}));
  EXPECT_EQ(value({0x2000, 1}), (Bytes{0xA1}));
  EXPECT_EQ(value({0x2000, 2}), (Bytes{0xA1, 0xA2}));
  EXPECT_EQ(value({0x2000, 3}), (Bytes{0xA1, 0xA2, 0xA3}));
  EXPECT_EQ(value({0x2000, 4}), (Bytes{0xA1, 0xA2, 0xA3, 0xA4}));
  EXPECT_EQ(server.counters().downloads, 4U);
}

TEST_F(ServerTest, ExpeditedDownloadWithoutSizeTakesTheSizeOfTheObject) {
  EXPECT_EQ(ask({0x22, 0x00, 0x20, 2, 0xB1, 0xB2, 0xB3, 0xB4}),
            (Bytes{0x60, 0x00, 0x20, 2, 0, 0, 0, 0}));
  EXPECT_EQ(value({0x2000, 2}), (Bytes{0xB1, 0xB2}));
  EXPECT_EQ(ask({0x22, 0x00, 0x20, 9, 0xB1, 0xB2, 0xB3, 0xB4}),
            (Bytes{0x60, 0x00, 0x20, 9, 0, 0, 0, 0}));
  EXPECT_EQ(value({0x2000, 9}), (Bytes{0xB1, 0xB2, 0xB3, 0xB4}));
}

TEST_F(ServerTest, SegmentedDownloadChangesTheObjectWithTheLastSegment) {
  EXPECT_EQ(ask({0x21, 0x00, 0x20, 5, 8, 0, 0, 0}), (Bytes{0x60, 0x00, 0x20, 5, 0, 0, 0, 0}));
  EXPECT_EQ(ask({0x00, 11, 12, 13, 14, 15, 16, 17}), (Bytes{0x20, 0, 0, 0, 0, 0, 0, 0}));
  EXPECT_EQ(value({0x2000, 5}), (Bytes{1, 2, 3, 4, 5, 6, 7, 8}));
  EXPECT_EQ(ask({0x1D, 18, 0, 0, 0, 0, 0, 0}), (Bytes{0x30, 0, 0, 0, 0, 0, 0, 0}));
  EXPECT_EQ(value({0x2000, 5}), (Bytes{11, 12, 13, 14, 15, 16, 17, 18}));
  EXPECT_EQ(server.counters().downloads, 1U);
  EXPECT_FALSE(server.busy());
}

TEST_F(ServerTest, SegmentedDownloadWithoutSize) {
  EXPECT_EQ(ask({0x20, 0x00, 0x20, 2, 0, 0, 0, 0}), (Bytes{0x60, 0x00, 0x20, 2, 0, 0, 0, 0}));
  EXPECT_EQ(ask({0x0B, 0xC1, 0xC2, 0, 0, 0, 0, 0}), (Bytes{0x20, 0, 0, 0, 0, 0, 0, 0}));
  EXPECT_EQ(value({0x2000, 2}), (Bytes{0xC1, 0xC2}));
}

TEST_F(ServerTest, EmptyDownload) {
  EXPECT_EQ(ask({0x21, 0x00, 0x20, 9, 0, 0, 0, 0}), (Bytes{0x60, 0x00, 0x20, 9, 0, 0, 0, 0}));
  EXPECT_EQ(ask({0x0F, 0, 0, 0, 0, 0, 0, 0}), (Bytes{0x20, 0, 0, 0, 0, 0, 0, 0}));
  EXPECT_EQ(value({0x2000, 9}), Bytes{});
}

TEST_F(ServerTest, AnUploadGivesTheValueOfItsInitiate) {
  EXPECT_EQ(ask({0x40, 0x00, 0x20, 5, 0, 0, 0, 0}), (Bytes{0x41, 0x00, 0x20, 5, 8, 0, 0, 0}));
  EXPECT_EQ(ask({0x60, 0, 0, 0, 0, 0, 0, 0}), (Bytes{0x00, 1, 2, 3, 4, 5, 6, 7}));
  ASSERT_TRUE(dictionary.set({0x2000, 5}, std::span<const std::byte>(bytes(Bytes(8, 0xEE)))));
  EXPECT_EQ(ask({0x70, 0, 0, 0, 0, 0, 0, 0}), (Bytes{0x1D, 8, 0, 0, 0, 0, 0, 0}));
}

TEST_F(ServerTest, ANewInitiateDropsTheOldTransfer) {
  ask({0x21, 0x00, 0x20, 5, 8, 0, 0, 0});
  ask({0x00, 11, 12, 13, 14, 15, 16, 17});
  EXPECT_EQ(ask({0x40, 0x01, 0x10, 0, 0, 0, 0, 0}), (Bytes{0x4F, 0x01, 0x10, 0, 0x7F, 0, 0, 0}));
  EXPECT_FALSE(server.busy());
  EXPECT_EQ(ask({0x1D, 18, 0, 0, 0, 0, 0, 0}), abort_bytes(0, 0, 0x0504'0001));
  EXPECT_EQ(value({0x2000, 5}), (Bytes{1, 2, 3, 4, 5, 6, 7, 8}));
}

TEST_F(ServerTest, AnAbortedDownloadNeverChangesTheObject) {
  ask({0x21, 0x00, 0x20, 5, 8, 0, 0, 0});
  ask({0x00, 11, 12, 13, 14, 15, 16, 17});
  EXPECT_EQ(ask(abort_bytes(0x2000, 5, 0x0504'0000)), Bytes{});
  EXPECT_FALSE(server.busy());
  EXPECT_EQ(value({0x2000, 5}), (Bytes{1, 2, 3, 4, 5, 6, 7, 8}));
  EXPECT_EQ(server.counters().aborts, 1U);
}

TEST_F(ServerTest, AnAbortWithoutATransferIsNotAnswered) {
  EXPECT_EQ(ask(abort_bytes(0x2000, 5, 0x0504'0000)), Bytes{});
  EXPECT_EQ(server.counters().aborts, 0U);
}

TEST_F(ServerTest, AFullQueueDelaysTheAnswer) {
  while (queue.push(can::TransmitClass::sdo, can::make_frame(0x123, {1}))) {
  }
  server.receive(frame(kRequestId, {0x40, 0x01, 0x10, 0, 0, 0, 0, 0}, now), queue);
  EXPECT_EQ(server.next_wake(), now + 1ms);
  server.advance(now + 1ms, queue);
  EXPECT_EQ(server.next_wake(), now + 2ms);
  drain(queue, 0x123);
  server.advance(now + 2ms, queue);
  EXPECT_EQ(drain(queue, kResponseId), (std::vector<Bytes>{{0x4F, 0x01, 0x10, 0, 0x7F, 0, 0, 0}}));
  EXPECT_EQ(server.next_wake(), kNever);
}

TEST_F(ServerTest, ADelayedAnswerKeepsItsPlaceBeforeTheNext) {
  while (queue.push(can::TransmitClass::sdo, can::make_frame(0x123, {1}))) {
  }
  server.receive(frame(kRequestId, {0x40, 0x01, 0x10, 0, 0, 0, 0, 0}, now), queue);
  drain(queue, 0x123);
  server.receive(frame(kRequestId, {0x40, 0x00, 0x10, 0, 0, 0, 0, 0}, now), queue);
  EXPECT_EQ(drain(queue, kResponseId), (std::vector<Bytes>{{0x4F, 0x01, 0x10, 0, 0x7F, 0, 0, 0},
                                                           {0x43, 0x00, 0x10, 0, 1, 2, 3, 4}}));
}

TEST_F(ServerTest, OtherIdentifiersAfterConfigure) {
  ask({0x40, 0x08, 0x10, 0, 0, 0, 0, 0});
  server.configure(can::CobId{0x640}, can::CobId{0x2000'1234});
  EXPECT_FALSE(server.busy());
  can::Frame out;
  ASSERT_TRUE(server.answer(frame(0x640, {0x40, 0x01, 0x10, 0, 0, 0, 0, 0}), out));
  EXPECT_EQ(out.id, 0x1234U);
  EXPECT_TRUE(out.extended());
  EXPECT_EQ(server.request_id().id(), 0x640U);
}

}  // namespace
}  // namespace linegate::sdo::test

// SPDX-License-Identifier: Apache-2.0
// Every abort code that the server can send (CiA 301, 7.2.4.3.17), and invalid frames.
#include <random>

#include "tests/stack/sdo/server_fixture.h"

namespace linegate::sdo::test {
namespace {

class Refusing : public od::Hook {
 public:
  AbortCode before_read(od::Address, const od::Variable&) override { return on_read; }
  AbortCode check_write(od::Address, std::span<const std::byte>) override { return on_write; }
  AbortCode on_read = AbortCode::none;
  AbortCode on_write = AbortCode::none;
};

TEST_F(ServerTest, ObjectAndSubIndexMustExist) {
  EXPECT_EQ(ask({0x40, 0x34, 0x12, 0, 0, 0, 0, 0}), abort_bytes(0x1234, 0, 0x0602'0000));
  EXPECT_EQ(ask({0x40, 0x00, 0x20, 10, 0, 0, 0, 0}), abort_bytes(0x2000, 10, 0x0609'0011));
  EXPECT_EQ(ask({0x2F, 0x34, 0x12, 0, 1, 0, 0, 0}), abort_bytes(0x1234, 0, 0x0602'0000));
  EXPECT_EQ(ask({0x2F, 0x00, 0x20, 10, 1, 0, 0, 0}), abort_bytes(0x2000, 10, 0x0609'0011));
  EXPECT_EQ(ask({0x21, 0x34, 0x12, 0, 9, 0, 0, 0}), abort_bytes(0x1234, 0, 0x0602'0000));
  EXPECT_EQ(ask({0x21, 0x00, 0x20, 10, 9, 0, 0, 0}), abort_bytes(0x2000, 10, 0x0609'0011));
  EXPECT_EQ(server.counters().aborts, 6U);
}

TEST_F(ServerTest, AccessRights) {  // 0601 0001h write-only, 0601 0002h read-only
  EXPECT_EQ(ask({0x40, 0x00, 0x20, 6, 0, 0, 0, 0}), abort_bytes(0x2000, 6, 0x0601'0001));
  EXPECT_EQ(ask({0x23, 0x00, 0x10, 0, 0, 0, 0, 0}), abort_bytes(0x1000, 0, 0x0601'0002));
  EXPECT_EQ(ask({0x21, 0x08, 0x10, 0, 15, 0, 0, 0}), abort_bytes(0x1008, 0, 0x0601'0002));
}

TEST_F(ServerTest, LengthOfAnExpeditedDownload) {
  EXPECT_EQ(ask({0x23, 0x00, 0x20, 2, 1, 2, 3, 4}), abort_bytes(0x2000, 2, 0x0607'0012));
  EXPECT_EQ(ask({0x2F, 0x00, 0x20, 2, 1, 0, 0, 0}), abort_bytes(0x2000, 2, 0x0607'0013));
  EXPECT_EQ(ask({0x22, 0x00, 0x20, 5, 1, 2, 3, 4}), abort_bytes(0x2000, 5, 0x0607'0013));
  EXPECT_EQ(value({0x2000, 2}), (Bytes{0x21, 0x22}));
}

TEST_F(ServerTest, LengthAnnouncedAtTheInitiate) {
  EXPECT_EQ(ask({0x21, 0x00, 0x20, 5, 9, 0, 0, 0}), abort_bytes(0x2000, 5, 0x0607'0012));
  EXPECT_EQ(ask({0x21, 0x00, 0x20, 5, 7, 0, 0, 0}), abort_bytes(0x2000, 5, 0x0607'0013));
  EXPECT_EQ(ask({0x21, 0x00, 0x20, 9, 0xFF, 0xFF, 0xFF, 0xFF}),
            abort_bytes(0x2000, 9, 0x0607'0012));
}

TEST_F(ServerTest, MoreSegmentsThanAnnounced) {
  ask({0x21, 0x00, 0x20, 9, 3, 0, 0, 0});
  EXPECT_EQ(ask({0x00, 1, 2, 3, 4, 5, 6, 7}), abort_bytes(0x2000, 9, 0x0607'0012));
  EXPECT_FALSE(server.busy());
}

TEST_F(ServerTest, FewerSegmentsThanAnnounced) {
  ask({0x21, 0x00, 0x20, 9, 3, 0, 0, 0});
  EXPECT_EQ(ask({0x0B, 1, 2, 0, 0, 0, 0, 0}), abort_bytes(0x2000, 9, 0x0607'0013));
  EXPECT_EQ(value({0x2000, 9}), (Bytes{1, 2, 3, 4, 5, 6, 7, 8}));
}

TEST_F(ServerTest, MoreSegmentsThanTheObjectHolds) {
  ask({0x20, 0x00, 0x20, 2, 0, 0, 0, 0});
  EXPECT_EQ(ask({0x00, 1, 2, 3, 4, 5, 6, 7}), abort_bytes(0x2000, 2, 0x0607'0012));
  ask({0x20, 0x00, 0x20, 2, 0, 0, 0, 0});
  EXPECT_EQ(ask({0x0D, 1, 0, 0, 0, 0, 0, 0}), abort_bytes(0x2000, 2, 0x0607'0013));
}

TEST_F(ServerTest, Limits) {  // 0609 0031h too high, 0609 0032h too low
  EXPECT_EQ(ask({0x2B, 0x00, 0x20, 7, 101, 0, 0, 0}), abort_bytes(0x2000, 7, 0x0609'0031));
  EXPECT_EQ(ask({0x2B, 0x00, 0x20, 7, 0xFA, 0xFF, 0, 0}), abort_bytes(0x2000, 7, 0x0609'0032));
  EXPECT_EQ(ask({0x20, 0x00, 0x20, 7, 0, 0, 0, 0}), (Bytes{0x60, 0x00, 0x20, 7, 0, 0, 0, 0}));
  EXPECT_EQ(ask({0x0B, 101, 0, 0, 0, 0, 0, 0}), abort_bytes(0x2000, 7, 0x0609'0031));
  EXPECT_EQ(value({0x2000, 7}), (Bytes{0, 0}));
}

TEST_F(ServerTest, ToggleBitOfAnUpload) {
  ask({0x40, 0x08, 0x10, 0, 0, 0, 0, 0});
  EXPECT_EQ(ask({0x70, 0, 0, 0, 0, 0, 0, 0}), abort_bytes(0x1008, 0, 0x0503'0000));
  EXPECT_FALSE(server.busy());
}

TEST_F(ServerTest, ADuplicatedSegmentHasTheWrongToggleBit) {
  ask({0x40, 0x08, 0x10, 0, 0, 0, 0, 0});
  ask({0x60, 0, 0, 0, 0, 0, 0, 0});
  EXPECT_EQ(ask({0x60, 0, 0, 0, 0, 0, 0, 0}), abort_bytes(0x1008, 0, 0x0503'0000));
  ask({0x21, 0x00, 0x20, 5, 8, 0, 0, 0});
  ask({0x00, 1, 1, 1, 1, 1, 1, 1});
  EXPECT_EQ(ask({0x00, 1, 1, 1, 1, 1, 1, 1}), abort_bytes(0x2000, 5, 0x0503'0000));
  EXPECT_EQ(value({0x2000, 5}), (Bytes{1, 2, 3, 4, 5, 6, 7, 8}));
}

TEST_F(ServerTest, CommandSpecifierOutOfPlace) {
  EXPECT_EQ(ask({0x60, 0, 0, 0, 0, 0, 0, 0}), abort_bytes(0, 0, 0x0504'0001));
  EXPECT_EQ(ask({0x00, 1, 2, 3, 4, 5, 6, 7}), abort_bytes(0, 0, 0x0504'0001));
  EXPECT_EQ(ask({0xE0, 0x00, 0x10, 0, 0, 0, 0, 0}), abort_bytes(0, 0, 0x0504'0001));
  ask({0x40, 0x08, 0x10, 0, 0, 0, 0, 0});
  EXPECT_EQ(ask({0x00, 1, 2, 3, 4, 5, 6, 7}), abort_bytes(0x1008, 0, 0x0504'0001));
  ask({0x21, 0x00, 0x20, 5, 8, 0, 0, 0});
  EXPECT_EQ(ask({0x60, 0, 0, 0, 0, 0, 0, 0}), abort_bytes(0x2000, 5, 0x0504'0001));
}

TEST_F(ServerTest, AStalledTransferTimesOut) {
  ask({0x40, 0x08, 0x10, 0, 0, 0, 0, 0});
  now += 200ms;
  ask({0x60, 0, 0, 0, 0, 0, 0, 0});
  EXPECT_EQ(server.next_wake(), now + kTimeout);
  server.advance(now + kTimeout - 1ns, queue);
  EXPECT_TRUE(server.busy());
  server.advance(now + kTimeout, queue);
  EXPECT_EQ(drain(queue, kResponseId), (std::vector<Bytes>{abort_bytes(0x1008, 0, 0x0504'0000)}));
  EXPECT_FALSE(server.busy());
  EXPECT_EQ(server.next_wake(), kNever);
}

TEST_F(ServerTest, WhatIsLongerThanTheBufferIsOutOfMemory) {
  ASSERT_EQ(dictionary.write({0x2100, 0}, pattern(20'001)), AbortCode::none);
  EXPECT_EQ(ask({0x40, 0x00, 0x21, 0, 0, 0, 0, 0}), abort_bytes(0x2100, 0, 0x0504'0005));
  EXPECT_EQ(ask({0x21, 0x00, 0x21, 0, 0x21, 0x4E, 0, 0}), abort_bytes(0x2100, 0, 0x0504'0005));
  ask({0x20, 0x00, 0x21, 0, 0, 0, 0, 0});
  Bytes answer;
  for (unsigned i = 0; i * 7 < 20'000; ++i) {
    answer = ask({static_cast<std::uint8_t>(i % 2 * 0x10), 1, 2, 3, 4, 5, 6, 7});
  }
  EXPECT_EQ(answer, abort_bytes(0x2100, 0, 0x0504'0005));
  EXPECT_EQ(value({0x2100, 0}).size(), 20'001U);
}

// 0609 0036h maximum below minimum
TEST_F(ServerTest, HalfACharacterAndLimitsThatLeaveNothing) {  // 0607 0010h length does not match
  od::VariableDescription limited = variable(2, od::DataType::unsigned8, od::Access::rw, {0});
  limited.low_limit = bytes({10});
  limited.high_limit = bytes({5});
  ASSERT_TRUE(
      dictionary
          .add(object(0x2200,
                      {variable(1, od::DataType::unicode_string, od::Access::rw, {}), limited}))
          .ok());
  EXPECT_EQ(ask({0x27, 0x00, 0x22, 1, 'a', 0, 'b', 0}), abort_bytes(0x2200, 1, 0x0607'0010));
  EXPECT_EQ(ask({0x2F, 0x00, 0x22, 2, 7, 0, 0, 0}), abort_bytes(0x2200, 2, 0x0609'0036));
}

// Abort codes that only the application uses, for its own objects.
TEST_F(ServerTest, AHooksRefusalIsPassedOn) {
  Refusing hook;
  ASSERT_TRUE(dictionary.set_hook(0x2000, &hook));
  for (const AbortCode code :
       {AbortCode::unsupported_access, AbortCode::not_mappable, AbortCode::pdo_length_exceeded,
        AbortCode::parameter_incompatible, AbortCode::device_incompatible, AbortCode::hardware,
        AbortCode::invalid_value, AbortCode::max_less_than_min, AbortCode::sdo_connection,
        AbortCode::general, AbortCode::cannot_transfer, AbortCode::local_control,
        AbortCode::device_state, AbortCode::no_dictionary, AbortCode::no_data}) {
    hook.on_read = code;
    hook.on_write = code;
    const auto number = static_cast<std::uint32_t>(code);
    EXPECT_EQ(ask({0x40, 0x00, 0x20, 1, 0, 0, 0, 0}), abort_bytes(0x2000, 1, number));
    EXPECT_EQ(ask({0x2F, 0x00, 0x20, 1, 5, 0, 0, 0}), abort_bytes(0x2000, 1, number));
    ask({0x21, 0x00, 0x20, 5, 8, 0, 0, 0});
    ask({0x00, 11, 12, 13, 14, 15, 16, 17});
    EXPECT_EQ(ask({0x1D, 18, 0, 0, 0, 0, 0, 0}), abort_bytes(0x2000, 5, number));
  }
  EXPECT_EQ(value({0x2000, 1}), (Bytes{0x11}));
  ASSERT_TRUE(dictionary.set_hook(0x2000, nullptr));
}

TEST_F(ServerTest, AFrameWithoutEightBytesIsCountedToldAndIgnored) {
  ask({0x40, 0x08, 0x10, 0, 0, 0, 0, 0});
  for (std::uint8_t length = 0; length < 8; ++length) {
    Bytes request{0x60, 0, 0, 0, 0, 0, 0};
    request.resize(length);
    EXPECT_EQ(ask(request), Bytes{});
  }
  can::Frame remote = frame(kRequestId, {0x60, 0, 0, 0, 0, 0, 0, 0});
  remote.flags = can::Frame::kRemote;
  server.receive(remote, queue);
  can::Frame fd = frame(kRequestId, {0x60, 0, 0, 0, 0, 0, 0, 0});
  fd.flags = can::Frame::kFd;
  fd.length = 12;
  server.receive(fd, queue);
  EXPECT_EQ(server.counters().malformed, 10U);
  const std::vector<Event> told = drain(events);
  ASSERT_EQ(told.size(), 10U);
  const auto& of_three_bytes = std::get<event::MalformedFrame>(told[3].data);
  EXPECT_EQ(of_three_bytes.identifier, kRequestId);
  EXPECT_EQ(of_three_bytes.length, 3U);
  EXPECT_EQ(of_three_bytes.data[0], std::byte{0x60});
  EXPECT_EQ(std::get<event::MalformedFrame>(told[9].data).length, 12U);
  EXPECT_EQ(ask({0x60, 0, 0, 0, 0, 0, 0, 0}), (Bytes{0x00, 'L', 'i', 'n', 'e', 'g', 'a', 't'}));
}

TEST_F(ServerTest, RandomBytesNeverBreakIt) {
  std::mt19937 random(2024);
  std::uniform_int_distribution<unsigned> any(0, 255);
  for (int round = 0; round < 20'000; ++round) {
    Bytes request(round % 13 == 0 ? any(random) % 9 : 8);
    for (std::uint8_t& b : request) {
      b = static_cast<std::uint8_t>(any(random));
    }
    // Half of them address existing objects.
    if (request.size() == 8 && round % 2 == 0) {
      request[1] = 0x00;
      request[2] = round % 4 == 0 ? 0x20 : 0x21;
      request[3] = static_cast<std::uint8_t>(request[3] % 12);
    }
    now += 1ms;
    ask(request);
    server.advance(now, queue);
    drain(queue, kResponseId);
    ask(abort_bytes(0, 0, 0x0800'0000));  // within a block download, all but this is a segment
    ASSERT_EQ(ask({0x40, 0x01, 0x10, 0, 0, 0, 0, 0}), (Bytes{0x4F, 0x01, 0x10, 0, 0x7F, 0, 0, 0}))
        << "round " << round;
    // Leaves a transfer unfinished.
    ask(round % 3 == 0 ? Bytes{0x40, 0x08, 0x10, 0, 0, 0, 0, 0}
                       : Bytes{0x20, 0x00, 0x20, 9, 0, 0, 0, 0});
  }
}

}  // namespace
}  // namespace linegate::sdo::test

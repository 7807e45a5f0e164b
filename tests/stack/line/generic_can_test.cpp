// SPDX-License-Identifier: Apache-2.0
// Frames that belong to no CANopen service (CANopenIA manual 6.2, 5F01h:0Bh): sending and
// listening.
#include "stack/line/generic_can.h"

#include "tests/stack/line/line_fixture.h"

namespace linegate::line {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

class GenericCan : public LineTest {
 protected:
  void SetUp() override {
    make(config_with_axis());
    boot();
    pass(milliseconds(1));
    sent();
    events();
  }

  Error ask(Command command) {
    line_->execute(std::move(command), now_);
    return answer().error;
  }
  static std::vector<std::byte> bytes(std::initializer_list<unsigned> values) {
    std::vector<std::byte> out;
    for (const unsigned value : values) {
      out.push_back(static_cast<std::byte>(value));
    }
    return out;
  }
  static can::Frame frame(std::uint32_t id, std::span<const std::byte> data, unsigned flags) {
    can::Frame out;
    out.id = id;
    out.flags = static_cast<std::uint8_t>(flags);
    out.length = static_cast<std::uint8_t>(data.size());
    std::ranges::copy(data, out.data.begin());
    return out;
  }
  Error send(std::uint32_t id, const std::vector<std::byte>& data = {}, unsigned flags = 0) {
    return ask({.request = CanSend{frame(id, data, flags)}});
  }
  Error listen(std::uint32_t id, unsigned duration) {
    return ask(
        {.request = CanListen{.identifier = id, .extended = false, .duration = seconds(duration)}});
  }
  std::vector<event::CanFrame> frames() {
    std::vector<event::CanFrame> out;
    for (const Event& event : events()) {
      if (const auto* const frame = event.get<event::CanFrame>()) {
        out.push_back(*frame);
      }
    }
    return out;
  }
};

TEST_F(GenericCan, AFrameOfAnyOtherIdentifierIsSentBehindAllElse) {
  EXPECT_EQ(send(0x150, bytes({0x11, 0x22, 0x33, 0x44})), Error{});
  EXPECT_EQ(send(0x150, {}, can::Frame::kExtended), Error{});
  can::Frame frame;
  ASSERT_TRUE(line_->next_frame(frame, now_));
  EXPECT_EQ(text(frame), "150#11223344");
  EXPECT_FALSE(frame.extended());
  ASSERT_TRUE(line_->next_frame(frame, now_));
  EXPECT_EQ(frame.id, 0x150U);
  EXPECT_TRUE(frame.extended());
  EXPECT_EQ(frame.length, 0);
}

TEST_F(GenericCan, RemoteFramesAndCanFd) {
  EXPECT_EQ(send(0x150, std::vector<std::byte>(3), can::Frame::kRemote), Error{});
  can::Frame frame;
  ASSERT_TRUE(line_->next_frame(frame, now_));
  EXPECT_TRUE(frame.remote());
  EXPECT_EQ(frame.length, 3);
  const unsigned fast = can::Frame::kFd | can::Frame::kBitRateSwitch;
  EXPECT_EQ(send(0x150, std::vector<std::byte>(64), fast), Error{});
  ASSERT_TRUE(line_->next_frame(frame, now_));
  EXPECT_EQ(frame.flags, can::Frame::kFd | can::Frame::kBitRateSwitch);
  EXPECT_EQ(frame.length, 64);
}

TEST_F(GenericCan, WhatIsNoFrameIsRefused) {
  const Error bad = to_error(Refusal::bad_request);
  EXPECT_EQ(send(0x800), bad) << "more than 11 bits";
  EXPECT_EQ(send(0x2000'0150), bad) << "a reserved bit";
  EXPECT_EQ(send(0x150, std::vector<std::byte>(9)), bad);
  EXPECT_EQ(send(0x150, {}, can::Frame::kFd | can::Frame::kRemote), bad);
  EXPECT_EQ(send(0x150, {}, can::Frame::kBitRateSwitch), bad) << "of CAN FD alone";
  EXPECT_EQ(send(0x150, std::vector<std::byte>(9), can::Frame::kFd), bad)
      << "CAN FD has no such length";
  EXPECT_THAT(sent(), IsEmpty());
}

TEST_F(GenericCan, IdentifiersThatServicesUseAreRefused) {
  for (const std::uint32_t id : {
           0x000U, 0x080U, 0x100U,         // NMT, SYNC, TIME
           0x0FFU, 0x085U,                 // EMCY of the own node and of other nodes
           0x585U, 0x605U, 0x67FU,         // SDO
           0x701U, 0x77FU, 0x7E4U, 0x7E5U  // error control, LSS
       }) {
    EXPECT_EQ(send(id), to_error(Refusal::identifier_in_use)) << std::hex << id;
  }
  const auto linked = [this](Direction direction) {
    const auto base = static_cast<std::uint16_t>(direction == Direction::inputs ? 0x1400 : 0x1800);
    return static_cast<std::uint32_t>(line_->dictionary().number({base, 1}).value()) & 0x7FFU;
  };
  EXPECT_EQ(send(linked(Direction::inputs)), to_error(Refusal::identifier_in_use));
  EXPECT_EQ(send(linked(Direction::outputs)), to_error(Refusal::identifier_in_use));
  EXPECT_EQ(send(linked(Direction::outputs), {}, can::Frame::kExtended), Error{})
      << "29 bits are others";
}

TEST_F(GenericCan, NothingIsSentWithoutABusOrByAnObserver) {
  line_->bus_event({.kind = can::BusEvent::Kind::interface_failed, .time = now_});
  EXPECT_EQ(send(0x150), to_error(Refusal::line_down));
  LineConfig config = config_with_axis();
  config.role = Role::observer;
  make(config);
  line_->start(now_);
  EXPECT_EQ(send(0x150), to_error(Refusal::wrong_role));
  EXPECT_EQ(listen(0x150, 5), Error{}) << "but the line may listen";
  hear(0x150, {7});
  EXPECT_EQ(frames().size(), 1U);
}

TEST_F(GenericCan, OnlyFramesThatNoServiceWantsAreTold) {
  hear(0x150, {1});
  EXPECT_THAT(frames(), IsEmpty()) << "nobody asked";
  EXPECT_EQ(ask({.request = CanListen{.mask = 0, .duration = seconds(5)}}), Error{})
      << "all frames";
  hear(0x150, {1, 2, 3});
  hear(0x705, {5});
  const std::vector<event::CanFrame> told = frames();
  ASSERT_EQ(told.size(), 1U);
  EXPECT_EQ(told[0], (event::CanFrame{.identifier = 0x150,
                                      .length = 3,
                                      .data = {std::byte{1}, std::byte{2}, std::byte{3}}}));
  EXPECT_EQ(told[0].bytes(), 3U);
}

TEST_F(GenericCan, TheMaskSaysWhichBitsCount) {
  EXPECT_EQ(
      ask({.request =
               CanListen{
                   .identifier = 0x100, .mask = 0x700, .extended = false, .duration = seconds(5)}}),
      Error{});
  EXPECT_EQ(listen(0x333, 5), Error{}) << "without a mask all do";
  hear(0x150, {});
  hear(0x250, {});
  hear(0x333, {});
  hear(0x332, {});
  can::Frame frame = can::make_frame(0x150, {});
  frame.flags = can::Frame::kExtended;
  frame.time = now_;
  line_->receive(std::span(&frame, 1), now_);
  std::vector<std::uint32_t> ids;
  for (const event::CanFrame& told : frames()) {
    EXPECT_FALSE(told.extended);
    ids.push_back(told.identifier);
  }
  EXPECT_THAT(ids, ElementsAre(0x150, 0x333)) << "29-bit identifiers are different";
}

TEST_F(GenericCan, ListeningEndsByItselfOrWhenItIsToldTo) {
  EXPECT_EQ(listen(0x150, 2), Error{});
  EXPECT_EQ(listen(0x151, 2), Error{});
  EXPECT_EQ(listen(0x151, 0), Error{});
  hear(0x151, {});
  EXPECT_THAT(frames(), IsEmpty());
  hear(0x150, {});
  EXPECT_EQ(frames().size(), 1U);
  pass(seconds(1));
  EXPECT_EQ(listen(0x150, 2), Error{}) << "a repetition changes the end";
  pass(milliseconds(1500));
  hear(0x150, {});
  EXPECT_EQ(frames().size(), 1U);
  pass(milliseconds(500));
  hear(0x150, {});
  EXPECT_THAT(frames(), IsEmpty());
}

TEST_F(GenericCan, MoreFramesThanAreToldAreCounted) {
  EXPECT_EQ(listen(0x150, 5), Error{});
  for (unsigned i = 0; i < Listening::kMostASecond + 7; ++i) {
    hear(0x150, {});
  }
  EXPECT_EQ(frames().size(), Listening::kMostASecond);
  pass(seconds(1));
  hear(0x150, {1});
  hear(0x150, {2});
  const std::vector<event::CanFrame> told = frames();
  ASSERT_EQ(told.size(), 2U);
  EXPECT_EQ(told[0].suppressed, 7U);
  EXPECT_EQ(told[0].length, 1U);
  EXPECT_EQ(told[1].suppressed, 0U);
  EXPECT_EQ(told[1].length, 1U);
}

TEST_F(GenericCan, LongFramesAreToldInPieces) {
  EXPECT_EQ(listen(0x150, 5), Error{});
  can::Frame frame;
  frame.id = 0x150;
  frame.flags = can::Frame::kFd;
  frame.length = 20;
  frame.time = now_;
  frame.data[0] = std::byte{1};
  frame.data[19] = std::byte{9};
  line_->receive(std::span(&frame, 1), now_);
  const std::vector<event::CanFrame> told = frames();
  ASSERT_EQ(told.size(), 2U);
  for (unsigned piece = 0; piece < 2; ++piece) {
    EXPECT_TRUE(told[piece].fd);
    EXPECT_EQ(told[piece].length, 20U);
    EXPECT_EQ(unsigned{told[piece].piece}, piece);
    EXPECT_EQ(told[piece].suppressed, 0U);
  }
  EXPECT_EQ(told[0].bytes(), 16U);
  EXPECT_EQ(told[0].data[0], std::byte{1});
  EXPECT_EQ(told[1].bytes(), 4U);
  EXPECT_EQ(told[1].data[3], std::byte{9});
}

TEST_F(GenericCan, ThereAreOnlySoManyListeners) {
  for (std::uint32_t i = 0; i < Listening::kFilters; ++i) {
    EXPECT_EQ(listen(0x300 + i, 5), Error{});
  }
  EXPECT_EQ(listen(0x150, 5), to_error(Refusal::busy));
  EXPECT_EQ(listen(0x300, 5), Error{}) << "a repetition needs no place";
  EXPECT_EQ(listen(0x150, Listening::kLongest + 1), to_error(Refusal::bad_request));
  EXPECT_EQ(listen(0x2000'0000, 5), to_error(Refusal::bad_request)) << "more than 29 bits";
  pass(seconds(5));
  EXPECT_EQ(listen(0x150, 5), Error{});
}

TEST_F(GenericCan, DevicesOfTheLineSendAndListenToo) {
  LineConfig config;
  config.name = "cell";
  config.role = Role::device;
  config.devices.push_back({9, "one", *eds::load(kDeviceFile, "axis.eds", 9).value});
  config.devices.push_back({10, "two", *eds::load(kDeviceFile, "axis.eds", 10).value});
  make(config);
  line_->start(now_);
  sent();
  EXPECT_EQ(send(0x58A), to_error(Refusal::identifier_in_use));
  EXPECT_EQ(send(0x150, bytes({9})), Error{});
  EXPECT_THAT(sent(), ElementsAre("150#09"));
  EXPECT_EQ(listen(0x151, 5), Error{});
  hear(0x151, {});
  EXPECT_EQ(frames().size(), 1U);
}

}  // namespace
}  // namespace linegate::line

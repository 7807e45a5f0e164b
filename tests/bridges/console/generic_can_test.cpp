// SPDX-License-Identifier: Apache-2.0
// `linegate send` and `linegate listen` against a simulated gateway.
#include "bridges/console/generic_can.h"

#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/bridges/console/command_test.h"

namespace linegate::console {
namespace {

using test::as;

using test::raw;
using testing::HasSubstr;

const LineId kCell{"plant", "cell"};

// Reports its frames as soon as they are subscribed to.
class Listener150 : public Client {
 public:
  void poll(Duration /*timeout*/, Listener& listener) override {
    LineView view{.interface_uri = "virtual:cell", .access = "all"};
    view.state.counters.events = 4;
    listener.on_line(kCell, view);
    for (const EventView& event : std::exchange(early, {})) {
      listener.on_event(kCell, event);
    }
    const auto* const listens = std::get_if<line::CanListen>(&asked.request);
    if (listens != nullptr && listens->duration > std::chrono::seconds(0)) {
      for (const EventView& event : std::exchange(events, {})) {
        listener.on_event(kCell, event);
      }
    }
  }
  Answer call(const LineId& /*id*/, const line::Command& command, Duration /*timeout*/,
              std::uint64_t /*layout_id*/, Listener& /*listener*/) override {
    asked = command;
    return answer;
  }

  std::vector<EventView> early;
  std::vector<EventView> events;
  Answer answer;
  line::Command asked;
};

EventView frame_event(std::uint64_t number, event::CanFrame frame,
                      std::initializer_list<unsigned> bytes) {
  std::size_t at = 0;
  for (const unsigned byte : bytes) {
    frame.data[at++] = static_cast<std::byte>(byte);
  }
  return {.number = number, .kind = EventKind::can_frame, .data = frame};
}

using GenericFrames = test::CommandTest<Listener150>;

TEST_F(GenericFrames, AreWrittenAsCansendHasThem) {
  EXPECT_EQ(send(context_, "cell", "150#11.22"), kDone) << err_.str();
  const auto sent = [this] { return as<line::CanSend>(gateway_.asked).frame; };
  const auto data = [&sent] {
    const can::Frame frame = sent();
    return std::vector(frame.bytes().begin(), frame.bytes().end());
  };
  EXPECT_EQ(sent().id, 0x150U);
  EXPECT_EQ(sent().flags, 0);
  EXPECT_EQ(data(), raw({0x11, 0x22}));
  EXPECT_EQ(send(context_, "cell", "00000150#"), kDone);
  EXPECT_EQ(sent().id, 0x150U);
  EXPECT_EQ(sent().flags, can::Frame::kExtended);
  EXPECT_EQ(send(context_, "cell", "150#R8"), kDone);
  EXPECT_EQ(sent().flags, can::Frame::kRemote);
  EXPECT_EQ(sent().length, 8);
  EXPECT_EQ(send(context_, "cell", "150##1112233"), kDone);
  EXPECT_EQ(sent().flags, can::Frame::kFd | can::Frame::kBitRateSwitch);
  EXPECT_EQ(data(), raw({0x11, 0x22, 0x33}));
}

TEST_F(GenericFrames, WhatIsNoneIsSaid) {
  for (const char* const wrong :
       {"150", "15#", "900#", "0000150#", "150#1", "150#112233445566778899", "150#R9", "150#xx",
        "150##", "150##0112233445566778899", "20000000#"}) {
    EXPECT_EQ(send(context_, "cell", wrong), kUsage) << wrong;
  }
  EXPECT_THAT(err_.str(), HasSubstr("'150' is no frame such as 123#1122"));
  EXPECT_EQ(listen(context_, "cell", "15", 1, [] { return false; }), kUsage);
  EXPECT_EQ(listen(context_, "cell", "150/9", 1, [] { return false; }), kUsage);
}

TEST_F(GenericFrames, ARefusalIsToldInWords) {
  gateway_.answer.reply.error = line::to_error(line::Refusal::identifier_in_use);
  gateway_.answer.text = "a service of the line uses this CAN identifier";
  EXPECT_EQ(send(context_, "cell", "605#"), kFailed);
  EXPECT_THAT(err_.str(), HasSubstr("a service of the line uses this CAN identifier\n"));
  EXPECT_EQ(listen(context_, "cell", "150", 1, [] { return false; }), kFailed);
  context_.json = true;
  EXPECT_EQ(send(context_, "cell", "605#"), kFailed);
  EXPECT_THAT(out_.str(), HasSubstr(R"("ok":false)"));
}

TEST_F(GenericFrames, AreShownAsTheyCome) {
  gateway_.early = {frame_event(4, {.identifier = 0x150, .length = 1}, {0xEE})};
  gateway_.events = {frame_event(5, {.identifier = 0x150, .length = 2}, {0x11, 0x22}),
                     frame_event(6, {.identifier = 0x150, .suppressed = 3, .extended = true}, {}),
                     frame_event(7, {.identifier = 0x151, .length = 4, .remote = true}, {})};
  EXPECT_EQ(listen(context_, "cell", "100/700", 3, [] { return false; }), kDone) << err_.str();
  const auto& heard = as<line::CanListen>(gateway_.asked);
  EXPECT_EQ(heard.identifier, 0x100U);
  EXPECT_EQ(heard.mask, 0x700U);
  EXPECT_EQ(heard.extended, false);
  EXPECT_THAT(out_.str(), HasSubstr(" cell 150#1122\n"));
  EXPECT_THAT(out_.str(), HasSubstr(" cell 00000150#  (3 more suppressed)\n"));
  EXPECT_THAT(out_.str(), HasSubstr(" cell 151#R4\n"));
  EXPECT_THAT(out_.str(), testing::Not(HasSubstr("EE"))) << "this frame preceded the subscription";
}

TEST_F(GenericFrames, LongOnesAreOneLineAndJsonHasAllOfIt) {
  gateway_.events = {frame_event(5, {.identifier = 0x150, .length = 20, .fd = true},
                                 {1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16}),
                     frame_event(6, {.identifier = 0x150, .length = 20, .fd = true, .piece = 1},
                                 {17, 18, 19, 20})};
  context_.json = true;
  EXPECT_EQ(listen(context_, "cell", "", 1, [] { return false; }), kDone) << err_.str();
  EXPECT_EQ(as<line::CanListen>(gateway_.asked).mask, 0U) << "all identifiers";
  EXPECT_FALSE(as<line::CanListen>(gateway_.asked).extended.has_value());
  EXPECT_THAT(out_.str(), HasSubstr(R"("id":336,"extended":false,"remote":false,"fd":true,)"
                                    R"("length":20,"data":"0102030405060708090A0B0C0D0E0F10)"
                                    R"(11121314","held_back":0)"));
}

}  // namespace
}  // namespace linegate::console

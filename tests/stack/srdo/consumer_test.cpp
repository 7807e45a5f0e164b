// SPDX-License-Identifier: Apache-2.0
// All SRDOs of a line: identifiers, events, what the listener gets.
#include "stack/srdo/consumer.h"

#include <array>
#include <chrono>
#include <cstddef>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace linegate::srdo {
namespace {

using namespace std::chrono_literals;

class ConsumerTest : public testing::Test, Listener {
 protected:
  void srdo_received(std::size_t source, const can::Frame& normal) override {
    heard_ += "+" + std::to_string(source) + ":" +
              std::to_string(std::to_integer<unsigned>(normal.data[0])) + " ";
  }
  void srdo_unsafe(std::size_t source) override { heard_ += "-" + std::to_string(source) + " "; }

  void receive(std::uint32_t id, Duration time, std::uint8_t octet) {
    can::Frame frame = can::make_frame(id, {octet});
    frame.time = Instant{} + time;
    const can::Target* const target = dispatch_.find(frame);
    ASSERT_NE(target, nullptr);
    ASSERT_EQ(target->service, can::Service::srdo);
    consumer_.receive(target->index, frame);
  }
  void pair(std::uint32_t id, Duration time, std::uint8_t octet) {
    receive(id, time, octet);
    receive(id + 1, time + 1ms, static_cast<std::uint8_t>(~octet));
  }
  // "node/number fault" of each event since the last call.
  std::string events() {
    std::string out;
    std::array<Event, 16> taken;
    for (std::size_t i = 0, count = events_.take(taken); i < count; ++i) {
      const auto& state = std::get<event::SrdoState>(taken.at(i).data);
      out += std::to_string(taken.at(i).node) + "/" + std::to_string(state.number) + " " +
             std::string(name(state.fault)) + "; ";
    }
    return out;
  }
  std::string heard() { return std::exchange(heard_, {}); }

  can::Dispatch dispatch_;
  EventLog events_{64};
  std::string heard_;
  Consumer consumer_{dispatch_,
                     events_,
                     *this,
                     {{.node = 5,
                       .number = 1,
                       .length = 1,
                       .cob_id = 0x109,
                       .inverted_cob_id = 0x10A,
                       .validation = 20ms,
                       .cycle = 50ms},
                      {.node = 6,
                       .number = 2,
                       .length = 1,
                       .cob_id = 0x17F,
                       .inverted_cob_id = 0x180,
                       .validation = 5ms,
                       .cycle = 100ms,
                       .signature = 0x51AF}}};
};

TEST_F(ConsumerTest, EachChangeOfASafetyStateIsAnEvent) {
  pair(0x109, 0ms, 7);
  EXPECT_EQ(heard(), "+0:7 ");
  EXPECT_EQ(events(), "5/1 valid; ");
  pair(0x109, 20ms, 8);
  EXPECT_EQ(heard(), "+0:8 ");
  EXPECT_EQ(events(), "") << "it is valid as before";
  consumer_.advance(Instant{} + 71ms);
  EXPECT_EQ(heard(), "-0 ");
  EXPECT_EQ(events(), "5/1 SCT exceeded; ");
  pair(0x17F, 80ms, 1);
  EXPECT_EQ(heard(), "+1:1 ");
  EXPECT_EQ(events(), "6/2 valid; ");
  EXPECT_EQ(consumer_.fault(0), Fault::cycle_time);
  EXPECT_EQ(consumer_.fault(1), Fault::none);
  EXPECT_EQ(consumer_.counters().pairs, 3U);
  EXPECT_EQ(consumer_.counters().faults, 1U);
}

TEST_F(ConsumerTest, TheNextWakeIsTheFirstDeadline) {
  EXPECT_EQ(consumer_.next_wake(), kNever);
  pair(0x109, 0ms, 7);
  EXPECT_EQ(consumer_.next_wake(), Instant{} + 51ms);
  receive(0x17F, 10ms, 1);
  EXPECT_EQ(consumer_.next_wake(), Instant{} + 15ms);
}

// The SCT ended at 51 ms, between the two frames, and no call of advance() was in time.
TEST_F(ConsumerTest, AnSctThatEndedBeforeTheInvertedFrameIsReported) {
  pair(0x109, 0ms, 7);
  receive(0x109, 45ms, 8);
  events();
  heard();
  receive(0x10A, 60ms, 0xF7);
  EXPECT_EQ(heard(), "-0 +0:8 ");
  EXPECT_EQ(events(), "5/1 SCT exceeded; 5/1 valid; ");
}

TEST_F(ConsumerTest, AnSrdoThatIsForgottenIsNotReceived) {
  pair(0x109, 0ms, 7);
  pair(0x17F, 2ms, 1);
  events();
  heard();
  consumer_.forget(0);
  EXPECT_EQ(heard(), "-0 ");
  EXPECT_EQ(events(), "5/1 not received; ");
  EXPECT_EQ(consumer_.fault(1), Fault::none);
  EXPECT_EQ(consumer_.counters().faults, 1U);
  consumer_.forget(0);
  EXPECT_EQ(events(), "");
}

TEST_F(ConsumerTest, WithAnotherSignatureNoPairIsValid) {
  pair(0x109, 0ms, 7);
  events();
  heard();
  consumer_.check_signature(0, 0x1234, Instant{} + 5ms);
  EXPECT_EQ(heard(), "") << "its device has no signature to compare";
  consumer_.check_signature(1, 0x1234, Instant{} + 5ms);
  EXPECT_EQ(events(), "6/2 other signature; ");
  pair(0x17F, 10ms, 1);
  EXPECT_EQ(heard(), "");
  EXPECT_EQ(consumer_.fault(1), Fault::signature);
  consumer_.check_signature(1, 0x51AF, Instant{} + 20ms);
  pair(0x17F, 30ms, 1);
  EXPECT_EQ(heard(), "+1:1 ");
  consumer_.check_signature(1, 0, Instant{} + 40ms);
  EXPECT_EQ(heard(), "-1 ");
}

TEST_F(ConsumerTest, AnSrdoThatWasNeverValidIsNotReportedAsInvalid) {
  receive(0x10A, 0ms, 7);
  EXPECT_EQ(events(), "") << "the reception begins";
  receive(0x10A, 1ms, 7);
  EXPECT_EQ(heard(), "");
  EXPECT_EQ(events(), "5/1 wrong order; ");
  EXPECT_EQ(consumer_.counters().faults, 0U);
}

}  // namespace
}  // namespace linegate::srdo

// SPDX-License-Identifier: Apache-2.0
// The network boots after its devices have got their node-IDs.
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "stack/lss/assigner.h"
#include "stack/lss/procedure.h"
#include "stack/lss/slave.h"

#include "tests/stack/line/counted_pace.h"
#include "tests/stack/line/line_fixture.h"

namespace linegate::line {
namespace {

using testing::AllOf;
using testing::Contains;
using testing::IsSupersetOf;
using testing::Not;
using testing::StartsWith;

constexpr const char* kResetAll = "000#8200";
constexpr const char* kUpload = "605#40001000";
constexpr const char* kGive = "7E5#1105";

class LssAssignTest : public LineTest {
 protected:
  LssAssignTest() { slave.power_on({}); }

  // The frames sent until the line waits for a timer; the slave answers.
  std::vector<std::string> exchange() {
    std::vector<std::string> out;
    can::Frame frame;
    while (line_->next_frame(frame, now_)) {
      if (frame.id == lss::kMasterId) {
        frame.time = now_;
        (void)slave.receive(frame, answers);
      }
      ++given_;
      out.push_back(text(frame));
      while (answers.pop(frame)) {
        frame.time = now_;
        line_->receive(std::span(&frame, 1), now_);
      }
    }
    return out;
  }
  // Runs until a frame that begins with `begin` is sent; the bus acknowledges the frames before it.
  void until(const char* begin) {
    for (int i = 0; i < 200; ++i) {
      if (testing::Matches(Contains(StartsWith(begin)))(exchange())) {
        return;
      }
      line_->acknowledged(given_, now_);
      now_ = std::max(now_, line_->next_wake());
      line_->advance(now_);
    }
    FAIL() << begin;
  }
  void lose_the_bus_at_the_question() {
    make_checked();
    line_->start(now_);
    until(kUpload);
    bus_becomes(can::BusState::bus_off);
    pass(seconds(5));
    bus_becomes(can::BusState::error_active);
  }
  // A late wake-up: everything that became due before is done now.
  std::vector<std::string> wake_after(Duration time) {
    now_ += time;
    line_->advance(now_);
    return exchange();
  }

  void make_checked() {
    LineConfig config = config_with_axis();
    config.lss.assign = true;
    config.sdo_timeout = milliseconds(500);
    make(std::move(config));
  }
  // The frames sent in this time.
  std::vector<std::string> run_for(Duration time, bool acknowledges) {
    std::vector<std::string> all;
    const Instant end = now_ + time;
    while (now_ < end) {
      for (std::string& frame : exchange()) {
        all.push_back(std::move(frame));
      }
      if (acknowledges) {
        line_->acknowledged(given_, now_);
      }
      now_ = std::min(end, std::max(now_ + milliseconds(1), line_->next_wake()));
      line_->advance(now_);
    }
    return all;
  }
  void bus_becomes(can::BusState state) {
    line_->bus_event({.kind = can::BusEvent::Kind::state, .state = state, .time = now_});
    line_->advance(now_);
  }
  bool reported(lss::Verdict verdict) {
    return std::ranges::any_of(events(), [verdict](const Event& event) {
      const auto* const result = event.get<event::LssResult>();
      return result != nullptr && result->verdict == verdict;
    });
  }

  std::uint64_t given_ = 0;
  lss::Slave slave{{0x123, 0x42, 1, 1}, nullptr};
  can::TransmitQueue answers{8};
};

TEST_F(LssAssignTest, ALateWakeUpAfterTheCheckOfTheNodeIdStartsNoBoot) {
  make_checked();
  line_->start(now_);
  until(kUpload);
  EXPECT_THAT(wake_after(milliseconds(700)), Contains(StartsWith(kUpload)));
  EXPECT_THAT(wake_after(milliseconds(900)),
              AllOf(Contains(StartsWith(kGive)), Not(Contains(kResetAll))));
  until(kResetAll);
}

TEST_F(LssAssignTest, ALateWakeUpBeforeAnAcknowledgementStartsNoBoot) {
  make_checked();
  line_->expect_acknowledgements();
  line_->start(now_);
  exchange();
  for (int i = 0; i < 5; ++i) {
    EXPECT_THAT(wake_after(milliseconds(1500)), Not(Contains(kResetAll)));
    line_->acknowledged(given_, now_);
  }
  EXPECT_THAT(run_for(seconds(5), true), IsSupersetOf({StartsWith(kGive), StartsWith(kResetAll)}));
}

TEST_F(LssAssignTest, ANodeIdIsNotFreeWhileTheQuestionIsNotAcknowledged) {
  make_checked();
  line_->expect_acknowledgements();
  line_->start(now_);
  until(kUpload);
  EXPECT_THAT(run_for(seconds(20), false), Not(Contains(StartsWith(kGive))));
  EXPECT_FALSE(reported(lss::Verdict::given));
  EXPECT_THAT(run_for(seconds(3), true), Contains(StartsWith(kGive)));
}

TEST_F(LssAssignTest, AQuestionThatIsAcknowledgedTooLateForAnAnswerDoesNotCount) {
  make_checked();
  line_->expect_acknowledgements();
  line_->start(now_);
  until(kUpload);
  for (int i = 0; i < 10; ++i) {
    EXPECT_THAT(run_for(milliseconds(490), false), Not(Contains(StartsWith(kGive))));
    line_->acknowledged(given_, now_);
    EXPECT_THAT(run_for(milliseconds(10), false), Not(Contains(StartsWith(kGive))));
  }
}

TEST_F(LssAssignTest, AQuestionThatWasLostDoesNotCount) {
  make_checked();
  line_->expect_acknowledgements();
  line_->start(now_);
  until(kUpload);
  for (int i = 0; i < 10; ++i) {
    line_->lost(1, given_);
    EXPECT_THAT(run_for(milliseconds(500), false), Not(Contains(StartsWith(kGive))));
  }
}

// A device with the node-ID is connected while the interface of the line has failed.
TEST_F(LssAssignTest, AfterTheInterfaceFailedTheNodeIdIsCheckedAgain) {
  lose_the_bus_at_the_question();
  EXPECT_THAT(run_for(milliseconds(600), true), Not(Contains(StartsWith(kGive))));
  hear(0x705, {0x7F});
  EXPECT_THAT(run_for(seconds(5), true), Not(Contains(StartsWith(kGive))));
}

TEST_F(LssAssignTest, TheRoundBeginsAgainWhenTheBusIsBack) {
  lose_the_bus_at_the_question();
  EXPECT_THAT(run_for(seconds(10), true), Contains(StartsWith(kGive)));
}

TEST_F(LssAssignTest, ACommandEndsWhenTheInterfaceFails) {
  LineConfig config = config_with_axis();
  config.sdo_timeout = milliseconds(500);
  make(std::move(config));
  line_->start(now_);
  run_for(milliseconds(10), true);
  line_->execute({.tag = 1,
                  .request = LssRequest{.procedure = lss::Procedure::switch_global,
                                        .arguments = {std::byte{1}}}},
                 now_);
  run_for(milliseconds(10), true);
  EXPECT_EQ(answer().error, Error{});
  line_->execute({.tag = 2,
                  .request = LssRequest{.procedure = lss::Procedure::configure_node_id,
                                        .arguments = {std::byte{7}}}},
                 now_);
  run_for(milliseconds(300), true);
  bus_becomes(can::BusState::bus_off);
  EXPECT_EQ(answer().error, to_error(Refusal::line_down));
  pass(seconds(3));
  bus_becomes(can::BusState::error_active);
  EXPECT_THAT(run_for(seconds(3), true), Not(Contains(StartsWith("7E5#1107"))));
}

class LssCommandsOfALine : public LssAssignTest {
 protected:
  void SetUp() override {
    LineConfig config = config_with_axis();
    config.sdo_timeout = milliseconds(500);
    make(std::move(config));
    line_->start(now_);
    run_for(milliseconds(10), true);
  }
  void begin(lss::Procedure procedure, std::initializer_list<unsigned> data) {
    LssRequest request{.procedure = procedure};
    for (const unsigned byte : data) {
      request.arguments.push_back(static_cast<std::byte>(byte));
    }
    line_->execute({.request = std::move(request)}, now_);
  }
  Reply lss(lss::Procedure procedure, std::initializer_list<unsigned> data) {
    begin(procedure, data);
    run_for(seconds(3), true);
    return answer();
  }
  lss::Outcome give(unsigned node) {
    const Reply reply = lss(lss::Procedure::configure_node_id, {node});
    EXPECT_TRUE(reply.ok());
    return reply.bytes().empty() ? lss::Outcome::no_answer
                                 : static_cast<lss::Outcome>(reply.bytes().front());
  }
  void stop_own() {
    line_->execute({.request = NmtRequest{.node = 127, .command = nmt::Command::stop}}, now_);
    EXPECT_TRUE(answer().ok());
  }
};

TEST_F(LssCommandsOfALine, TheSelectedDeviceMayBeGivenItsNodeIdAgain) {
  lss(lss::Procedure::switch_global, {1});
  EXPECT_EQ(give(7), lss::Outcome::done);
  EXPECT_EQ(give(7), lss::Outcome::done) << "still in configuration state";
  lss(lss::Procedure::switch_global, {1});
  EXPECT_EQ(give(7), lss::Outcome::node_id_in_use) << "another device may be selected";
}

TEST_F(LssCommandsOfALine, ANodeIdThatCannotBeCheckedIsNotCalledUsed) {
  lss(lss::Procedure::switch_global, {1});
  for (std::uint64_t i = 0; i < 65; ++i) {
    line_->execute({.tag = 100 + i, .request = SdoRead{.node = 7, .address = {0x1000, 0}}}, now_);
  }
  begin(lss::Procedure::configure_node_id, {7});
  run_for(milliseconds(400), true);
  EXPECT_EQ(answer().error, to_error(Refusal::busy));
}

TEST_F(LssCommandsOfALine, ANodeIdThatAStoppedGatewayCannotCheckIsNotCalledUsed) {
  lss(lss::Procedure::switch_global, {1});
  begin(lss::Procedure::configure_node_id, {8});
  run_for(milliseconds(300), true);
  stop_own();
  run_for(seconds(1), true);
  EXPECT_EQ(answer().error, to_error(Refusal::wrong_state));
}

TEST_F(LssCommandsOfALine, AServiceThatTheBusDoesNotAcknowledgeIsNotCalledUnanswered) {
  line_->expect_acknowledgements();
  given_ = 0;
  begin(lss::Procedure::inquire_node_id, {});
  run_for(seconds(2), false);
  EXPECT_EQ(answer().error, to_error(Refusal::no_acknowledge));
  line_->acknowledged(given_, now_);
  begin(lss::Procedure::inquire_node_id, {});
  run_for(seconds(2), true);
  EXPECT_TRUE(answer().ok());
}

TEST_F(LssCommandsOfALine, AServiceWhoseFrameIsLostIsNotCalledUnanswered) {
  line_->expect_acknowledgements();
  given_ = 0;
  begin(lss::Procedure::inquire_node_id, {});
  exchange();
  line_->lost(1, 9);
  run_for(seconds(2), false);
  EXPECT_EQ(answer().error, to_error(Refusal::no_acknowledge));
}

// The device may get the node-ID when the bus is available again, so the line does not assign it to
// another device.
TEST_F(LssAssignTest, ANodeIdThatIsGivenWaitsForItsAcknowledgement) {
  make_checked();
  line_->expect_acknowledgements();
  line_->start(now_);
  until(kGive);
  EXPECT_THAT(run_for(seconds(20), false), Not(Contains(StartsWith("7E5"))));
}

TEST_F(LssAssignTest, ANodeIdThatCannotBeCheckedIsReportedAsThat) {
  make_checked();
  line_->start(now_);
  until(kUpload);
  line_->execute({.request = NmtRequest{.node = 127, .command = nmt::Command::stop}}, now_);
  run_for(seconds(3), true);
  const std::vector<Event> all = events();
  const auto result = std::ranges::find(all, EventKind::lss_result, &Event::kind);
  ASSERT_NE(result, all.end());
  EXPECT_EQ(std::get<event::LssResult>(result->data).verdict, lss::Verdict::node_id_unchecked);
}

// The device got its node-ID and sends nothing.
TEST_F(LssAssignTest, NmtResetCommunicationWaitsForTheBus) {
  make_checked();
  line_->start(now_);
  until(kGive);
  run_for(milliseconds(300), true);
  bus_becomes(can::BusState::bus_off);
  pass(seconds(10));
  EXPECT_FALSE(reported(lss::Verdict::reset_to_boot));
  bus_becomes(can::BusState::error_active);
  EXPECT_THAT(run_for(milliseconds(900), true), Not(Contains("000#8205")));
  EXPECT_THAT(run_for(milliseconds(300), true), Contains("000#8205"));
  EXPECT_TRUE(reported(lss::Verdict::reset_to_boot));
}

// --- commands of clients -------------------------------------------------------------------------

class LssCommandsOfAClient : protected WithPace, public LssCommandsOfALine {
 protected:
  static constexpr std::uint32_t kClient = 7;

  void select(std::uint32_t client) {
    LssRequest request{.procedure = lss::Procedure::switch_selective};
    lss::put({0x123, 0x42, 1, 1}, request.arguments);
    line_->execute({.client = client, .request = std::move(request)}, now_);
  }
  bool is_answered() {
    Reply reply;
    return line_->pop_reply(reply);
  }
  // LSS frames that the line sends in that time.
  std::ptrdiff_t sent_in(Duration time) {
    return std::ranges::count_if(run_for(time, true), StartsWithLss());
  }

 private:
  struct StartsWithLss {
    bool operator()(const std::string& frame) const { return frame.starts_with("7E5#"); }
  };
};

TEST_F(LssCommandsOfAClient, EachFrameWaitsForTheShare) {
  line_->set_pace(pace_);
  select(kClient);
  EXPECT_EQ(sent_in(seconds(5)), 0);
  EXPECT_FALSE(line_->wants_to_send(now_)) << "the bus would be polled without a pause";
  EXPECT_LE(line_->next_wake(), now_ + milliseconds(1));
  pace_.left = 1;
  EXPECT_EQ(sent_in(seconds(5)), 1);
  EXPECT_FALSE(is_answered()) << "neither unsent nor unanswered";
  pace_.left = 10;
  EXPECT_EQ(sent_in(seconds(1)), 3);
  EXPECT_TRUE(answer().ok());
  EXPECT_EQ(pace_.counted, (std::map<std::uint32_t, int>{{kClient, 5}})) << "with the response";
}

TEST_F(LssCommandsOfAClient, ThoseOfTheLineItselfDoNotWait) {
  line_->set_pace(pace_);
  select(0);
  EXPECT_EQ(sent_in(seconds(1)), 4);
  EXPECT_TRUE(answer().ok());
  EXPECT_TRUE(pace_.counted.empty());
}

TEST_F(LssCommandsOfAClient, OneClientDoesNotTakeAllPlaces) {
  line_->set_pace(pace_);
  for (int i = 0; i < 16; ++i) {
    select(kClient);
    EXPECT_FALSE(is_answered()) << i;
  }
  select(kClient);
  EXPECT_EQ(answer().error, to_error(Refusal::busy));
  select(kClient + 1);
  EXPECT_FALSE(is_answered());
}

}  // namespace
}  // namespace linegate::line

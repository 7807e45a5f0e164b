// SPDX-License-Identifier: Apache-2.0
// The command `boot`, byte by byte: the test simulates the device.
#include <algorithm>

#include "stack/manager/boot_event.h"

#include "tests/stack/line/line_fixture.h"

namespace linegate::line {
namespace {

using testing::Contains;
using testing::ElementsAre;
using testing::IsEmpty;
using testing::Not;

class BootCommandTest : public LineTest {
 protected:
  void ask(std::uint8_t node, Duration timeout = {}) {
    Command command{.tag = 7, .timeout = timeout, .request = Boot{.node = node}};
    line_->execute(std::move(command), now_);
  }

  bool answered() { return line_->pop_reply(reply_); }

  // Answers the SDO requests that are on the bus.
  void answer_sdo(std::initializer_list<std::uint8_t> data) {
    sent();
    hear(0x585, data);
  }
  void answer_identity() {
    answer_sdo({0x43, 0x00, 0x10, 0x00, 0x92, 0x01, 0x02, 0x00});
    answer_sdo({0x43, 0x18, 0x10, 0x01, 0x23, 0x01, 0x00, 0x00});
    answer_sdo({0x43, 0x18, 0x10, 0x02, 0x42, 0x00, 0x00, 0x00});
    answer_sdo({0x80, 0x18, 0x10, 0x04, 0x11, 0x00, 0x09, 0x06});
    hear_no_pdo_records();
  }

  Reply reply_;
};

TEST_F(BootCommandTest, ResetsTheNodeAndAnswersWhenItIsBooted) {
  make(config_with_axis());
  boot();
  ask(5);
  EXPECT_THAT(sent(), ElementsAre("000#8205"));
  hear(0x705, {0x00});
  EXPECT_THAT(sent(), ElementsAre("605#4000100000000000"));
  answer_identity();
  hear(0x585, {0x60, 0x17, 0x10, 0x00, 0, 0, 0, 0});
  line_->advance(now_);
  EXPECT_FALSE(answered()) << "no heartbeat was received";
  hear(0x705, {0x7F});
  line_->advance(now_);
  ASSERT_TRUE(answered());
  EXPECT_TRUE(reply_.ok());
  EXPECT_EQ(reply_.tag, 7U);
  const auto* const outcomes = std::get_if<std::vector<manager::BootOutcome>>(&reply_.data);
  ASSERT_NE(outcomes, nullptr);
  ASSERT_EQ(outcomes->size(), 1U);
  EXPECT_EQ(outcomes->at(0), (manager::BootOutcome{.node = 5, .letter = manager::kBooted}));
}

TEST_F(BootCommandTest, ANodeThatDidNotReceiveItsResetIsResetAgain) {
  make(config_with_axis());
  boot();
  ask(5);
  EXPECT_THAT(sent(), ElementsAre("000#8205"));
  pass(milliseconds(50));
  hear(0x705, {0x05});
  EXPECT_THAT(sent(), IsEmpty()) << "the heartbeat may precede the reset";
  for (int i = 0; i < 3; ++i) {
    pass(milliseconds(100));
    hear(0x705, {0x05});
    EXPECT_THAT(sent(), ElementsAre("000#8205")) << i;
  }
  pass(milliseconds(100));
  hear(0x705, {0x05});
  EXPECT_THAT(sent(), IsEmpty()) << "at most three resets";
  hear(0x705, {0x00});
  EXPECT_THAT(sent(), ElementsAre("605#4000100000000000"));
}

TEST_F(BootCommandTest, AResetThatWasMissedIsSeenInEachStepUntilTheBootUpMessage) {
  make(config_with_axis());
  boot();
  ask(5);
  pass(milliseconds(1000));
  EXPECT_THAT(sent(), ElementsAre("000#8205", "605#4000100000000000"));
  answer_identity();
  sent();
  hear(0x705, {0x04});
  EXPECT_THAT(sent(), Contains("000#8205")) << "the node is Stopped";
  hear(0x705, {0x00});
  EXPECT_THAT(sent(), ElementsAre("605#4000100000000000"));
  pass(milliseconds(200));
  hear(0x705, {0x05});
  EXPECT_THAT(sent(), Not(Contains("000#8205"))) << "started by itself after boot-up";
}

TEST_F(BootCommandTest, ANodeThatIsStartedWhileItBootsIsNotResetForIt) {
  make(config_with_axis());
  boot();
  ask(5);
  sent();
  pass(milliseconds(200));
  line_->execute({.tag = 8, .request = NmtRequest{.node = 5, .command = nmt::Command::start}},
                 now_);
  EXPECT_THAT(sent(), ElementsAre("000#0105"));
  hear(0x705, {0x05});
  EXPECT_THAT(sent(), IsEmpty());
}

// A device that came back from repair with a new minor revision.
TEST_F(BootCommandTest, TheMajorRevisionMayBeAllThatIsCompared) {
  for (const bool major_alone : {true, false}) {
    LineConfig config = config_with_axis();
    for (od::ObjectDescription& object : config.nodes.front().device.objects) {
      if (object.index == 0x1018) {
        od::VariableDescription revision = object.variables.back();
        revision.sub = 3;
        revision.value = {std::byte{2}, std::byte{0}, std::byte{1}, std::byte{0}};
        std::erase_if(object.variables, [](const auto& variable) { return variable.sub >= 3; });
        object.variables.push_back(revision);
      }
    }
    config.nodes.front().check.revision_major_alone = major_alone;
    make(std::move(config));
    boot();
    ask(5);
    hear(0x705, {0x00});
    hear(0x585, {0x43, 0x00, 0x10, 0x00, 0x92, 0x01, 0x02, 0x00});
    hear(0x585, {0x43, 0x18, 0x10, 0x01, 0x23, 0x01, 0x00, 0x00});
    hear(0x585, {0x43, 0x18, 0x10, 0x02, 0x42, 0x00, 0x00, 0x00});
    (void)sent();
    hear(0x585, {0x43, 0x18, 0x10, 0x03, 0x07, 0x00, 0x01, 0x00});
    line_->advance(now_);
    EXPECT_EQ(sent().empty(), !major_alone) << "requests the serial number, or ends with N";
    EXPECT_EQ(answered(), !major_alone);
  }
}

TEST_F(BootCommandTest, OfAllAsksEveryListedNode) {
  make(config_with_axis());
  boot();
  ask(0);
  EXPECT_THAT(sent(), ElementsAre("000#8200"));
  hear(0x705, {0x00});
  hear(0x585, {0x43, 0x00, 0x10, 0x00, 0x91, 0x01, 0x0F, 0x00});
  line_->advance(now_);
  ASSERT_TRUE(answered());
  EXPECT_TRUE(reply_.ok()) << "the boot result has the error, not the reply";
  const auto* const outcomes = std::get_if<std::vector<manager::BootOutcome>>(&reply_.data);
  ASSERT_NE(outcomes, nullptr);
  ASSERT_EQ(outcomes->size(), 1U);
  EXPECT_EQ(outcomes->at(0).letter, 'C');
  EXPECT_EQ(outcomes->at(0).finding.object, (od::Address{0x1000, 0}));
  EXPECT_EQ(outcomes->at(0).finding.expected, 0x20192U);
  EXPECT_EQ(outcomes->at(0).finding.found, 0xF0191U);
}

TEST_F(BootCommandTest, IsRefusedForTheOwnNodeAndWhatIsNone) {
  make(config_with_axis());
  boot();
  ask(127);
  ASSERT_TRUE(answered());
  EXPECT_EQ(reply_.error, to_error(Refusal::bad_request));
  ask(128);
  ASSERT_TRUE(answered());
  EXPECT_EQ(reply_.error, to_error(Refusal::bad_request));
}

TEST_F(BootCommandTest, IsTheManagersAlone) {
  LineConfig config = config_with_axis();
  config.role = Role::device;
  make(config);
  line_->start(now_);
  ask(5);
  ASSERT_TRUE(answered());
  EXPECT_EQ(reply_.error, to_error(Refusal::wrong_role));
}

TEST_F(BootCommandTest, EndsWithItsOwnTimeOutAndWithTheLine) {
  make(config_with_axis());
  boot();
  ask(5, seconds(2));
  pass(milliseconds(1999));
  EXPECT_FALSE(answered());
  pass(milliseconds(2));
  ASSERT_TRUE(answered());
  EXPECT_EQ(reply_.error, to_error(Refusal::timed_out));
  ask(5);
  line_->stop(now_);
  ASSERT_TRUE(answered());
  EXPECT_EQ(reply_.error, to_error(Refusal::cancelled));
  EXPECT_FALSE(answered());
}

TEST_F(BootCommandTest, AnAbsentNodeIsAnsweredWhenItsBootTimeOutIsOver) {
  LineConfig config = config_with_axis();
  config.nodes[0].boot_timeout = seconds(3);
  make(config);
  line_->start(now_);
  ask(5);
  pass(milliseconds(2900));
  EXPECT_FALSE(answered());
  pass(seconds(2));
  ASSERT_TRUE(answered());
  const auto* const outcomes = std::get_if<std::vector<manager::BootOutcome>>(&reply_.data);
  ASSERT_NE(outcomes, nullptr);
  ASSERT_EQ(outcomes->size(), 1U);
  EXPECT_EQ(outcomes->at(0).letter, 'B');
  EXPECT_EQ(outcomes->at(0).finding.abort, AbortCode::timeout);
}

// --- a program ---

TEST_F(BootCommandTest, ADeviceThatRestartsWhileItsProgramIsWrittenIsReportedAsSuch) {
  make(config_with_axis());
  boot();
  line_->execute(
      {.tag = 7,
       .timeout = seconds(60),
       .request = ProgramDownload{.node = 5, .number = 1, .program = std::vector<std::byte>(10)}},
      now_);
  answer_sdo({0x4F, 0x51, 0x1F, 0x01, 0, 0, 0, 0});
  answer_sdo({0x60, 0x51, 0x1F, 0x01, 0, 0, 0, 0});
  EXPECT_THAT(sent(), ElementsAre("605#21501F010A000000"));
  hear(0x585, {0x60, 0x50, 0x1F, 0x01, 0, 0, 0, 0});
  hear(0x585, {0x20, 0, 0, 0, 0, 0, 0, 0});
  hear(0x705, {0x00});
  pass(seconds(20));
  ASSERT_TRUE(answered());
  EXPECT_EQ(reply_.error, to_error(AbortCode::device_state));
  EXPECT_EQ(reply_.data, (ReplyData{ProgramFault{{0x1F50, 1}, kProgramRestarted}}));
}

// --- answers of the node while it is configured ---

class MandatoryNodeTest : public BootCommandTest {
 protected:
  // Boots the node up to the first write of its configuration, the heartbeat.
  void SetUp() override {
    LineConfig config = config_with_axis();
    config.nodes[0].mandatory = true;
    config.nodes[0].boot_timeout = seconds(2);
    make(config);
    line_->start(now_);
    hear(0x705, {0x00});
    answer_identity();
    ASSERT_THAT(sent(), testing::Contains("605#2B17100064000000"));
  }

  void abort_the_heartbeat() { hear(0x585, {0x80, 0x17, 0x10, 0x00, 0x01, 0x00, 0x04, 0x05}); }

  void expect_it_is_asked_again() {
    EXPECT_EQ(line_->node_state(5).boot, 'J');
    EXPECT_EQ(line_->state().manager, ManagerState::missing_mandatory);
    sent();
    pass(seconds(1));
    EXPECT_THAT(sent(), testing::Contains("605#4000100000000000"));
    answer_identity();
    answer_sdo({0x60, 0x17, 0x10, 0x00, 0, 0, 0, 0});
    hear(0x705, {0x7F});
    EXPECT_EQ(line_->state().manager, ManagerState::running);
  }
};

TEST_F(MandatoryNodeTest, ARefusedEntryHaltsTheNetwork) {
  hear(0x585, {0x80, 0x17, 0x10, 0x00, 0x30, 0x00, 0x09, 0x06});
  EXPECT_EQ(line_->state().manager, ManagerState::halted);
  sent();
  pass(seconds(3));
  EXPECT_THAT(sent(), testing::Each(testing::Not(testing::StartsWith("605#"))))
      << "no further boot attempt: it would be refused, too";
}

// A controller with several transmit buffers sends the SDO response before the boot-up message.
TEST_F(MandatoryNodeTest, ARefusalBeforeItsBootUpMessageDoesNotStopTheNetwork) {
  hear(0x585, {0x80, 0x17, 0x10, 0x00, 0x30, 0x00, 0x09, 0x06});
  pass(milliseconds(3));
  hear(0x705, {0x00});
  answer_identity();
  answer_sdo({0x60, 0x17, 0x10, 0x00, 0, 0, 0, 0});
  hear(0x705, {0x7F});
  pass(milliseconds(100));
  EXPECT_EQ(line_->state().manager, ManagerState::running);
  EXPECT_NE(line_->state().network, 0x90);
  EXPECT_THAT(sent(), testing::Not(testing::Contains("000#0200")));
}

TEST_F(MandatoryNodeTest, RefusalsBeforeItsBootUpMessageAgainAndAgainAreRestarts) {
  for (int i = 0; i < 2; ++i) {
    hear(0x585, {0x80, 0x17, 0x10, 0x00, 0x30, 0x00, 0x09, 0x06});
    hear(0x705, {0x00});
    if (i == 0) {
      answer_identity();
    }
  }
  sent();
  pass(milliseconds(90));
  EXPECT_THAT(sent(), testing::Each(testing::Not(testing::StartsWith("605#")))) << "a pause";
  pass(seconds(1));
  EXPECT_THAT(sent(), testing::Contains("605#4000100000000000"));
  for (int i = 0; i < 4; ++i) {
    answer_identity();
    hear(0x585, {0x80, 0x17, 0x10, 0x00, 0x30, 0x00, 0x09, 0x06});
    hear(0x705, {0x00});
    pass(seconds(2));
  }
  EXPECT_EQ(line_->node_state(5).boot, 'R');
  EXPECT_NE(line_->state().network, 0x90);
}

TEST_F(MandatoryNodeTest, ALostAnswerDoesNot) {
  pass(milliseconds(600));
  expect_it_is_asked_again();
}

TEST_F(MandatoryNodeTest, AShortAnswerDoesNot) {
  hear(0x585, {0x80, 0x17, 0x10, 0x00, 0x30});
  pass(milliseconds(600));
  expect_it_is_asked_again();
}

TEST_F(MandatoryNodeTest, AnAbortWithoutACodeDoesNot) {
  hear(0x585, {0x80, 0x17, 0x10, 0x00, 0, 0, 0, 0});
  expect_it_is_asked_again();
}

TEST_F(MandatoryNodeTest, AnAbortOfSomethingElseDoesNot) {
  hear(0x585, {0x80, 0x00, 0x18, 0x01, 0x30, 0x00, 0x09, 0x06});
  expect_it_is_asked_again();
}

TEST_F(MandatoryNodeTest, AnAnswerToSomethingElseDoesNot) {
  hear(0x585, {0x60, 0x00, 0x18, 0x01, 0, 0, 0, 0});
  expect_it_is_asked_again();
}

TEST_F(MandatoryNodeTest, AServerThatLostTheThreadDoesNot) {
  hear(0x585, {0x80, 0x17, 0x10, 0x00, 0x01, 0x00, 0x04, 0x05});
  expect_it_is_asked_again();
}

// A device without segmented transfer aborts every download of more than four bytes with 0504
// 0001h.
TEST_F(MandatoryNodeTest, AServerThatSaysSoThreeTimesRefuses) {
  constexpr auto kHeartbeat = "605#2B17100064000000";
  for (int i = 0; i < 3; ++i) {
    EXPECT_NE(line_->state().manager, ManagerState::halted) << i;
    hear(0x585, {0x80, 0x17, 0x10, 0x00, 0x01, 0x00, 0x04, 0x05});
    if (i < 2) {
      EXPECT_THAT(manager::describe_boot('J', line_->node_state(5).finding),
                  testing::EndsWith("; requested again every second"));
      sent();
      pass(seconds(1));
      answer_identity();
      ASSERT_THAT(sent(), testing::Contains(kHeartbeat));
    }
  }
  EXPECT_EQ(line_->state().manager, ManagerState::halted);
  EXPECT_EQ(manager::describe_boot('J', line_->node_state(5).finding),
            "configuration failed: 1017:00 ended with 05040001h, command specifier not valid or "
            "unknown, 3 times in a row");
  const std::vector<Event> told = events();
  EXPECT_EQ(std::ranges::count(told, EventKind::boot_result, &Event::kind), 2);
  EXPECT_EQ(std::ranges::count(told, EventKind::configuration_error, &Event::kind), 1);
  sent();
  pass(seconds(3));
  EXPECT_THAT(sent(), testing::Each(testing::Not(testing::StartsWith("605#"))));
}

TEST_F(MandatoryNodeTest, AServerThatSaysSoMayStillBeStartingUntilItsBootTimeOutIsOver) {
  LineConfig config = config_with_axis();
  config.nodes[0].mandatory = true;
  config.nodes[0].boot_timeout = seconds(6);
  make(config);
  line_->start(now_);
  const auto abort_for = [this](int times) {
    hear(0x705, {0x00});
    answer_identity();
    for (int i = 0; i < times; ++i) {
      abort_the_heartbeat();
      pass(seconds(1));
      answer_identity();
    }
  };
  abort_for(5);
  EXPECT_EQ(line_->state().manager, ManagerState::missing_mandatory);
  hear(0x585, {0x60, 0x17, 0x10, 0x00, 0, 0, 0, 0});
  hear(0x705, {0x7F});
  EXPECT_EQ(line_->state().manager, ManagerState::running);

  abort_for(6);
  EXPECT_FALSE(manager::is_refusal(line_->node_state(5).finding)) << "reset by each boot-up";
  abort_the_heartbeat();
  EXPECT_TRUE(manager::is_refusal(line_->node_state(5).finding));
}

// The node is configured nevertheless, at each boot.
TEST_F(BootCommandTest, ADateThatANodeDoesNotTakeIsToldAtEachBoot) {
  LineConfig config = config_with_axis();
  config.nodes[0].store = 1;  // with a date in 1020h
  make(config);
  line_->start(now_);
  sent();
  for (int i = 0; i < 2; ++i) {
    events();
    hear(0x705, {0x00});
    answer_identity();
    EXPECT_THAT(sent(), testing::Contains("605#4020100100000000"));
    hear(0x585, {0x43, 0x20, 0x10, 0x01, 0, 0, 0, 0});
    hear_no_pdo_records();
    EXPECT_THAT(sent(), testing::Contains("605#2B17100064000000"));
    hear(0x585, {0x60, 0x17, 0x10, 0x00, 0, 0, 0, 0});
    EXPECT_THAT(sent(), testing::Contains(testing::StartsWith("605#23201001")));
    hear(0x585, {0x80, 0x20, 0x10, 0x01, 0x01, 0x00, 0x04, 0x05});
    hear(0x705, {0x7F});
    const std::vector<Event> told = events();
    EXPECT_EQ(std::ranges::count(told, EventKind::configuration_error, &Event::kind), 1) << i;
    EXPECT_EQ(line_->node_state(5).boot, manager::kBooted);
  }
}

TEST_F(MandatoryNodeTest, ALostFrameBetweenThemBeginsTheCountAnew) {
  for (int i = 0; i < 4; ++i) {
    if (i == 2) {
      pass(milliseconds(600));
    } else {
      hear(0x585, {0x80, 0x17, 0x10, 0x00, 0x01, 0x00, 0x04, 0x05});
    }
    pass(seconds(1));
    answer_identity();
  }
  EXPECT_EQ(line_->state().manager, ManagerState::missing_mandatory);
}

TEST_F(MandatoryNodeTest, A1000hThatIsRefusedIsToldAndAskedForWithoutEnd) {
  ask(5);
  hear(0x705, {0x00});
  sent();
  for (int i = 0; i < 12; ++i) {
    hear(0x585, {0x80, 0x00, 0x10, 0x00, 0x00, 0x00, 0x02, 0x06});
    EXPECT_EQ(line_->node_state(5).presence, Presence::present) << "the node responds";
    sent();
    pass(seconds(1));
    EXPECT_THAT(sent(), testing::Contains("605#4000100000000000"));
  }
  EXPECT_EQ(line_->state().manager, ManagerState::missing_mandatory);
  EXPECT_EQ(
      manager::describe_boot(line_->node_state(5).boot, line_->node_state(5).finding),
      "1000h cannot be read: 1000:00 ended with 06020000h, object does not exist in the object "
      "dictionary; requested again every second");
}

// The previous response, an abort, is received a second time.
TEST_F(MandatoryNodeTest, AnAnswerThatComesTwiceIsHeardOnce) {
  hear(0x585, {0x80, 0x00, 0x16, 0x02, 0x00, 0x00, 0x02, 0x06});
  EXPECT_EQ(line_->state().manager, ManagerState::booting);
  hear(0x585, {0x60, 0x17, 0x10, 0x00, 0, 0, 0, 0});
  hear(0x705, {0x7F});
  EXPECT_EQ(line_->state().manager, ManagerState::running);
}

}  // namespace
}  // namespace linegate::line

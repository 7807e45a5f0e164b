// SPDX-License-Identifier: Apache-2.0
// Sleep with a bus that acknowledges frames, or does not; lines that are stopped, absent or change
// their role; and what the nodes do by themselves at the wake-up.
#include <algorithm>
#include <string>
#include <vector>

#include "stack/storage/medium.h"

#include "tests/stack/line/sleep_fixture.h"

namespace linegate::line {
namespace {

using testing::Contains;
using testing::IsEmpty;
using testing::Not;

class SleepOnTheBus : public SleepTest {
 protected:
  void acknowledge_all() {
    hand_out_all();
    line_->acknowledged(line_->state().counters.frames_sent, now_);
    line_->advance(now_);
  }
  void run_acknowledged() { run_acknowledged(sleepy()); }
  void run_acknowledged(LineConfig config) {
    make(std::move(config));
    line_->expect_acknowledgements();
    boot();
    acknowledge_all();
    pass(milliseconds(1));
    acknowledge_all();
    sent();
    events();
  }
  // Passes that time while the bus acknowledges nothing.
  std::vector<std::string> pass_unacknowledged(Duration time) {
    pass(time);
    return sent();
  }
  Refusal refusal() {
    Reply reply;
    EXPECT_TRUE(line_->pop_reply(reply));
    return reply.error.domain == Domain::command ? static_cast<Refusal>(reply.error.code)
                                                 : Refusal::none;
  }
  void interface_fails() {
    line_->bus_event({.kind = can::BusEvent::Kind::interface_failed, .time = now_});
  }
  void set_role(std::uint32_t startup) {
    ASSERT_TRUE(line_->dictionary().set({0x1F80, 0}, startup));
    line_->advance(now_);
  }
};

TEST_F(SleepOnTheBus, WithoutAnInterfaceNothingIsDone) {
  run(sleepy());
  interface_fails();
  for (const SleepAction action : {SleepAction::check, SleepAction::sleep, SleepAction::prepare}) {
    ask(action);
    EXPECT_EQ(refusal(), Refusal::line_down);
    EXPECT_EQ(phase(), SleepPhase::awake);
  }
}

TEST_F(SleepOnTheBus, WithoutAnInterfaceALineThatSleepsIsNotWoken) {
  run(sleepy());
  fall_asleep();
  interface_fails();
  ask(SleepAction::wake);
  EXPECT_EQ(refusal(), Refusal::line_down);
  EXPECT_EQ(phase(), SleepPhase::asleep);
  line_->bus_event({.kind = can::BusEvent::Kind::interface_ready, .time = now_});
  pass(seconds(1));
  expect_silence();
  ask(SleepAction::wake);
  EXPECT_EQ(refusal(), Refusal::none);
  EXPECT_EQ(phase(), SleepPhase::awake);
}

TEST_F(SleepOnTheBus, ACheckThatNobodyReceivesIsNotDone) {
  run_acknowledged();
  for (const SleepAction action : {SleepAction::check, SleepAction::sleep}) {
    ask(action);
    EXPECT_THAT(sent(), Contains("690#01"));
    EXPECT_THAT(pass_unacknowledged(seconds(3)), Not(Contains("690#02")));
    EXPECT_EQ(refusal(), Refusal::no_acknowledge);
    EXPECT_EQ(phase(), SleepPhase::awake);
  }
}

TEST_F(SleepOnTheBus, SleepIsDoneWhenPrepareIsOnTheBus) {
  run_acknowledged();
  ask(SleepAction::sleep);
  acknowledge_all();
  pass(seconds(1));
  EXPECT_EQ(phase(), SleepPhase::prepare);
  EXPECT_THAT(sent(), Contains("690#02"));
  EXPECT_EQ(reply(), "-");
  acknowledge_all();
  EXPECT_EQ(reply(), "");
  pass(seconds(1));
  EXPECT_EQ(phase(), SleepPhase::silent);
}

TEST_F(SleepOnTheBus, PrepareThatNobodyReceivesIsNotDone) {
  run_acknowledged();
  ask(SleepAction::prepare);
  EXPECT_THAT(sent(), Contains("690#02"));
  EXPECT_THAT(pass_unacknowledged(seconds(1)), Contains("690#03"));
  EXPECT_EQ(refusal(), Refusal::no_acknowledge);
  EXPECT_EQ(phase(), SleepPhase::awake);
}

TEST_F(SleepOnTheBus, ALostMessageIsNotDone) {
  run_acknowledged();
  ask(SleepAction::check);
  hand_out_all();
  const std::uint64_t last = line_->state().counters.frames_sent;
  line_->lost(last, last);
  line_->acknowledged(last, now_);
  pass(seconds(1));
  EXPECT_EQ(refusal(), Refusal::no_acknowledge);
}

// The command has a time of its own, which may be over before that of the phase.
TEST_F(SleepOnTheBus, ARefusedPrepareDoesNotSleepLater) {
  for (const Duration timeout : {Duration{}, Duration{milliseconds(100)}}) {
    LineConfig config = sleepy();
    config.sleep.prepare_time = seconds(3);
    run_acknowledged(std::move(config));
    line_->execute({.tag = 7, .timeout = timeout, .request = SleepRequest{SleepAction::prepare}},
                   now_);
    EXPECT_THAT(sent(), Contains("690#02"));
    EXPECT_THAT(pass_unacknowledged(seconds(1)), Contains("690#03"));
    EXPECT_EQ(refusal(), Refusal::no_acknowledge);
    EXPECT_EQ(phase(), SleepPhase::awake);
    pass(milliseconds(500));
    acknowledge_all();
    pass(seconds(20));
    EXPECT_EQ(phase(), SleepPhase::awake);
  }
}

TEST_F(SleepOnTheBus, ARefusedSleepDoesNotSleepLater) {
  LineConfig config = sleepy();
  config.sleep.prepare_time = seconds(3);
  run_acknowledged(std::move(config));
  ask(SleepAction::sleep);
  acknowledge_all();
  pass(seconds(1));
  ASSERT_EQ(phase(), SleepPhase::prepare);
  hand_out_all();
  pass(seconds(1));
  EXPECT_EQ(refusal(), Refusal::no_acknowledge);
  EXPECT_EQ(phase(), SleepPhase::awake);
  pass(milliseconds(500));
  acknowledge_all();
  pass(seconds(20));
  EXPECT_EQ(phase(), SleepPhase::awake);
}

// Objections to the check may have been missed meanwhile.
TEST_F(SleepOnTheBus, ACheckDuringWhichTheBusIsLostIsNotDone) {
  for (const SleepAction action : {SleepAction::check, SleepAction::sleep}) {
    run_acknowledged(sleepy());
    ask(action);
    acknowledge_all();
    pass(milliseconds(300));
    interface_fails();
    EXPECT_EQ(phase(), SleepPhase::awake);
    EXPECT_EQ(refusal(), Refusal::no_acknowledge);
    line_->bus_event({.kind = can::BusEvent::Kind::interface_ready, .time = now_});
    pass(seconds(5));
    EXPECT_THAT(sent(), Not(Contains("690#02")));
    EXPECT_EQ(phase(), SleepPhase::awake);
  }
}

TEST_F(SleepOnTheBus, WithoutAnInterfaceALineThatPreparesFallsAsleep) {
  run(sleepy());
  ask(SleepAction::prepare);
  EXPECT_EQ(reply(), "");
  interface_fails();
  EXPECT_EQ(phase(), SleepPhase::prepare) << "the other nodes have received the message";
  pass(seconds(2));
  EXPECT_EQ(phase(), SleepPhase::asleep);
}

TEST_F(SleepOnTheBus, TheAcknowledgementOfWakeIsNotThatOfTheNextMessage) {
  for (const SleepAction action : {SleepAction::check, SleepAction::prepare}) {
    run_acknowledged(sleepy());
    ask(SleepAction::prepare);
    acknowledge_all();
    EXPECT_EQ(reply(), "");
    pass(milliseconds(100));
    line_->execute({.tag = 7, .request = SleepRequest{SleepAction::wake}}, now_);
    line_->execute({.tag = 8, .request = SleepRequest{action}}, now_);
    can::Frame frame;
    while (text(frame) != "690#03") {
      ASSERT_TRUE(line_->next_frame(frame, now_));
    }
    line_->acknowledged(line_->state().counters.frames_sent, now_);
    EXPECT_EQ(reply(), "");
    hand_out_all();
    pass(seconds(2));
    Reply late;
    ASSERT_TRUE(line_->pop_reply(late));
    EXPECT_EQ(late.error, to_error(Refusal::no_acknowledge));
    EXPECT_EQ(phase(), SleepPhase::awake);
  }
}

TEST_F(SleepOnTheBus, ACheckEndsWithTheTimeOfItsCommand) {
  LineConfig config = sleepy();
  config.sleep.check_time = seconds(60);
  run_acknowledged(std::move(config));
  line_->execute({.tag = 7, .timeout = seconds(5), .request = SleepRequest{SleepAction::sleep}},
                 now_);
  acknowledge_all();
  pass(seconds(5) - milliseconds(1));
  EXPECT_EQ(reply(), "-");
  pass(milliseconds(1));
  EXPECT_EQ(refusal(), Refusal::timed_out);
  EXPECT_EQ(phase(), SleepPhase::awake);
  pass(seconds(100));
  EXPECT_THAT(sent(), Not(Contains("690#02")));
}

// --- errors ---------------------------------------------------------------------------------

// The boot after the sleep would start the network again.
TEST_F(SleepOnTheBus, ANetworkThatAnErrorStoppedDoesNotSleep) {
  run(sleepy());
  hear(0x77F, {5});
  line_->advance(now_);
  ASSERT_EQ(line_->state().manager, manager::ManagerState::halted);
  sent();
  for (const SleepAction action : {SleepAction::check, SleepAction::sleep, SleepAction::prepare}) {
    ask(action);
    EXPECT_EQ(refusal(), Refusal::wrong_state);
    EXPECT_EQ(phase(), SleepPhase::awake);
  }
  EXPECT_THAT(sent(), IsEmpty());
}

TEST_F(SleepOnTheBus, AnErrorDuringTheCheckKeepsTheNetworkAwake) {
  run(sleepy());
  ask(SleepAction::sleep);
  hear(0x77F, {5});
  line_->advance(now_);
  ASSERT_EQ(line_->state().manager, manager::ManagerState::halted);
  pass(seconds(2));
  EXPECT_EQ(reply(), "127 ") << "the own node objects";
  EXPECT_EQ(line_->state().manager, manager::ManagerState::halted);
}

TEST_F(SleepOnTheBus, WakeIsDoneWhenItsMessageIsOnTheBus) {
  run_acknowledged();
  ask(SleepAction::prepare);
  acknowledge_all();
  EXPECT_EQ(reply(), "");
  pass(seconds(2));
  ASSERT_EQ(phase(), SleepPhase::asleep);
  sent();
  ask(SleepAction::wake);
  EXPECT_EQ(phase(), SleepPhase::awake);
  EXPECT_EQ(sent().front(), "690#03");
  EXPECT_EQ(reply(), "-");
  acknowledge_all();
  EXPECT_EQ(reply(), "");
}

TEST_F(SleepOnTheBus, AFrameThatWaitsWhenTheLineFallsSilentIsNotSent) {
  run_acknowledged();
  ask(SleepAction::prepare);
  acknowledge_all();
  EXPECT_EQ(reply(), "");
  pass(milliseconds(900));
  line_->execute({.tag = 7, .request = CanSend{.frame = can::make_frame(0x123, {1})}}, now_);
  EXPECT_EQ(reply(), "-");
  pass(milliseconds(100));
  ASSERT_EQ(phase(), SleepPhase::silent);
  EXPECT_EQ(refusal(), Refusal::no_acknowledge);
}

TEST_F(SleepOnTheBus, ABootProcessEndsAtPrepare) {
  make(sleepy());
  line_->start(now_);
  hear(0x705, {0});
  sent();
  events();
  ask(SleepAction::prepare);
  EXPECT_EQ(reply(), "");
  hear(0x585, {0x43, 0x00, 0x10, 0x00, 0x92, 0x01, 0x02, 0x00});
  hear(0x705, {0});
  pass(milliseconds(999));
  for (const std::string& frame : sent()) {
    EXPECT_FALSE(frame.starts_with("605#4") || frame.starts_with("605#2")) << frame;
    EXPECT_FALSE(frame.starts_with("000#")) << frame;
  }
  EXPECT_FALSE(emitted(EventKind::boot_result, 5));
}

// --- roles ----------------------------------------------------------------------------------

TEST_F(SleepOnTheBus, AMasterThatBecomesASlaveDuringTheCheckSendsNoPrepare) {
  run(sleepy());
  ask(SleepAction::sleep);
  sent();
  set_role(4);
  EXPECT_EQ(phase(), SleepPhase::awake);
  EXPECT_EQ(refusal(), Refusal::wrong_role);
  pass(seconds(2));
  EXPECT_THAT(sent(), Not(Contains("690#02")));
  EXPECT_EQ(phase(), SleepPhase::awake);
}

TEST_F(SleepOnTheBus, ARoleThatChangesDuringPrepareIsLostAtTheWakeUp) {
  make(sleepy(Role::device));
  line_->start(now_);
  hear(0x690, {2});
  set_role(1);
  sent();
  pass(milliseconds(900));
  for (const std::string& frame : sent()) {
    EXPECT_FALSE(frame.starts_with("000#")) << frame;
  }
  EXPECT_EQ(line_->state().role, Role::device);
  pass(seconds(2));
  ASSERT_EQ(phase(), SleepPhase::asleep);
  hear(0x690, {3});
  EXPECT_EQ(line_->state().role, Role::device) << "the reset has restored 1F80h";
}

TEST_F(SleepOnTheBus, AStoredRoleIsTakenAtTheWakeUp) {
  for (const bool becomes_manager : {true, false}) {
    storage::MemoryMedium medium;
    LineConfig config = sleepy(becomes_manager ? Role::device : Role::manager);
    config.stores_parameters = true;
    make(std::move(config));
    line_->set_medium(&medium);
    line_->start(now_);
    hand_out_all();
    becomes_manager ? hear(0x690, {2}) : ask(SleepAction::prepare);
    ASSERT_EQ(phase(), SleepPhase::prepare);
    set_role(becomes_manager ? 1 : 4);
    EXPECT_EQ(line_->dictionary().write({0x1010, 1}, std::vector{std::byte{'s'}, std::byte{'a'},
                                                                 std::byte{'v'}, std::byte{'e'}}),
              AbortCode::none);
    pass(seconds(2));
    ASSERT_EQ(phase(), SleepPhase::asleep);
    sent();
    hear(0x690, {3});
    EXPECT_EQ(line_->state().role, becomes_manager ? Role::manager : Role::device);
    const std::vector<std::string> frames = sent();
    EXPECT_EQ(std::ranges::count(frames, "000#8200"), becomes_manager ? 1 : 0);
  }
}

TEST_F(SleepOnTheBus, ANetworkThatWaitsForNodeIdsIsNotStartedDuringPrepare) {
  LineConfig config = sleepy();
  config.lss.assign = true;
  make(std::move(config));
  line_->start(now_);
  hand_out_all();
  ask(SleepAction::prepare);
  EXPECT_EQ(reply(), "");
  ASSERT_EQ(phase(), SleepPhase::prepare);
  sent();
  pass(milliseconds(999));
  for (const std::string& frame : sent()) {
    EXPECT_FALSE(frame.starts_with("000#") || frame.starts_with("7E5#")) << frame;
  }
}

TEST_F(SleepOnTheBus, RecordsGiveNoOrdersWhileTheNetworkSleeps) {
  run(sleepy());
  const auto reset_own = [this] {
    return line_->dictionary().write({0x5F41, 1}, std::vector{std::byte{129}});
  };
  ask(SleepAction::prepare);
  EXPECT_EQ(reset_own(), AbortCode::device_state);
  pass(seconds(2));
  ASSERT_EQ(phase(), SleepPhase::asleep);
  EXPECT_EQ(reset_own(), AbortCode::device_state);
  EXPECT_EQ(line_->dictionary().write({0x1F82, 5}, std::vector{std::byte{6}}),
            AbortCode::local_control);
  ask(SleepAction::wake);
  EXPECT_EQ(reset_own(), AbortCode::none);
}

// --- stop -----------------------------------------------------------------------------------

TEST_F(SleepOnTheBus, AStoppedLineDoesNotWake) {
  run(sleepy());
  fall_asleep();
  line_->stop(now_);
  expect_silence();
  EXPECT_FALSE(line_->state().sleep) << "the network may wake without it";
  for (int i = 0; i < 3; ++i) {
    hear(0x705, {0});
    hear(0x690, {3});
    pass(milliseconds(500));
    expect_silence();
  }
  EXPECT_EQ(line_->state().manager, manager::ManagerState::stopped);
  EXPECT_EQ(of(EventKind::sleep_state).size(), 0U);
  line_->start(now_);
  EXPECT_EQ(phase(), SleepPhase::awake);
  const std::vector<std::string> frames = sent();
  EXPECT_THAT(frames, Contains("000#8200")) << "the network boots again";
  EXPECT_THAT(frames, Contains("77F#00"));
}

TEST_F(SleepOnTheBus, AStoppedLineDoesNotFallAsleep) {
  run(sleepy());
  ask(SleepAction::check);
  line_->stop(now_);
  EXPECT_EQ(refusal(), Refusal::cancelled);
  pass(seconds(5));
  EXPECT_THAT(sent(), Not(Contains("690#02")));
  line_->execute({.tag = 7, .request = SleepRequest{SleepAction::prepare}}, now_);
  EXPECT_EQ(refusal(), Refusal::wrong_state);
}

// --- the wake-up ----------------------------------------------------------------------------

TEST_F(SleepOnTheBus, ASlaveWakesTheOthersWithItsMessage) {
  make(sleepy(Role::device));
  line_->start(now_);
  sent();
  for (const bool by_command : {true, false}) {
    hear(0x690, {2});
    pass(seconds(2));
    ASSERT_EQ(phase(), SleepPhase::asleep);
    sent();
    if (by_command) {
      ask(SleepAction::wake);
    } else {
      hear(0x123, {1});
    }
    const std::vector<std::string> frames = sent();
    ASSERT_FALSE(frames.empty());
    EXPECT_EQ(frames.front(), "690#03");
    EXPECT_THAT(frames, Contains("77F#00"));
    hear(0x000, {1, 0});
  }
}

// Node 5 wakes all with its boot-up message; then the manager resets it.
TEST_F(SleepOnTheBus, NodesThatBootByThemselvesHaveNotChangedSpontaneously) {
  run(sleepy());
  fall_asleep();
  events();
  hear(0x705, {0});
  ASSERT_EQ(phase(), SleepPhase::awake);
  pass(milliseconds(100));
  hear(0x705, {0});
  pass(milliseconds(1));
  EXPECT_THAT(of(EventKind::spontaneous_change), IsEmpty());
  EXPECT_EQ(line_->node_state(5).spontaneous_changes, 0U);
}

TEST_F(SleepOnTheBus, NodesOfASlaveHaveNotChangedSpontaneously) {
  make(sleepy(Role::device));
  line_->start(now_);
  hear(0x000, {1, 0});
  hear(0x705, {5});
  hear(0x690, {2});
  pass(seconds(2));
  hear(0x690, {3});
  pass(milliseconds(500));
  hear(0x705, {0});
  hear(0x705, {0x7F});
  EXPECT_EQ(line_->node_state(5).spontaneous_changes, 0U);
}

TEST_F(SleepOnTheBus, NodesOfAnObserverHaveNotChangedSpontaneously) {
  observe(sleepy());
  hear(0x000, {1, 0});
  hear(0x705, {5});
  hear(0x690, {2});
  pass(seconds(2));
  events();
  hear(0x690, {3});
  pass(milliseconds(500));
  hear(0x705, {0});
  hear(0x705, {0x7F});
  EXPECT_EQ(line_->node_state(5).spontaneous_changes, 0U);
  EXPECT_THAT(of(EventKind::spontaneous_change), IsEmpty());
}

// Requests of a master that guards the node, which has not fallen silent yet.
TEST_F(SleepOnTheBus, AnObserverMissesNoGuardAnswerOfASleepingNode) {
  LineConfig config = sleepy();
  config.nodes[0].heartbeat = {};
  config.nodes[0].heartbeat_consumer = {};
  config.nodes[0].guard_time = milliseconds(100);
  config.nodes[0].life_time_factor = 3;
  observe(config);
  hear(0x000, {1, 0});
  hear_remote(0x705);
  hear(0x705, {0x05});
  hear(0x690, {2});
  hear_remote(0x705);
  hear(0x705, {0x85});
  pass(seconds(10));
  EXPECT_EQ(line_->state().counters.heartbeats_lost, 0U);
  EXPECT_EQ(line_->node_state(5).presence, manager::Presence::present);
}

// SYNC, guarding requests and TPDOs of others end at different times.
TEST_F(SleepOnTheBus, NothingThatOthersNoLongerSendIsLost) {
  LineConfig config = sleepy(Role::device);
  config.nodes[0].pdo_deadline = milliseconds(200);
  config.own_values = {
      {{0x1006, 0}, {std::byte{0x50}, std::byte{0xC3}, std::byte{0}, std::byte{0}}}};
  make(std::move(config));
  line_->start(now_);
  hear(0x000, {1, 0});
  hear(0x080, {});
  hear(0x185, {1, 2, 3, 4, 5, 6});
  hear(0x690, {2});
  hear(0x080, {});
  hear(0x185, {1, 2, 3, 4, 5, 6});
  events();
  pass(seconds(10));
  for (const Event& event : events()) {
    EXPECT_NE(event.kind(), EventKind::sync_lost);
    EXPECT_NE(event.kind(), EventKind::pdo_timeout);
    EXPECT_NE(event.kind(), EventKind::heartbeat_lost);
  }
}

// Heartbeats that the own node would have sent must not fill its queue.
TEST_F(SleepOnTheBus, ALongSleepOverrunsNoQueue) {
  run(sleepy());
  fall_asleep();
  for (int i = 0; i < 100; ++i) {
    pass(seconds(1));
  }
  const auto hardware = line_->dictionary().read({0x5F40, 3});
  ASSERT_TRUE(hardware.ok());
  EXPECT_EQ((*hardware)[0] & std::byte{0x10}, std::byte{0}) << "transmit overrun";
  ask(SleepAction::wake);
  EXPECT_EQ(sent().front(), "690#03");
}

}  // namespace
}  // namespace linegate::line

// SPDX-License-Identifier: Apache-2.0
// Sleep of a line in each role: nothing is sent, nobody is lost, and a boot restores everything.
#include <algorithm>
#include <string>
#include <vector>

#include "stack/storage/medium.h"

#include "tests/stack/line/sleep_fixture.h"

namespace linegate::line {
namespace {

TEST_F(SleepTest, AManagerChecksPreparesAndSleeps) {
  run(sleepy());
  ASSERT_TRUE(line_->input(0).valid);
  ask(SleepAction::sleep);
  EXPECT_EQ(reply(), "-");
  EXPECT_EQ(sent().front(), "690#01");
  hear(0x705, {5});
  pass(milliseconds(999));
  hear(0x705, {5});
  EXPECT_EQ(phase(), SleepPhase::check);
  EXPECT_EQ(reply(), "-");
  sent();
  pass(milliseconds(1));
  EXPECT_EQ(reply(), "") << "no node objects";
  EXPECT_EQ(phase(), SleepPhase::prepare);
  EXPECT_FALSE(line_->input(0).valid);
  EXPECT_FALSE(snapshot(Direction::outputs).is_valid(0));
  EXPECT_EQ(sent().front(), "690#02");
  pass(milliseconds(999));
  EXPECT_FALSE(sent().empty()) << "communication is possible: SYNC, heartbeats";
  pass(milliseconds(1));
  EXPECT_EQ(phase(), SleepPhase::silent);
  EXPECT_EQ(phases(), "check prepare silent ");
  expect_silence_for(seconds(20));
  EXPECT_EQ(phase(), SleepPhase::asleep);
  EXPECT_EQ(line_->state().counters.heartbeats_lost, 0U);
}

TEST_F(SleepTest, AFrameWakesAndTheNetworkBoots) {
  run(sleepy());
  fall_asleep();
  expect_silence_for(seconds(60));
  hear(0x7F0, {1});
  EXPECT_EQ(phase(), SleepPhase::awake);
  const std::vector<std::string> frames = sent();
  ASSERT_GE(frames.size(), 3U);
  EXPECT_EQ(frames[0], "690#03") << "the message that wakes others";
  EXPECT_NE(std::ranges::find(frames, "77F#00"), frames.end()) << "boot-up of the own node";
  EXPECT_NE(std::ranges::find(frames, "000#8200"), frames.end()) << "all nodes are reset";
  hear_identity();
  hear_no_serial_number();
  hear_no_pdo_records();
  hear(0x585, {0x60, 0x17, 0x10, 0x00, 0, 0, 0, 0});
  hear(0x705, {0x7F});
  pass(milliseconds(1));
  hear(0x705, {0x05});
  pass(milliseconds(1));
  const std::vector<std::string> booted = sent();
  EXPECT_NE(std::ranges::find(booted, "000#0105"), booted.end());
  EXPECT_NE(std::ranges::find(booted, "205#0900000003"), booted.end()) << "its outputs again";
  EXPECT_EQ(line_->node_state(5).state, nmt::State::operational);
  hear(0x185, {1, 2, 3, 4, 5, 6});
  EXPECT_TRUE(line_->input(0).valid);
}

TEST_F(SleepTest, ACommandWakes) {
  run(sleepy());
  fall_asleep();
  ask(SleepAction::wake);
  EXPECT_EQ(reply(), "");
  EXPECT_EQ(sent().front(), "690#03");
  ask(SleepAction::wake);
  EXPECT_EQ(reply(), "refused") << "it is awake";
}

TEST_F(SleepTest, AnObjectionEndsTheCheck) {
  run(sleepy());
  ask(SleepAction::sleep);
  hear(0x691, {4, 5});
  pass(seconds(1));
  EXPECT_EQ(reply(), "5 ");
  EXPECT_EQ(phase(), SleepPhase::awake);
  EXPECT_TRUE(line_->input(0).valid) << "nothing has changed";
  ask(SleepAction::check);
  pass(seconds(1));
  EXPECT_EQ(reply(), "");
  EXPECT_EQ(phases(), "check awake check awake ");
}

TEST_F(SleepTest, ACommandCancelsTheCheck) {
  run(sleepy());
  ask(SleepAction::sleep);
  line_->execute({.tag = 8, .request = SleepRequest{SleepAction::check}}, now_);
  Reply busy;
  ASSERT_TRUE(line_->pop_reply(busy));
  EXPECT_EQ(busy.error, to_error(Refusal::busy));
  line_->execute({.tag = 8, .request = SleepRequest{SleepAction::wake}}, now_);
  std::vector<Reply> replies(2);
  ASSERT_TRUE(line_->pop_reply(replies[0]) && line_->pop_reply(replies[1]));
  std::ranges::sort(replies, {}, &Reply::tag);
  EXPECT_EQ(replies[0].error, to_error(Refusal::cancelled));
  EXPECT_TRUE(replies[1].ok());
  EXPECT_EQ(phase(), SleepPhase::awake);
}

TEST_F(SleepTest, AnObjectionDuringPrepareWakesAll) {
  run(sleepy());
  ask(SleepAction::prepare);
  pass(milliseconds(500));
  sent();
  hear(0x691, {4, 5});
  EXPECT_EQ(phase(), SleepPhase::awake);
  EXPECT_EQ(sent().front(), "690#03");
}

TEST_F(SleepTest, TheOwnNodeObjectsByCommandOrByItsRecord) {
  run(sleepy());
  ask(SleepAction::object);
  EXPECT_EQ(reply(), "");
  ask(SleepAction::check);
  pass(seconds(1));
  EXPECT_EQ(reply(), "127 ");
  ask(SleepAction::consent);
  EXPECT_EQ(reply(), "");
  const std::vector<std::byte> one{std::byte{1}};
  EXPECT_EQ(line_->dictionary().write({0x5F41, 2}, one), AbortCode::none);
  ask(SleepAction::check);
  pass(seconds(1));
  EXPECT_EQ(reply(), "127 ");
  EXPECT_EQ(line_->dictionary().write({0x5F41, 2}, std::vector{std::byte{2}}),
            AbortCode::invalid_value);
}

TEST_F(SleepTest, CommandsAreRefusedWhileNothingIsSent) {
  run(sleepy());
  fall_asleep();
  for (const CommandKind kind : kRequestKinds) {
    if (kind == CommandKind::sleep || kind == CommandKind::local_read ||
        kind == CommandKind::local_write || kind == CommandKind::can_listen ||
        kind == CommandKind::routing_trace || kind == CommandKind::connection_list) {
      continue;
    }
    now_ += seconds(2);
    line_->execute({.tag = 7, .request = empty_request(kind)}, now_);
    Reply reply;
    ASSERT_TRUE(line_->pop_reply(reply)) << name(kind);
    EXPECT_EQ(reply.error, to_error(Refusal::wrong_state)) << name(kind);
    expect_silence();
  }
  line_->execute({.tag = 7, .request = ConnectionList{}}, now_);
  EXPECT_EQ(reply(), "") << "it sends nothing";
  ask(SleepAction::sleep);
  EXPECT_EQ(reply(), "refused");
  EXPECT_EQ(phase(), SleepPhase::asleep);
}

TEST_F(SleepTest, NoProcedureBeginsDuringPrepare) {
  run(sleepy());
  ask(SleepAction::prepare);
  EXPECT_EQ(reply(), "");
  for (const CommandKind kind : {CommandKind::boot, CommandKind::nmt, CommandKind::scan,
                                 CommandKind::configure, CommandKind::lss}) {
    line_->execute({.tag = 7, .request = empty_request(kind)}, now_);
    EXPECT_EQ(reply(), "refused") << name(kind);
  }
  EXPECT_EQ(phase(), SleepPhase::prepare);
}

TEST_F(SleepTest, ATransferUnderWayEndsBeforeSilence) {
  run(sleepy());
  ask(SleepAction::prepare);
  EXPECT_EQ(reply(), "");
  pass(milliseconds(900));
  line_->execute({.tag = 7, .request = SdoRead{.node = 5, .address = {0x1000, 0}}}, now_);
  sent();
  pass(milliseconds(100));
  EXPECT_EQ(reply(), "refused");
  expect_silence_for(seconds(5));
}

TEST_F(SleepTest, TheStatusOfNodesIsSleep) {
  run(sleepy());
  fall_asleep();
  const auto value = line_->dictionary().read({0x5F44, 5});
  ASSERT_TRUE(value.ok());
  ASSERT_EQ((*value).size(), 1U);
  EXPECT_EQ((*value)[0], std::byte{0xF0});
}

TEST_F(SleepTest, WithoutTheConfigurationThereIsNone) {
  LineConfig config = sleepy();
  config.sleep = {};
  run(config);
  for (const SleepAction action : {SleepAction::check, SleepAction::sleep, SleepAction::prepare,
                                   SleepAction::wake, SleepAction::object}) {
    ask(action);
    EXPECT_EQ(reply(), "refused");
  }
  hear(0x690, {2});
  EXPECT_FALSE(line_->state().sleep);
}

// A node that falls silent later than the line does.
TEST_F(SleepTest, AStateReceivedInTheSilentTimeIsNotKept) {
  for (const bool observes : {false, true}) {
    observes ? observe(sleepy()) : run(sleepy());
    if (observes) {
      hear(0x705, {5});
      hear(0x690, {2});
    } else {
      ask(SleepAction::prepare);
      EXPECT_EQ(reply(), "");
    }
    EXPECT_EQ(line_->node_state(5).state, nmt::State::operational) << "it may still be received";
    pass(seconds(1));
    ASSERT_EQ(phase(), SleepPhase::silent);
    hear(0x705, {5});
    EXPECT_EQ(line_->node_state(5).state, nmt::State::unknown);
    EXPECT_EQ(line_->state().nodes_operational, 0);
    hear(0x705, {0});
    pass(seconds(1));
    ASSERT_EQ(phase(), SleepPhase::asleep);
    EXPECT_EQ(line_->node_state(5).state, nmt::State::unknown);
    if (!observes) {
      const auto state = line_->dictionary().read({0x1F82, 5});
      ASSERT_TRUE(state.ok());
      EXPECT_EQ((*state)[0], std::byte{0});
    }
    hear(0x705, {0});
    hear(0x705, {5});
    EXPECT_EQ(phase(), SleepPhase::awake);
    EXPECT_EQ(line_->node_state(5).state, nmt::State::operational);
  }
}

class StorageInSleep : public SleepTest {
 protected:
  // Takes its time, like a file.
  class Medium final : public storage::Medium {
   public:
    bool read(std::vector<std::byte>& image) override {
      image = kept_;
      return true;
    }
    bool keep(std::span<const std::byte> image) override {
      kept_.assign(image.begin(), image.end());
      return true;
    }
    bool slow() const override { return true; }

   private:
    std::vector<std::byte> kept_;
  };

  void save() {
    line_->execute({.tag = 7,
                    .request = LocalWrite{.address = {0x1010, 1},
                                          .data = {std::byte{'s'}, std::byte{'a'}, std::byte{'v'},
                                                   std::byte{'e'}}}},
                   now_);
    line_->advance(now_);
    EXPECT_EQ(reply(), "-");
  }
  void saved() {
    line_->medium_done(true);
    line_->advance(now_);
  }

  Medium medium_;
};

TEST_F(StorageInSleep, ALocalWriteIsAnswered) {
  LineConfig config = sleepy();
  config.stores_parameters = true;
  make(std::move(config));
  line_->set_medium(&medium_);
  boot();
  ask(SleepAction::prepare);
  EXPECT_EQ(reply(), "");
  pass(milliseconds(900));
  save();
  pass(milliseconds(100));
  ASSERT_EQ(phase(), SleepPhase::silent);
  EXPECT_EQ(reply(), "-") << "the file is being written";
  saved();
  EXPECT_EQ(reply(), "");
  pass(seconds(1));
  ASSERT_EQ(phase(), SleepPhase::asleep);
  save();
  saved();
  EXPECT_EQ(reply(), "");
  EXPECT_EQ(phase(), SleepPhase::asleep);
  expect_silence();
}

class SleepingSlave : public SleepTest {
 protected:
  void run() {
    make(sleepy(Role::device));
    line_->start(now_);
    hear(0x000, {1, 0});
    hear(0x705, {5});
    hear(0x185, {1, 2, 3, 4, 5, 6});
    pass(milliseconds(1));
    sent();
    events();
  }
};

TEST_F(SleepingSlave, ObeysTheMaster) {
  run();
  ASSERT_TRUE(line_->input(0).valid);
  hear(0x690, {1});
  EXPECT_EQ(phase(), SleepPhase::check);
  hear(0x690, {2});
  EXPECT_EQ(phase(), SleepPhase::prepare);
  EXPECT_FALSE(line_->input(0).valid);
  pass(seconds(1));
  EXPECT_EQ(phase(), SleepPhase::silent);
  EXPECT_EQ(phases(), "check prepare silent ");
  sent();
  expect_silence_for(seconds(30));
  hear(0x000, {0x81, 0});
  EXPECT_EQ(phase(), SleepPhase::awake);
  EXPECT_EQ(of(EventKind::sleep_state).size(), 1U);
  const std::vector<std::string> frames = sent();
  EXPECT_NE(std::ranges::find(frames, "77F#00"), frames.end());
  hear(0x705, {5});
  hear(0x185, {1, 2, 3, 4, 5, 6});
  EXPECT_EQ(line_->node_state(5).state, nmt::State::operational);
}

TEST_F(SleepingSlave, Objects) {
  run();
  ask(SleepAction::object);
  EXPECT_EQ(reply(), "");
  hear(0x690, {1});
  EXPECT_THAT(sent(), testing::Contains("691#047F"));
}

// A flood of requests is not answered with a flood of objections.
TEST_F(SleepingSlave, ObjectsOnceToRequestsThatPrecedeItsMessage) {
  run();
  ask(SleepAction::object);
  EXPECT_EQ(reply(), "");
  for (int i = 0; i < 50; ++i) {
    hear(0x690, {1});
  }
  const std::vector<std::string> frames = sent();
  EXPECT_EQ(std::ranges::count(frames, "691#047F"), 1);
  hear(0x690, {1});
  EXPECT_THAT(sent(), testing::Contains("691#047F"));
}

TEST_F(SleepingSlave, TheStatusOfNodesIsNoLongerSleepAfterIt) {
  run();
  const auto status = [this] { return (*line_->dictionary().read({0x5F44, 5}))[0]; };
  hear(0x690, {2});
  pass(seconds(2));
  EXPECT_EQ(status(), std::byte{0xF0});
  hear(0x690, {3});
  EXPECT_NE(status(), std::byte{0xF0});
}

TEST_F(SleepingSlave, AWatchdogThatFiresInTheSilenceReportsNothingAsSent) {
  run();
  OutputWrite write;
  write.layout_id = line_->layout(Direction::outputs).id;
  write.arming = 1;
  write.watchdog = seconds(3);
  write.reactions = kSendEmcy | kHeartbeatOff;
  write.values = {{.entry = 0, .length = 4, .data = {}}};
  ASSERT_EQ(line_->write_outputs(write, now_), OutputRefusal::none);
  hear(0x690, {2});
  pass(seconds(2));
  ASSERT_EQ(phase(), SleepPhase::asleep);
  events();
  pass(seconds(3));
  std::vector<Event> all = events();
  const auto fired = std::ranges::find(all, EventKind::output_watchdog, &Event::kind);
  ASSERT_NE(fired, all.end());
  EXPECT_EQ(fired->get<event::OutputWatchdog>()->reactions, kHoldOutputs);
  EXPECT_EQ(std::ranges::find(all, EventKind::emcy_sent, &Event::kind), all.end());
}

TEST_F(SleepingSlave, LeavesTheRestToTheMaster) {
  run();
  for (const SleepAction action : {SleepAction::check, SleepAction::sleep, SleepAction::prepare}) {
    ask(action);
    EXPECT_EQ(reply(), "refused");
  }
}

// A node that does not return is missing, as at any other time.
TEST_F(SleepingSlave, AfterTheSleepANodeMayBeMissing) {
  run();
  hear(0x690, {2});
  pass(seconds(10));
  events();
  hear(0x690, {3});
  pass(seconds(20));
  EXPECT_NE(line_->node_state(5).presence, manager::Presence::present);
}

TEST_F(SleepTest, AnObserverFollows) {
  observe(sleepy());
  hear(0x000, {1, 0});
  hear(0x705, {5});
  hear(0x185, {1, 2, 3, 4, 5, 6});
  ASSERT_TRUE(line_->input(0).valid);
  hear(0x690, {2});
  EXPECT_FALSE(line_->input(0).valid);
  expect_silence_for(seconds(30));
  EXPECT_EQ(phase(), SleepPhase::asleep);
  hear(0x705, {0});
  EXPECT_EQ(phase(), SleepPhase::awake);
  hear(0x705, {5});
  hear(0x185, {1, 2, 3, 4, 5, 6});
  EXPECT_TRUE(line_->input(0).valid);
  pass(seconds(6));
  EXPECT_EQ(line_->state().counters.heartbeats_lost, 1U) << "it is monitored again";
  expect_silence();
}

TEST(SleepConfig, IsChecked) {
  const auto text_of = [](auto change) {
    LineConfig config = sleepy();
    change(config);
    const auto made = Line::make(config);
    return made.ok() ? std::string() : made.diagnostics.at(0).text;
  };
  EXPECT_EQ(text_of([](LineConfig&) {}), "");
  const std::string identifiers = "sleep needs two identifiers that no other service uses";
  EXPECT_EQ(text_of([](LineConfig& c) { c.sleep.objection = 0x690; }), identifiers);
  EXPECT_EQ(text_of([](LineConfig& c) { c.sleep.request = 0x701; }), identifiers);
  EXPECT_EQ(text_of([](LineConfig& c) { c.sleep.objection = 0x800; }), identifiers);
  EXPECT_EQ(text_of([](LineConfig& c) { c.sleep.request = 0; }), identifiers);
  EXPECT_EQ(text_of([](LineConfig& c) { c.sleep.wake_byte = 1; }),
            "two requests of sleep have the same byte");
  EXPECT_EQ(text_of([](LineConfig& c) { c.sleep.silent_time = {}; }),
            "the times of sleep are longer than 0");
  EXPECT_EQ(text_of([](LineConfig& c) {
              c.role = Role::device;
              c.nodes.clear();
              c.devices = {{.id = 9, .device = config_with_axis().nodes[0].device}};
            }),
            "sleep is for a line with one own node, or an observer");
}

TEST(SleepConfig, IdentifiersOfOtherServicesAreNamed) {
  const auto text_of = [](std::uint32_t request, auto change) {
    LineConfig config = sleepy();
    config.sleep.request = request;
    change(config);
    const auto made = Line::make(config);
    return made.ok() ? std::string() : made.diagnostics.at(0).text;
  };
  const auto nothing = [](LineConfig&) {};
  EXPECT_EQ(text_of(0x185, nothing), "sleep: 185h is that of TPDO 1 of axis");
  EXPECT_EQ(text_of(0x205, nothing), "sleep: 205h is that of RPDO 1 of axis");
  EXPECT_EQ(text_of(0x080, nothing), "sleep: 080h is that of SYNC");
  EXPECT_EQ(text_of(0x085, nothing), "sleep: 085h is that of the EMCY of axis");
  EXPECT_EQ(text_of(0x0FF, nothing), "sleep: 0FFh is that of the EMCY of the own node");
  EXPECT_EQ(text_of(0x100, nothing), "sleep: 100h is that of TIME");
  EXPECT_EQ(
      text_of(0x690,
              [](LineConfig& config) { config.connection_pool = {.first = 0x680, .last = 0x69F}; }),
      "sdo_connections: 690h is that of the requests of sleep");
  EXPECT_EQ(text_of(0x690, [](LineConfig& config) { config.canopen_fd = true; }),
            "sleep is not defined for CANopen FD: leave out sleep");
  EXPECT_EQ(
      text_of(0x690,
              [](LineConfig& config) { config.flying_master = FlyingMasterConfig{.priority = 1}; }),
      "sleep is not defined for a flying master: leave out one of them");
}

}  // namespace
}  // namespace linegate::line

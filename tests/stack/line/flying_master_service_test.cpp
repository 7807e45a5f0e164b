// SPDX-License-Identifier: Apache-2.0
// The own node of a manager as a flying master (CiA 302-2): its role at run time.
#include "stack/line/flying_master_service.h"

#include <utility>

#include "stack/base/byte_order.h"
#include "stack/storage/medium.h"

#include "line_fixture.h"

namespace linegate::line {
namespace {

using nmt::FlyingMasterState;
using testing::Contains;
using testing::Each;
using testing::ElementsAre;
using testing::IsEmpty;
using testing::Not;
using testing::StartsWith;

constexpr std::uint8_t kOtherMaster = 9;  // another flying master

class FlyingMasterServiceTest : public LineTest {
 protected:
  static LineConfig config() {
    LineConfig out = config_with_axis();
    out.node_id = 20;
    out.heartbeat = milliseconds(200);
    out.flying_master = {.priority = 1};
    return out;
  }
  void start(LineConfig config) {
    make(std::move(config));
    line_->start(now_);
    pass(milliseconds(10));
    sent();
  }
  // The frames of NMT and flying masters.
  std::vector<std::string> nmt_sent() {
    std::vector<std::string> out = sent();
    std::erase_if(out, [](const std::string& frame) { return frame[0] != '0' || frame > "077"; });
    return out;
  }
  void negotiate() {
    hear(0x072, {});
    pass(milliseconds(1500 + 200));
  }
  // The line becomes the active master, and boots node 5.
  void become_master() {
    become_master_quietly();
    sent();
    events();
  }
  // The same; sent() and events() have what it sent and reported.
  void become_master_quietly() {
    negotiate();
    hear_identity();
    hear_no_serial_number();
    hear_no_pdo_records();
    hear(0x585, {0x60, 0x17, 0x10, 0x00, 0, 0, 0, 0});
    hear(0x705, {0x7F});
    pass(milliseconds(1));
    hear(0x705, {0x05});
    pass(milliseconds(1));
    EXPECT_EQ(line_->state().role, Role::manager);
    EXPECT_EQ(line_->node_state(5).state, nmt::State::operational);
  }
  void boot_guarded_node() {
    negotiate();
    hear_identity();
    hear_no_serial_number();
    hear_no_pdo_records();
    for (int i = 0; i < 6; ++i) {
      hear(0x585, {0x60, 0x0C, 0x10, 0x00, 0, 0, 0, 0});
      hear(0x585, {0x60, 0x0D, 0x10, 0x00, 0, 0, 0, 0});
      hear(0x705, {static_cast<std::uint8_t>(i % 2 == 0 ? 0x05 : 0x85)});
      pass(milliseconds(50));
    }
  }
  void follow_other(std::uint8_t other = kOtherMaster) {
    hear(0x071, {0, other});
    pass(milliseconds(1));
  }
  // The bus takes each frame, and acknowledges it unless it is cut off.
  void live(Duration time, bool acknowledged = true, std::uint8_t heartbeats_of = 0) {
    for (const Instant end = now_ + time; now_ < end;) {
      pass(milliseconds(10));
      hand_out_all();
      if (acknowledged) {
        line_->acknowledged(line_->state().counters.frames_sent, now_);
      }
      if (heartbeats_of != 0) {
        hear(0x700U + heartbeats_of, {0x05});
      }
    }
  }
  void start_acknowledged(LineConfig config) {
    make(std::move(config));
    line_->expect_acknowledgements();
    line_->start(now_);
    live(milliseconds(10));
    sent();
  }
  Reply write_local(std::uint16_t index, std::uint8_t sub, std::uint32_t value,
                    std::size_t size = 4) {
    std::vector<std::byte> data(size);
    store_le(std::span(data), value);
    return result(LocalWrite{.address = {index, sub}, .data = std::move(data)});
  }
  OutputRefusal write(std::uint64_t arming, std::uint8_t reactions = 0) {
    return line_->write_outputs({.layout_id = line_->layout(Direction::outputs).id,
                                 .arming = arming,
                                 .watchdog = milliseconds(500),
                                 .reactions = reactions,
                                 .values = {{.entry = 0, .length = 4, .data = {std::byte{7}}},
                                            {.entry = 1, .length = 1, .data = {std::byte{1}}}}},
                                now_);
  }
  Reply result(Request request) {
    line_->execute({.tag = 1, .request = std::move(request)}, now_);
    return answer();
  }
  void expect(Role role, FlyingMasterState state, std::uint8_t master) {
    EXPECT_EQ(line_->state().role, role);
    EXPECT_EQ(line_->state().flying_master, state);
    EXPECT_EQ(line_->state().active_master, master);
    EXPECT_EQ(line_->state().master_priority, 1);
  }
};

TEST_F(FlyingMasterServiceTest, WithoutItNothingIsDifferent) {
  start(config_with_axis());
  EXPECT_EQ(line_->state().role, Role::manager);
  EXPECT_EQ(line_->state().flying_master, FlyingMasterState::none);
  EXPECT_EQ(line_->dictionary().number({0x1F90, 3}), std::nullopt);
}

TEST_F(FlyingMasterServiceTest, ItStartsAsASlaveAndBootsTheNetworkAsTheActiveMaster) {
  start(config());
  expect(Role::device, FlyingMasterState::detect, 0);
  EXPECT_EQ(line_->state().manager, ManagerState::inactive);
  pass(milliseconds(500));
  EXPECT_THAT(nmt_sent(), ElementsAre("073#"));
  pass(milliseconds(100));
  EXPECT_THAT(nmt_sent(), ElementsAre("000#8200"));
  expect(Role::device, FlyingMasterState::reset, 0);
  pass(milliseconds(500));
  pass(milliseconds(100));
  EXPECT_THAT(nmt_sent(), ElementsAre("073#", "072#"));
  expect(Role::device, FlyingMasterState::negotiate, 0);
  pass(milliseconds(1500 + 200));
  EXPECT_THAT(nmt_sent(), ElementsAre("071#0114", "000#8200"));
  expect(Role::manager, FlyingMasterState::master, 20);
  EXPECT_EQ(line_->state().manager, ManagerState::resetting);
}

TEST_F(FlyingMasterServiceTest, ObjectsHaveItsConfiguration) {
  LineConfig wanted = config();
  wanted.flying_master = {.priority = 1,
                          .master_timeout = milliseconds(120),
                          .negotiation_delay = milliseconds(510),
                          .priority_slot = milliseconds(2600),
                          .device_slot = milliseconds(20),
                          .detect_cycle = milliseconds(5000)};
  start(wanted);
  EXPECT_EQ(line_->dictionary().number({0x1F80, 0}), 0x21U);
  const std::uint64_t values[] = {6, 120, 510, 1, 2600, 20, 5000};
  for (std::uint8_t sub = 0; sub <= 6; ++sub) {
    EXPECT_EQ(line_->dictionary().number({0x1F90, sub}), values[sub]) << unsigned{sub};
  }
  start(config());
  EXPECT_EQ(line_->dictionary().number({0x1F90, 6}), 4200U);
  const auto write = [this](std::uint16_t index, std::uint8_t sub, std::vector<std::byte> data) {
    return result(LocalWrite{.address = {index, sub}, .data = std::move(data)}).error;
  };
  const Error refused{Domain::sdo, static_cast<std::uint32_t>(AbortCode::invalid_value)};
  EXPECT_EQ(write(0x1F90, 3, {std::byte{3}, {}}), refused);
  for (const std::uint8_t time : std::initializer_list<std::uint8_t>{1, 2, 4, 5, 6}) {
    EXPECT_EQ(write(0x1F90, time, {{}, {}}), refused) << unsigned{time};
  }
  EXPECT_EQ(write_local(0x1F90, 4, 1270, 2).error, refused) << "127 x 10 ms";
  EXPECT_EQ(write_local(0x1F90, 5, 12, 2).error, refused) << "127 x 12 ms";
  EXPECT_EQ(write_local(0x1F90, 5, 11, 2).error, Error{});
  EXPECT_EQ(write(0x1F90, 3, {std::byte{0}, {}}), Error{});
  pass(milliseconds(1));
  EXPECT_EQ(line_->state().master_priority, 0);
  EXPECT_EQ(write(0x1F80, 0, {std::byte{0x20}, {}, {}, {}}), refused) << "without bit 0";
}

TEST_F(FlyingMasterServiceTest, WithoutTimesItCannotBeOne) {
  start(config_with_axis());
  EXPECT_EQ(result(LocalWrite{.address = {0x1F80, 0}, .data = {std::byte{0x21}, {}, {}, {}}}).error,
            (Error{Domain::sdo, static_cast<std::uint32_t>(AbortCode::invalid_value)}));
}

TEST_F(FlyingMasterServiceTest, ASlaveMonitorsTheActiveMaster) {
  start(config());
  events();
  follow_other();
  expect(Role::device, FlyingMasterState::slave, kOtherMaster);
  const std::vector<Event> all = events();
  const auto changed = std::ranges::find(all, EventKind::flying_master, &Event::kind);
  ASSERT_NE(changed, all.end());
  EXPECT_EQ(changed->node, kOtherMaster);
  EXPECT_EQ(changed->data, EventData(event::FlyingMaster{.state = FlyingMasterState::slave,
                                                         .before = FlyingMasterState::detect,
                                                         .priority = 1}));
  EXPECT_EQ(line_->dictionary().number({0x1016, 1}), 0x0009'0000U + 400U);
  follow_other(11);
  EXPECT_EQ(line_->dictionary().number({0x1016, 1}), 0x000B'0000U + 400U);
  hear(0x70B, {0x05});
  pass(milliseconds(399));
  expect(Role::device, FlyingMasterState::slave, 11);
  pass(milliseconds(2));
  expect(Role::device, FlyingMasterState::detect, 0);
  EXPECT_EQ(line_->dictionary().number({0x1016, 1}), 0U);
}

TEST_F(FlyingMasterServiceTest, AnEntryOfTheMasterThatExistsIsLeft) {
  LineConfig wanted = config();
  wanted.own_values = {
      {.address = {0x1016, 3}, .data = {std::byte{100}, {}, std::byte{kOtherMaster}, {}}}};
  start(wanted);
  follow_other();
  EXPECT_EQ(line_->dictionary().number({0x1016, 1}), 0U);
  hear(0x709, {0x05});
  pass(milliseconds(101));
  expect(Role::device, FlyingMasterState::detect, 0);
  EXPECT_EQ(line_->dictionary().number({0x1016, 3}), 0x0009'0064U);
}

TEST_F(FlyingMasterServiceTest, TheTimeOfTheMasterIsConfigured) {
  LineConfig wanted = config();
  wanted.flying_master->master_heartbeat = milliseconds(750);
  start(wanted);
  follow_other();
  EXPECT_EQ(line_->dictionary().number({0x1016, 1}), 0x0009'0000U + 750U);
}

TEST_F(FlyingMasterServiceTest, ASlaveRefusesOutputsAndCommandsAndNamesTheMaster) {
  start(config());
  EXPECT_EQ(write(1), OutputRefusal::wrong_role) << "the master is not known yet";
  EXPECT_THAT(result(Boot{.node = 5}).bytes(), IsEmpty());
  follow_other();
  pass(seconds(2));  // an event of a refused write is repeated after a second
  events();
  EXPECT_EQ(write(1), OutputRefusal::wrong_role);
  EXPECT_TRUE(emitted(EventKind::output_refused, kOtherMaster));
  const Request requests[] = {
      SdoRead{.node = 5, .address = {0x1000, 0}},
      Boot{.node = 5},
      NmtRequest{.node = 5, .command = nmt::Command::start},
      SingleOutput{.entry = 0, .data = std::vector<std::byte>(4)},
      ObjectWrite{.node = 5, .address = {0x2001, 0}, .data = std::vector<std::byte>(4)},
      PdoTrigger{.number = 1},
      PdoRequest{.number = 1},
      MpdoWrite{.node = 5, .address = {0x6000, 1}, .data = {std::byte{1}}, .tpdo = 1}};
  for (const Request& request : requests) {
    const Reply reply = result(request);
    EXPECT_EQ(reply.error, to_error(Refusal::wrong_role)) << static_cast<int>(kind(request));
    EXPECT_EQ(reply.bytes(), std::vector{std::byte{kOtherMaster}});
  }
  EXPECT_TRUE(result(LocalRead{.what = od::Address{0x1000, 0}}).ok());
  EXPECT_FALSE(line_->request_pdo(1));
  EXPECT_THAT(sent(), Not(Contains(StartsWith("605#"))));
  EXPECT_EQ(write_local(0x5F41, 0x0C, 0x0501, 2).error, to_error(AbortCode::local_control))
      << "triggers RPDO 1";
}

TEST_F(FlyingMasterServiceTest, TheRoleIsGivenUpWithoutLosingTheImage) {
  start(config());
  become_master();
  const std::uint64_t layout = line_->layout(Direction::inputs).id;
  hear(0x185, {0x34, 0x12, 1, 0, 0, 0});
  EXPECT_EQ(write(1), OutputRefusal::none);
  pass(milliseconds(1));
  EXPECT_THAT(sent(), Contains(StartsWith("205#")));
  line_->execute({.tag = 5, .request = SdoRead{.node = 5, .address = {0x1000, 0}}}, now_);
  events();

  follow_other();
  expect(Role::device, FlyingMasterState::slave, kOtherMaster);
  EXPECT_EQ(line_->state().manager, ManagerState::inactive);
  Reply reply = answer();
  EXPECT_EQ(reply.tag, 5U);
  EXPECT_EQ(reply.error, to_error(Refusal::wrong_role)) << "pending";
  EXPECT_THAT(sent(), Not(Contains(StartsWith("605#4")))) << "the request waited for the bus";
  EXPECT_EQ(reply.bytes(), std::vector{std::byte{kOtherMaster}});
  EXPECT_EQ(line_->layout(Direction::inputs).id, layout);
  EXPECT_EQ(line_->state().own_state, nmt::State::operational);
  EXPECT_EQ(line_->input(0).value, 0x1234U);
  EXPECT_TRUE(line_->input(0).valid) << "the node has not changed";
  hear(0x705, {0x05});
  hear(0x185, {0x35, 0x12, 1, 0, 0, 0});
  EXPECT_EQ(line_->input(0).value, 0x1235U);
  EXPECT_TRUE(line_->input(0).valid);
  sent();
  pass(seconds(2));
  EXPECT_FALSE(emitted(EventKind::output_watchdog)) << "the group is not armed";
  EXPECT_THAT(sent(), Not(Contains(StartsWith("205#"))));
}

// Not even a first heartbeat has to come for that.
TEST_F(FlyingMasterServiceTest, ANodeThatDiesWithTheChangeOfTheRoleIsNotShownAsValid) {
  start(config());
  become_master();
  hear(0x185, {0x34, 0x12, 1, 0, 0, 0});
  follow_other();
  EXPECT_TRUE(line_->input(0).valid);
  pass(seconds(2));
  EXPECT_FALSE(line_->input(0).valid);
  EXPECT_NE(line_->node_state(5).presence, manager::Presence::present);
}

// Guarding ends with the role. If the new master does not guard the node, nothing shows that it
// lives.
TEST_F(FlyingMasterServiceTest, ANodeThatIsNotGuardedAnyMoreIsNotShownAsValid) {
  LineConfig wanted = config();
  wanted.nodes[0].heartbeat = {};
  wanted.nodes[0].guard_time = milliseconds(100);
  wanted.nodes[0].life_time_factor = 3;
  start(wanted);
  boot_guarded_node();
  hear(0x185, {0x34, 0x12, 1, 0, 0, 0});
  ASSERT_TRUE(line_->input(0).valid);
  follow_other();
  pass(seconds(11));
  EXPECT_FALSE(line_->input(0).valid);
}

TEST_F(FlyingMasterServiceTest, ANewMasterSendsNoOldOutputs) {
  start(config());
  become_master();
  const auto arming_wanted = [this] {
    OutputState state;
    line_->output_state(0, state);
    return state.arming_wanted;
  };
  EXPECT_FALSE(arming_wanted()) << "nothing was written";
  EXPECT_EQ(write(1), OutputRefusal::none);
  EXPECT_FALSE(arming_wanted());
  follow_other();
  become_master();
  pass(milliseconds(10));
  EXPECT_THAT(sent(), Not(Contains(StartsWith("205#"))));
  EXPECT_TRUE(arming_wanted());
  EXPECT_EQ(write(1), OutputRefusal::not_armed);
  EXPECT_EQ(write(2), OutputRefusal::none);
  EXPECT_FALSE(arming_wanted());
  pass(milliseconds(1));
  EXPECT_THAT(sent(), Contains(StartsWith("205#07")));
}

TEST_F(FlyingMasterServiceTest, ASlaveSendsNoDefaults) {
  LineConfig wanted = config();
  wanted.defaults = {{.entry = 0, .value = 7}, {.entry = 1, .value = 1}};
  start(wanted);
  pass(milliseconds(50));
  EXPECT_THAT(sent(), Not(Contains(StartsWith("205#"))));
  follow_other();
  hear(0x705, {0x05});
  pass(milliseconds(50));
  EXPECT_THAT(sent(), Not(Contains(StartsWith("205#"))));
  become_master_quietly();
  EXPECT_THAT(sent(), Contains(StartsWith("205#07")));
}

TEST_F(FlyingMasterServiceTest, AnOutputThatFollowsAnInputIsSentAgain) {
  LineConfig wanted = config();
  wanted.bound = {0, 1};
  start(wanted);
  become_master();
  line_->write_bound(std::vector<BoundValue>{{.entry = 0, .value = 7}, {.entry = 1, .value = 1}},
                     now_);
  pass(milliseconds(1));
  EXPECT_THAT(sent(), Contains(StartsWith("205#07")));
  follow_other();
  line_->write_bound(std::vector<BoundValue>{{.entry = 0, .value = 8}}, now_);
  pass(milliseconds(10));
  EXPECT_THAT(sent(), Not(Contains(StartsWith("205#"))));
  become_master_quietly();
  EXPECT_THAT(sent(), Contains(StartsWith("205#08")));
}

// The values of a gateway come all the time; those of a source that was lost meanwhile are not
// sent.
TEST_F(FlyingMasterServiceTest, AForwardedGroupIsFilledAnew) {
  LineConfig wanted = config();
  wanted.groups = {{.number = 1, .name = "far", .entries = {0, 1}, .forwarded = true}};
  start(wanted);
  become_master();
  const auto forward = [this](std::uint64_t arming) {
    return line_->write_outputs({.group = 1,
                                 .layout_id = line_->layout(Direction::outputs).id,
                                 .arming = arming,
                                 .watchdog = milliseconds(500),
                                 .values = {{.entry = 0, .length = 4, .data = {std::byte{7}}},
                                            {.entry = 1, .length = 1, .data = {std::byte{1}}}},
                                 .forwarded = true},
                                now_);
  };
  EXPECT_EQ(forward(1), OutputRefusal::none);
  pass(milliseconds(1));
  EXPECT_THAT(sent(), Contains(StartsWith("205#07")));
  follow_other();
  events();
  EXPECT_EQ(forward(2), OutputRefusal::wrong_role);
  EXPECT_FALSE(emitted(EventKind::output_refused, kOtherMaster));
  become_master_quietly();
  EXPECT_THAT(sent(), Not(Contains(StartsWith("205#"))));
  EXPECT_EQ(forward(3), OutputRefusal::none);
  pass(milliseconds(1));
  EXPECT_THAT(sent(), Contains(StartsWith("205#07")));
}

TEST_F(FlyingMasterServiceTest, ARefusalForAnotherReasonNamesNoNode) {
  start(config());
  become_master();
  const auto expect_refused = [this] {
    const Reply reply = result(RoutingTrace{.duration = seconds(1)});
    EXPECT_EQ(reply.error, to_error(Refusal::wrong_role)) << "the line does not route";
    EXPECT_THAT(reply.bytes(), IsEmpty());
  };
  expect_refused();
  follow_other();
  expect_refused();
}

TEST_F(FlyingMasterServiceTest, KeepAliveNodesAreTakenOverWithoutReset) {
  LineConfig wanted = config();
  wanted.nodes[0].keep_alive = true;
  start(wanted);
  pass(milliseconds(600));
  EXPECT_THAT(nmt_sent(), ElementsAre("073#", "072#"));
  pass(milliseconds(1700));
  EXPECT_EQ(line_->state().role, Role::manager);
  EXPECT_THAT(nmt_sent(), ElementsAre("071#0114"));
  line_->stop(now_);
  EXPECT_THAT(nmt_sent(), IsEmpty()) << "the next master takes it over as it is";
}

TEST_F(FlyingMasterServiceTest, OtherNodesAreStoppedWithTheLine) {
  start(config());
  become_master();
  line_->stop(now_);
  EXPECT_THAT(nmt_sent(), ElementsAre("000#8005"));
}

TEST_F(FlyingMasterServiceTest, TheActiveMasterAnswersAndGreets) {
  start(config());
  become_master();
  hear(0x073, {});
  EXPECT_THAT(nmt_sent(), Contains("071#0114"));
  hear(0x708, {0x00});
  EXPECT_THAT(nmt_sent(), Contains("071#0114"));
  hear(0x075, {});
  EXPECT_THAT(nmt_sent(), Contains("074#"));
}

TEST_F(FlyingMasterServiceTest, AResetOfTheOwnNodeGivesTheRoleUp) {
  start(config());
  become_master();
  EXPECT_TRUE(result(NmtRequest{.node = 20, .command = nmt::Command::reset_communication}).ok());
  pass(milliseconds(10));
  expect(Role::device, FlyingMasterState::detect, 0);
  pass(milliseconds(600));
  EXPECT_THAT(nmt_sent(), ElementsAre("073#", "072#")) << "the other nodes are not reset";
}

TEST_F(FlyingMasterServiceTest, ASlaveIsResetByTheMasterAndSearchesAgain) {
  start(config());
  follow_other();
  hear(0x000, {0x82, 0x00});
  pass(milliseconds(10));
  EXPECT_THAT(sent(), Contains("714#00"));
  expect(Role::device, FlyingMasterState::detect, 0);
  EXPECT_EQ(line_->dictionary().number({0x1016, 1}), 0U);
  EXPECT_EQ(line_->state().own_state, nmt::State::operational) << "1F80h bit 2 is clear";
  pass(milliseconds(500));
  follow_other();
  EXPECT_EQ(line_->dictionary().number({0x1016, 1}), 0x0009'0000U + 400U);
}

TEST_F(FlyingMasterServiceTest, TheActiveMasterAloneProducesSyncAndTime) {
  LineConfig wanted = config();
  wanted.sync_period = milliseconds(10);
  wanted.time_period = milliseconds(50);
  start(wanted);
  line_->set_utc(seconds(1'700'000'000));
  const auto produced = [this] {
    pass(milliseconds(100));
    const std::vector<std::string> frames = sent();
    return std::pair{
        std::ranges::count(frames, "080#"),
        std::ranges::count_if(frames, [](const auto& frame) { return frame.starts_with("100#"); })};
  };
  EXPECT_EQ(produced(), (std::pair<long, long>{0, 0}));
  EXPECT_EQ(line_->dictionary().number({0x1005, 0}), 0x80U);
  EXPECT_EQ(line_->dictionary().number({0x1012, 0}), 0x8000'0100U);
  become_master();
  const auto by_master = produced();
  EXPECT_GE(by_master.first, 1) << "one at a time waits for the bus";
  EXPECT_GE(by_master.second, 1);
  follow_other();
  sent();
  EXPECT_EQ(produced(), (std::pair<long, long>{0, 0}));
  EXPECT_TRUE(
      result(LocalWrite{.address = {0x1005, 0}, .data = {std::byte{0x80}, {}, {}, std::byte{0x40}}})
          .ok());
  EXPECT_EQ(produced(), (std::pair<long, long>{0, 0})) << "nor if it is switched on meanwhile";
  become_master();
  EXPECT_GE(produced().first, 1);
}

TEST_F(FlyingMasterServiceTest, TheBitsOf1F80hApplyAtRunTime) {
  start(config());
  ASSERT_TRUE(line_->dictionary().set({0x1F80, 0}, 1U));
  pass(milliseconds(1));
  EXPECT_EQ(line_->state().role, Role::manager);
  EXPECT_EQ(line_->state().flying_master, FlyingMasterState::none);
  ASSERT_TRUE(line_->dictionary().set({0x1F80, 0}, 0x21U));
  pass(milliseconds(1));
  expect(Role::device, FlyingMasterState::detect, 0);
  ASSERT_TRUE(line_->dictionary().set({0x1F80, 0}, 0U));
  pass(milliseconds(1));
  EXPECT_EQ(line_->state().role, Role::device);
  EXPECT_EQ(line_->state().flying_master, FlyingMasterState::none);
}

TEST_F(FlyingMasterServiceTest, AMalformedMessageIsReported) {
  start(config());
  hear(0x071, {0});
  EXPECT_TRUE(emitted(EventKind::malformed_frame, 0));
  expect(Role::device, FlyingMasterState::detect, 0);
}

TEST_F(FlyingMasterServiceTest, MessagesThatWaitForTheBusDoNotAddUp) {
  start(config());
  pass(seconds(60));
  std::vector<std::string> frames = nmt_sent();
  EXPECT_EQ(std::ranges::count(frames, "073#"), 1);
  EXPECT_EQ(std::ranges::count(frames, "071#0114"), 1);
}

// --- the bus is cut -----------------------------------------------------------------------------

// It would be the first one to send when the bus is back, in a network that has a master.
TEST_F(FlyingMasterServiceTest, ASlaveWithoutABusWaitsAndResetsNothing) {
  start_acknowledged(config());
  follow_other();
  live(seconds(1), true, kOtherMaster);
  expect(Role::device, FlyingMasterState::slave, kOtherMaster);
  sent();
  live(seconds(20), false);
  expect(Role::device, FlyingMasterState::detect, 0);
  EXPECT_THAT(nmt_sent(), Each("073#")) << "it looks whether the bus accepts a frame";
  live(milliseconds(20));
  EXPECT_THAT(nmt_sent(), IsEmpty());
  live(milliseconds(500));
  EXPECT_THAT(nmt_sent(), ElementsAre("073#"));
  follow_other();
  live(seconds(2), true, kOtherMaster);
  expect(Role::device, FlyingMasterState::slave, kOtherMaster);
  EXPECT_THAT(nmt_sent(), Not(Contains(StartsWith("000#"))));
}

// The socket lost the echo of a frame: only that of a later one shows that the bus is there.
TEST_F(FlyingMasterServiceTest, AnAcknowledgementThatIsLostSilencesNobody) {
  start_acknowledged(config());
  follow_other();
  live(seconds(1), true, kOtherMaster);
  live(milliseconds(500), false, kOtherMaster);  // frames are sent, but no echo comes
  sent();
  for (const Instant end = now_ + seconds(5); now_ < end;) {
    pass(milliseconds(10));
    const std::uint64_t before = line_->state().counters.frames_sent;
    hand_out_all();
    if (const std::uint64_t after = line_->state().counters.frames_sent; after != before) {
      line_->acknowledged(after, now_);
    }
  }
  EXPECT_THAT(nmt_sent(), Contains("073#"));
  EXPECT_NE(line_->state().flying_master, FlyingMasterState::detect) << "its search goes on";
}

TEST_F(FlyingMasterServiceTest, ALineThatStartsWithoutABusWaits) {
  make(config());
  line_->expect_acknowledgements();
  line_->start(now_);
  live(seconds(20), false);
  expect(Role::device, FlyingMasterState::detect, 0);
  EXPECT_THAT(nmt_sent(), Not(Contains(StartsWith("000#"))));
  live(seconds(4));
  EXPECT_EQ(line_->state().role, Role::manager) << "the others acknowledge, and none is a master";
}

TEST_F(FlyingMasterServiceTest, ASlaveWhoseInterfaceFailsWaits) {
  for (const can::BusEvent::Kind kind :
       {can::BusEvent::Kind::state, can::BusEvent::Kind::interface_failed}) {
    start(config());
    follow_other();
    hear(0x709, {0x05});
    line_->bus_event({.kind = kind, .state = can::BusState::bus_off, .time = now_});
    pass(seconds(20));
    expect(Role::device, FlyingMasterState::detect, 0);
    EXPECT_THAT(nmt_sent(), IsEmpty());
    line_->bus_event(
        {.kind = kind == can::BusEvent::Kind::state ? kind : can::BusEvent::Kind::interface_ready,
         .state = can::BusState::error_active,
         .time = now_});
    line_->advance(now_);
    pass(milliseconds(510));
    EXPECT_THAT(nmt_sent(), ElementsAre("073#"));
  }
}

// The others have not missed its heartbeat.
TEST_F(FlyingMasterServiceTest, TheActiveMasterKeepsItsRoleForAShortTimeWithoutABus) {
  LineConfig wanted = config();
  wanted.flying_master->master_heartbeat = seconds(1);
  start_acknowledged(wanted);
  become_master_quietly();
  live(seconds(1), true, 5);
  sent();
  live(milliseconds(900), false);
  expect(Role::manager, FlyingMasterState::master, 20);
  live(seconds(1), true, 5);
  expect(Role::manager, FlyingMasterState::master, 20);
  sent();
  live(milliseconds(1500), false);
  expect(Role::device, FlyingMasterState::detect, 0);
  live(seconds(20), false);
  sent();
  live(milliseconds(520));
  EXPECT_THAT(nmt_sent(), ElementsAre("073#")) << "it asks first";
}

TEST_F(FlyingMasterServiceTest, AResetThatWaitsForTheBusIsDroppedIfThereIsAMaster) {
  start(config());
  pass(milliseconds(600));
  expect(Role::device, FlyingMasterState::reset, 0);
  follow_other();
  EXPECT_THAT(nmt_sent(), ElementsAre("073#"));
}

// The configured time decides, not the time for the answer.
TEST_F(FlyingMasterServiceTest, ALateMasterIsNotReplaced) {
  LineConfig wanted = config();
  wanted.flying_master->master_heartbeat = seconds(2);
  start_acknowledged(wanted);
  follow_other();
  live(milliseconds(4150), true, kOtherMaster);
  sent();
  live(milliseconds(800));
  EXPECT_THAT(nmt_sent(), ElementsAre("073#"));
  expect(Role::device, FlyingMasterState::slave, kOtherMaster);
  follow_other();
  hear(0x709, {0x05});
  live(seconds(1), true, kOtherMaster);
  expect(Role::device, FlyingMasterState::slave, kOtherMaster);
  EXPECT_THAT(nmt_sent(), IsEmpty());
}

// --- the role is lost in the same round ---------------------------------------------------------

TEST_F(FlyingMasterServiceTest, OrdersOfTheSameRoundAreDropped) {
  const auto change = [this] {
    follow_other();
    expect(Role::device, FlyingMasterState::slave, kOtherMaster);
    const std::vector<std::string> frames = sent();
    EXPECT_THAT(frames, Not(Contains(StartsWith("605#40"))));
    EXPECT_THAT(frames, Not(Contains(StartsWith("000#"))));
  };
  start(config());
  become_master();
  EXPECT_TRUE(write_local(0x5F41, 0x0A, 5, 1).ok()) << "scan";
  change();
  become_master();
  std::vector<std::byte> concise_dcf;
  for (const int value : {1, 0, 0, 0, 0x17, 0x10, 0, 2, 0, 0, 0, 100, 0}) {
    concise_dcf.push_back(static_cast<std::byte>(value));
  }
  EXPECT_TRUE(result(LocalWrite{.address = {0x1F22, 5}, .data = concise_dcf}).ok());
  EXPECT_TRUE(write_local(0x1F25, 5, 0x666E'6F63).ok()) << "configure";
  change();
}

TEST_F(FlyingMasterServiceTest, AnOrderToGuardOfTheSameRoundIsDropped) {
  LineConfig wanted = config();
  wanted.nodes[0].heartbeat = {};
  wanted.nodes[0].guard_time = milliseconds(100);
  wanted.nodes[0].life_time_factor = 3;
  start(wanted);
  boot_guarded_node();
  EXPECT_TRUE(write_local(0x1F83, 5, 0, 1).ok());
  pass(milliseconds(1));
  sent();
  EXPECT_TRUE(write_local(0x1F83, 5, 1, 1).ok());
  follow_other();
  pass(seconds(1));
  EXPECT_THAT(sent(), Not(Contains(StartsWith("705#"))));
}

TEST_F(FlyingMasterServiceTest, ACommandOfTheSameRoundIsRefused) {
  start(config());
  become_master();
  hear(0x071, {0, kOtherMaster});
  const Reply reply = result(NmtRequest{.node = 5, .command = nmt::Command::stop});
  EXPECT_EQ(reply.error, to_error(Refusal::wrong_role));
  EXPECT_EQ(reply.bytes(), std::vector{std::byte{kOtherMaster}});
  pass(milliseconds(1));
  EXPECT_THAT(nmt_sent(), IsEmpty());
}

TEST_F(FlyingMasterServiceTest, AWatchdogThatIsDueThenHasNoReaction) {
  start(config());
  become_master();
  EXPECT_EQ(write(1, kNmtStop | kSendEmcy), OutputRefusal::none);
  pass(milliseconds(499));
  sent();
  events();
  now_ += milliseconds(2);
  hear(0x071, {0, kOtherMaster});
  line_->advance(now_);
  EXPECT_FALSE(emitted(EventKind::output_watchdog));
  const std::vector<std::string> frames = sent();
  EXPECT_THAT(frames, Not(Contains(StartsWith("000#"))));
  EXPECT_THAT(frames, Not(Contains(StartsWith("094#"))));
}

TEST_F(FlyingMasterServiceTest, TheErrorOfAWatchdogEndsWithTheRole) {
  start(config());
  become_master();
  EXPECT_EQ(write(1, kSendEmcy), OutputRefusal::none);
  pass(milliseconds(600));
  EXPECT_NE(line_->dictionary().number({0x1001, 0}), 0U);
  follow_other();
  EXPECT_EQ(line_->dictionary().number({0x1001, 0}), 0U);
}

// --- what waits when the role is lost -----------------------------------------------------------

OwnObject flying_own_object(std::uint8_t sub, bool in_image) {
  OwnObject out{.index = 0x2100, .variable = {}};
  out.variable.sub = sub;
  out.variable.type = od::DataType::unsigned32;
  out.variable.access = in_image ? od::Access::ro : od::Access::rw;
  out.variable.mappable = true;
  out.variable.value.resize(4);
  out.in_image = in_image;
  return out;
}

pdo::Parameters flying_mpdo(std::uint16_t number, std::uint32_t id, pdo::MpdoMode mode) {
  pdo::Parameters out;
  out.number = number;
  out.cob_id = {id | can::CobId::kNoRtrBit};
  out.mpdo = mode;
  return out;
}

TEST_F(FlyingMasterServiceTest, MpdosThatWaitAreDropped) {
  LineConfig wanted = config();
  wanted.own_objects = {flying_own_object(1, false), flying_own_object(2, true)};
  wanted.forwarding.tpdos = {flying_mpdo(100, 0x1F0, pdo::MpdoMode::destination),
                             flying_mpdo(101, 0x1F1, pdo::MpdoMode::source)};
  wanted.forwarding.tpdos[0].mapping = {{{0x2100, 1}, 32}};
  wanted.mpdo_scanner = {0x01'2100'02};
  make(wanted);
  line_->expect_acknowledgements();
  line_->start(now_);
  become_master();
  line_->acknowledged(line_->state().counters.frames_sent, now_);
  const auto last =
      static_cast<std::uint32_t>(line_->layout(Direction::outputs).entries.size() - 1);
  const auto write_scanned = [&](std::uint64_t arming) {
    return line_->write_outputs({.layout_id = line_->layout(Direction::outputs).id,
                                 .arming = arming,
                                 .values = {{.entry = last, .length = 4, .data = {std::byte{7}}}}},
                                now_);
  };
  EXPECT_EQ(write_scanned(1), OutputRefusal::none);
  line_->execute(
      {.tag = 3,
       .request =
           MpdoWrite{.node = 5, .address = {0x6000, 1}, .data = {std::byte{1}}, .tpdo = 100}},
      now_);
  follow_other();
  EXPECT_EQ(answer().error, to_error(Refusal::wrong_role));
  pass(milliseconds(100));
  const std::vector<std::string> frames = sent();
  EXPECT_THAT(frames, Not(Contains(StartsWith("1F0#"))));
  EXPECT_THAT(frames, Not(Contains(StartsWith("1F1#"))));
  line_->acknowledged(line_->state().counters.frames_sent, now_);
  become_master_quietly();
  EXPECT_THAT(sent(), Not(Contains(StartsWith("1F1#")))) << "it was forgotten";
  EXPECT_EQ(write_scanned(2), OutputRefusal::none);
  EXPECT_THAT(sent(), Contains("1F1#1400210207000000"));
}

TEST_F(FlyingMasterServiceTest, ADefaultThatAnMpdoCarriesIsSentByTheActiveMaster) {
  LineConfig wanted = config();
  wanted.own_objects = {flying_own_object(2, true)};
  wanted.forwarding.tpdos = {flying_mpdo(101, 0x1F1, pdo::MpdoMode::source)};
  wanted.mpdo_scanner = {0x01'2100'02};
  wanted.defaults = {{.entry = 2, .value = 7}};
  start(wanted);
  ASSERT_EQ(line_->layout(Direction::outputs).entries[2].index, 0x2100);
  follow_other();
  pass(milliseconds(100));
  EXPECT_THAT(sent(), Not(Contains(StartsWith("1F1#"))));
  become_master_quietly();
  EXPECT_THAT(sent(), Contains("1F1#1400210207000000"));
  follow_other();
  pass(milliseconds(100));
  EXPECT_THAT(sent(), Not(Contains(StartsWith("1F1#"))));
}

TEST_F(FlyingMasterServiceTest, AnMpdoIsNotSentWhenTheBusOfAPassiveLineIsBack) {
  LineConfig wanted = config();
  wanted.own_objects = {flying_own_object(2, true)};
  wanted.forwarding.tpdos = {flying_mpdo(101, 0x1F1, pdo::MpdoMode::source)};
  wanted.mpdo_scanner = {0x01'2100'02};
  wanted.defaults = {{.entry = 2, .value = 7}};
  start(wanted);
  follow_other();
  pass(milliseconds(100));
  can::BusEvent event{.kind = can::BusEvent::Kind::state, .state = can::BusState::bus_off};
  event.time = now_;
  line_->bus_event(event);
  pass(milliseconds(10));
  event.state = can::BusState::error_active;
  event.time = now_;
  line_->bus_event(event);
  pass(milliseconds(100));
  EXPECT_THAT(sent(), Not(Contains(StartsWith("1F1#"))));
  EXPECT_FALSE(snapshot(image::Direction::outputs).is_valid(2));
}

TEST_F(FlyingMasterServiceTest, APdoThatWasRequestedIsNotRequestedAnyMore) {
  start(config());
  become_master();
  line_->execute({.tag = 4, .request = PdoRequest{.node = 5, .number = 1}}, now_);
  follow_other();
  const Reply reply = answer();
  EXPECT_EQ(reply.tag, 4U);
  EXPECT_EQ(reply.error, to_error(Refusal::wrong_role));
  EXPECT_THAT(sent(), Not(Contains(StartsWith("185#"))));
}

TEST_F(FlyingMasterServiceTest, SyncAndTimeThatWaitAreDropped) {
  LineConfig wanted = config();
  wanted.sync_period = milliseconds(10);
  wanted.time_period = milliseconds(50);
  start(wanted);
  line_->set_utc(seconds(1'700'000'000));
  become_master();
  pass(milliseconds(100));
  follow_other();
  const std::vector<std::string> frames = sent();
  EXPECT_THAT(frames, Not(Contains("080#")));
  EXPECT_THAT(frames, Not(Contains(StartsWith("100#"))));
}

TEST_F(FlyingMasterServiceTest, AnOutputThatFollowsAnInputDoesNotGetItsDefault) {
  LineConfig wanted = config();
  wanted.bound = {0, 1};
  wanted.defaults = {{.entry = 0, .value = 3}, {.entry = 1, .value = 1}};
  start(wanted);
  become_master();
  line_->write_bound(std::vector<BoundValue>{{.entry = 0, .value = 7}, {.entry = 1, .value = 1}},
                     now_);
  pass(milliseconds(1));
  EXPECT_THAT(sent(), Contains(StartsWith("205#07")));
  follow_other();
  become_master_quietly();
  const std::vector<std::string> frames = sent();
  EXPECT_THAT(frames, Contains(StartsWith("205#07")));
  EXPECT_THAT(frames, Not(Contains(StartsWith("205#03"))));
}

TEST_F(FlyingMasterServiceTest, ALineThatIsStartedAgainSendsNoOldOutputs) {
  start(config());
  become_master();
  EXPECT_EQ(write(1), OutputRefusal::none);
  line_->stop(now_);
  line_->start(now_);
  pass(seconds(1));
  EXPECT_FALSE(emitted(EventKind::output_watchdog));
  sent();
  become_master_quietly();
  EXPECT_THAT(sent(), Not(Contains(StartsWith("205#"))));
  EXPECT_EQ(write(1), OutputRefusal::not_armed);
}

TEST_F(FlyingMasterServiceTest, ANodeThatTheNetworkListKeepsAliveIsNotStopped) {
  start(config());
  become_master();
  const auto listed = line_->dictionary().number({0x1F81, 5});
  ASSERT_TRUE(listed);
  EXPECT_TRUE(write_local(0x1F81, 5, static_cast<std::uint32_t>(*listed | 0x10)).ok());
  pass(milliseconds(1));
  nmt_sent();
  line_->stop(now_);
  EXPECT_THAT(nmt_sent(), IsEmpty());
}

// --- what a slave stores ------------------------------------------------------------------------

TEST_F(FlyingMasterServiceTest, ASlaveStoresTheValuesOfTheActiveMaster) {
  storage::MemoryMedium medium;
  LineConfig wanted = config();
  wanted.stores_parameters = true;
  wanted.sync_period = milliseconds(10);
  wanted.time_period = milliseconds(50);
  make(wanted);
  line_->set_medium(&medium);
  line_->start(now_);
  follow_other();
  ASSERT_EQ(line_->dictionary().number({0x1005, 0}), 0x80U);
  ASSERT_EQ(line_->dictionary().number({0x1012, 0}), 0x8000'0100U);
  ASSERT_NE(line_->dictionary().number({0x1016, 1}), 0U);
  EXPECT_EQ(write_local(0x1010, 1, 0x6576'6173).error, Error{});
  ASSERT_EQ(line_->dictionary().number({0x1005, 0}), 0x80U);

  make(wanted);
  line_->set_medium(&medium);
  line_->start(now_);
  follow_other(11);
  EXPECT_EQ(line_->dictionary().number({0x1016, 1}), 0x000B'0000U + 400U);
  become_master_quietly();
  EXPECT_EQ(line_->dictionary().number({0x1005, 0}), 0x4000'0080U);
  EXPECT_EQ(line_->dictionary().number({0x1012, 0}), 0x4000'0100U);
  EXPECT_EQ(line_->dictionary().number({0x1016, 1}), 0U);
}

TEST(FlyingMasterConfiguration, IsChecked) {
  const auto is_good = [](const FlyingMasterConfig& flying, Role role = Role::manager) {
    LineConfig config = config_with_axis();
    config.flying_master = flying;
    config.role = role;
    return Line::make(std::move(config)).ok();
  };
  EXPECT_TRUE(is_good({}));
  EXPECT_TRUE(is_good({.detect_cycle = milliseconds(65535)}));
  EXPECT_FALSE(is_good({}, Role::device));
  EXPECT_FALSE(is_good({}, Role::observer));
  EXPECT_FALSE(is_good({.priority = 3}));
  EXPECT_FALSE(is_good({.master_timeout = {}}));
  EXPECT_FALSE(is_good({.negotiation_delay = seconds(66)}));
  EXPECT_FALSE(is_good({.detect_cycle = seconds(66)}));
  EXPECT_FALSE(is_good({.priority_slot = milliseconds(1270)}));
  EXPECT_TRUE(is_good({.priority_slot = milliseconds(1271)}));
}

}  // namespace
}  // namespace linegate::line

// SPDX-License-Identifier: Apache-2.0
// The own node of a manager as a flying master (CiA 302-2): its role at run time.
#include "stack/line/flying_master_service.h"

#include <utility>

#include "line_fixture.h"

namespace linegate::line {
namespace {

using nmt::FlyingMasterState;
using testing::Contains;
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
  void follow_other(std::uint8_t other = kOtherMaster) {
    hear(0x071, {0, other});
    pass(milliseconds(1));
  }
  OutputRefusal write(std::uint64_t arming) {
    return line_->write_outputs({.layout_id = line_->layout(Direction::outputs).id,
                                 .arming = arming,
                                 .watchdog = milliseconds(500),
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
  EXPECT_EQ(write(0x1F90, 6, {{}, {}}), refused);
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
      PdoTrigger{.number = 1}};
  for (const Request& request : requests) {
    const Reply reply = result(request);
    EXPECT_EQ(reply.error, to_error(Refusal::wrong_role)) << static_cast<int>(kind(request));
    EXPECT_EQ(reply.bytes(), std::vector{std::byte{kOtherMaster}});
  }
  EXPECT_TRUE(result(LocalRead{.what = od::Address{0x1000, 0}}).ok());
  EXPECT_THAT(sent(), Not(Contains(StartsWith("605#"))));
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
  hear(0x185, {0x34, 0x12, 1, 0, 0, 0});
  ASSERT_TRUE(line_->input(0).valid);
  follow_other();
  pass(seconds(11));
  EXPECT_FALSE(line_->input(0).valid);
}

TEST_F(FlyingMasterServiceTest, ANewMasterSendsNoOldOutputs) {
  start(config());
  become_master();
  EXPECT_EQ(write(1), OutputRefusal::none);
  follow_other();
  become_master();
  pass(milliseconds(10));
  EXPECT_THAT(sent(), Not(Contains(StartsWith("205#"))));
  EXPECT_EQ(write(1), OutputRefusal::not_armed);
  EXPECT_EQ(write(2), OutputRefusal::none);
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

TEST_F(FlyingMasterServiceTest, ARefusalOfTheActiveMasterNamesNoNode) {
  start(config());
  become_master();
  const Reply reply = result(RoutingTrace{.duration = seconds(1)});
  EXPECT_EQ(reply.error, to_error(Refusal::wrong_role)) << "the line does not route";
  EXPECT_THAT(reply.bytes(), IsEmpty());
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
  EXPECT_LE(std::ranges::count(frames, "073#"), 1);
  EXPECT_LE(std::ranges::count(frames, "071#0114"), 1);
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

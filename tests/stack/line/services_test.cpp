// Services of a line besides the boot of its nodes: guarding, the own node-ID, TIME.
#include "tests/stack/line/line_fixture.h"

namespace linegate::line {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

// An old device that has no heartbeat.
TEST_F(LineTest, AGuardedNodeIsAskedAndMissed) {
  LineConfig config = config_with_axis();
  config.nodes[0].heartbeat = Duration::zero();
  config.nodes[0].guard_time = milliseconds(100);
  config.nodes[0].life_time_factor = 2;
  make(config);
  line_->start(now_);
  hear(0x705, {0x00});
  hear(0x585, {0x43, 0x00, 0x10, 0x00, 0x92, 0x01, 0x02, 0x00});
  hear(0x585, {0x43, 0x18, 0x10, 0x01, 0x23, 0x01, 0x00, 0x00});
  hear(0x585, {0x43, 0x18, 0x10, 0x02, 0x42, 0x00, 0x00, 0x00});
  sent();
  hear(0x585, {0x80, 0x18, 0x10, 0x04, 0x11, 0x00, 0x09, 0x06});
  EXPECT_THAT(sent(), ElementsAre("605#2B0C100064000000"));
  hear(0x585, {0x60, 0x0C, 0x10, 0x00, 0, 0, 0, 0});
  EXPECT_THAT(sent(), ElementsAre("605#2F0D100002000000"));
  hear(0x585, {0x60, 0x0D, 0x10, 0x00, 0, 0, 0, 0});
  EXPECT_THAT(sent(), ElementsAre("705#00")) << "a remote frame";
  hear(0x705, {0x7F});
  EXPECT_THAT(sent(), ElementsAre("000#0105"));
  pass(milliseconds(100));
  sent();
  hear(0x705, {0x85});
  EXPECT_EQ(line_->node_state(5).state, nmt::State::operational);
  hear(0x705, {0x85});
  EXPECT_EQ(line_->state().counters.frames_malformed, 1U) << "the same toggle bit";
  events();
  pass(milliseconds(200));
  EXPECT_TRUE(told(EventKind::heartbeat_lost, 5));
  EXPECT_EQ(line_->node_state(5).presence, Presence::missing);
  EXPECT_THAT(sent(), testing::Contains("000#8105"));
}

TEST_F(LineTest, GuardingNeedsBothNumbersAndNoHeartbeat) {
  LineConfig config = config_with_axis();
  config.nodes[0].guard_time = milliseconds(100);
  const auto refused = Line::make(config);
  ASSERT_EQ(refused.diagnostics.size(), 2U);
  EXPECT_THAT(refused.diagnostics[0].text, HasSubstr("both time and factor"));
  EXPECT_THAT(refused.diagnostics[1].text, HasSubstr("either a heartbeat or guarding"));
}

TEST_F(LineTest, AFloodOfBusErrorsIsCountedAndToldOnceASecond) {
  make(config_with_axis());
  boot();
  events();
  for (int i = 0; i < 2500; ++i) {
    line_->bus_event({.kind = can::BusEvent::Kind::error, .errors = can::kProtocol, .time = now_});
    pass(milliseconds(1));
  }
  pass(seconds(5));
  std::vector<std::uint8_t> lengths;
  for (const Event& event : events()) {
    if (event.kind == EventKind::bus_error) {
      lengths.push_back(event.length);
    }
  }
  EXPECT_THAT(lengths, ElementsAre(0, 12, 12, 12));
  EXPECT_EQ(line_->state().counters.bus_errors, 2500U);
}

// What the bus goes through is the own node's error, too; a manager goes on after bus-off.
TEST_F(LineTest, BusStatesReachTheOwnNode) {
  make(config_with_axis());
  boot();
  const auto bus = [this](can::BusState state) {
    line_->bus_event({.state = state, .time = now_});
  };
  EXPECT_EQ(line_->indicators(), (node::Indicators{node::Pattern::on, node::Pattern::off}));
  bus(can::BusState::error_passive);
  EXPECT_THAT(sent(), testing::Contains("0FF#2081110000000000"));
  EXPECT_EQ(line_->indicators().error, node::Pattern::single_flash);
  bus(can::BusState::bus_off);
  EXPECT_EQ(line_->indicators().error, node::Pattern::on);
  EXPECT_EQ(line_->state().own_state, nmt::State::operational);
  bus(can::BusState::error_active);
  EXPECT_EQ(line_->indicators().error, node::Pattern::off);
  EXPECT_THAT(sent(), testing::Contains("0FF#0000000000000000"));
}

TEST_F(LineTest, ProducesTime) {
  LineConfig config = config_with_axis();
  config.time_period = seconds(1);
  make(config);
  line_->set_utc(seconds(441'763'200) - now_.time_since_epoch());
  line_->start(now_);
  sent();
  pass(milliseconds(999));
  EXPECT_THAT(sent(), testing::Not(testing::Contains(HasSubstr("100#"))));
  pass(milliseconds(1));
  EXPECT_THAT(sent(), testing::Contains("100#E80300000000"));
}

TEST_F(LineTest, ConsumesTime) {
  make(config_with_axis());
  boot();
  EXPECT_FALSE(line_->network_utc(now_));
  hear(0x100, {0xE8, 0x03, 0, 0, 1, 0});
  pass(seconds(2));
  EXPECT_EQ(line_->network_utc(now_), seconds(441'763'200 + 86'400 + 3));
  hear(0x100, {0xE8, 0x03, 0, 0, 1});
  EXPECT_EQ(line_->state().counters.frames_malformed, 1U);
}

// Somebody gave a device the node-ID of the manager.
TEST_F(LineTest, TheOwnNodeIdOfAnotherIsTold) {
  make(config_with_axis());
  boot();
  hear(0x77F, {0x00});
  EXPECT_TRUE(told(EventKind::duplicate_node_id, 127));
  EXPECT_EQ(line_->state().own_state, nmt::State::operational);
}

}  // namespace
}  // namespace linegate::line

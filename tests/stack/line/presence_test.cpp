// SPDX-License-Identifier: Apache-2.0
// The reported state of nodes that appear and disappear: nodes that are not configured, and nodes
// whose error control is not monitored.
#include "stack/base/byte_order.h"
#include "stack/nmt/life_signs.h"
#include "stack/od/dictionary.h"

#include "tests/stack/line/line_fixture.h"

namespace linegate::line {
namespace {

using std::chrono::seconds;

class PresenceTest : public LineTest {
 protected:
  static constexpr std::uint8_t kUnlisted = 99;

  void start() {
    make(config_with_axis());
    boot();
  }

  std::uint64_t own(std::uint16_t index, std::uint8_t sub) {
    const auto value = line_->dictionary().read({index, sub});
    return value.ok() ? load_le(*value) : ~std::uint64_t{0};
  }

  // One bit of an object with 4 x 32 bits, one bit for each node.
  bool listed(std::uint16_t index, std::uint8_t node) {
    const auto word = own(index, static_cast<std::uint8_t>((node - 1) / 32 + 1));
    return (word >> (node - 1) % 32 & 1) != 0;
  }

  void beat(std::uint8_t node, nmt::State state, int times) {
    for (int i = 0; i < times; ++i) {
      hear(0x700U + node, {static_cast<std::uint8_t>(state)});
      pass(milliseconds(200));
      hear(0x705, {0x05});
    }
  }
};

TEST_F(PresenceTest, AnUnlistedNodeCountsAsPresentAsLongAsItsHeartbeatsCome) {
  start();
  beat(kUnlisted, nmt::State::operational, 4);
  EXPECT_EQ(line_->node_state(kUnlisted).presence, Presence::present);
  EXPECT_EQ(line_->node_state(kUnlisted).state, nmt::State::operational);
  EXPECT_TRUE(listed(0x5F03, kUnlisted)) << "the node is not assigned";
  EXPECT_TRUE(listed(0x5F04, kUnlisted)) << "Operational";
  EXPECT_EQ(own(0x1F82, kUnlisted), 5U);
  const std::uint64_t revision = line_->node_revision(kUnlisted);
  pass(nmt::LifeSigns::kShortest);
  EXPECT_EQ(line_->node_state(kUnlisted).presence, Presence::missing);
  EXPECT_EQ(line_->node_state(kUnlisted).state, nmt::State::unknown);
  EXPECT_FALSE(listed(0x5F03, kUnlisted));
  EXPECT_FALSE(listed(0x5F04, kUnlisted));
  EXPECT_EQ(own(0x1F82, kUnlisted), 1U) << "missing";
  EXPECT_GT(line_->node_revision(kUnlisted), revision);
  events();
  hear(0x700U + kUnlisted, {0x05});
  EXPECT_TRUE(emitted(EventKind::unexpected_node, kUnlisted)) << "the node returned";
}

TEST_F(PresenceTest, AnUnlistedNodeThatWasHeardOnceIsNotKnownToBeThereAfterAWhile) {
  start();
  hear(0x700U + kUnlisted, {0x00});
  EXPECT_EQ(line_->node_state(kUnlisted).presence, Presence::present);
  pass(nmt::LifeSigns::kHold);
  EXPECT_EQ(line_->node_state(kUnlisted).presence, Presence::unknown);
  EXPECT_EQ(line_->node_state(kUnlisted).state, nmt::State::unknown);
  EXPECT_EQ(own(0x1F82, kUnlisted), 0U) << "unknown";
}

TEST_F(PresenceTest, AResetOfAnUnlistedNodeEndsTheStateThatItShowed) {
  start();
  hear(0x700U + kUnlisted, {0x05});
  line_->execute({.request = NmtRequest{.node = kUnlisted, .command = nmt::Command::reset_node}},
                 now_);
  EXPECT_EQ(line_->node_state(kUnlisted).state, nmt::State::unknown);
  EXPECT_FALSE(listed(0x5F04, kUnlisted));
  hear(0x700U + kUnlisted, {0x00});
  EXPECT_EQ(line_->node_state(kUnlisted).state, nmt::State::pre_operational);
}

// The boot process of the node has not reached the start of error control again.
TEST_F(PresenceTest, AfterAResetOfTheOwnNodeHeartbeatsSayMoreThanCommands) {
  start();
  line_->execute({.request = NmtRequest{.node = line_->config().node_id,
                                        .command = nmt::Command::reset_communication}},
                 now_);
  pass(milliseconds(1));
  hear(0x705, {0x7F});
  line_->execute({.request = NmtRequest{.node = 5, .command = nmt::Command::start}}, now_);
  EXPECT_EQ(line_->node_state(5).state, nmt::State::pre_operational);
  hear(0x705, {0x05});
  EXPECT_EQ(line_->node_state(5).state, nmt::State::operational);
}

TEST_F(PresenceTest, AScanEndsThePresenceOfAnUnlistedNodeThatDoesNotAnswer) {
  start();
  hear(0x700U + kUnlisted, {0x05});
  pass(milliseconds(10));
  line_->execute({.request = Scan{.node = kUnlisted}}, now_);
  sent();
  pass(seconds(1));
  EXPECT_EQ(line_->node_state(kUnlisted).presence, Presence::missing);
  line_->execute({.request = Scan{.node = kUnlisted}}, now_);
  sent();
  hear(0x580U + kUnlisted, {0x43, 0x00, 0x10, 0x00, 0x91, 0x01, 0x0F, 0x00});
  EXPECT_EQ(line_->node_state(kUnlisted).presence, Presence::present);
}

TEST_F(PresenceTest, BootOfANodeThatWasNeverHeardLeavesNoState) {
  start();
  const std::uint64_t revision = line_->node_revision(kUnlisted);
  line_->execute({.tag = 7, .request = Boot{.node = kUnlisted}}, now_);
  EXPECT_EQ(line_->node_revision(kUnlisted), revision) << "nothing to be published";
  EXPECT_TRUE(emitted(EventKind::boot_result, kUnlisted));
  Reply reply;
  ASSERT_TRUE(line_->pop_reply(reply));
  const auto& outcomes = std::get<std::vector<manager::BootOutcome>>(reply.data);
  ASSERT_EQ(outcomes.size(), 1U);
  EXPECT_EQ(outcomes[0].letter, 'A');
}

TEST_F(PresenceTest, AMissingNodeShowsNoStateNotEvenAfterAStartOfAll) {
  start();
  EXPECT_EQ(line_->node_state(5).state, nmt::State::operational);
  pass(seconds(1));
  EXPECT_EQ(line_->node_state(5).presence, Presence::missing);
  EXPECT_EQ(line_->node_state(5).state, nmt::State::unknown);
  line_->execute({.request = NmtRequest{.node = 0, .command = nmt::Command::start}}, now_);
  EXPECT_EQ(line_->node_state(5).state, nmt::State::unknown);
  EXPECT_EQ(own(0x1F82, 5), 1U);
}

TEST_F(PresenceTest, ANodeThatWasResetShowsNoStateUntilItIsHeard) {
  start();
  line_->execute({.request = Boot{.node = 5}}, now_);
  EXPECT_EQ(line_->node_state(5).state, nmt::State::unknown);
  hear(0x705, {0x00});
  EXPECT_EQ(line_->node_state(5).state, nmt::State::pre_operational);
}

TEST_F(PresenceTest, ALossThatTheOwnConsumerFindsReachesTheManager) {
  start();
  ASSERT_TRUE(line_->dictionary().set({0x1016, 1}, std::uint32_t{0x0005'0064}));
  line_->advance(now_);
  hear(0x705, {0x05});
  sent();
  pass(milliseconds(110));
  EXPECT_EQ(line_->node_state(5).presence, Presence::missing);
  EXPECT_THAT(sent(), testing::Contains("000#8105"));
}

// Two consumers receive the error control messages of the node: the consumer of 1016h, and the
// line.
TEST_F(PresenceTest, StatesOfANodeInTheOwn1016hAreReportedOnce) {
  LineConfig config = config_with_axis();
  config.role = Role::device;
  config.nodes.clear();
  make(std::move(config));
  line_->start(now_);
  ASSERT_TRUE(line_->dictionary().set({0x1016, 1}, std::uint32_t{0x0063'0064}));
  line_->advance(now_);
  events();
  const auto count = [&](EventKind kind) {
    const std::vector<Event> all = events();
    return std::ranges::count(all, kind, &Event::kind);
  };
  hear(0x700 + kUnlisted, {0x05});
  EXPECT_EQ(count(EventKind::node_state), 1);
  hear(0x700 + kUnlisted, {0x00});
  EXPECT_EQ(count(EventKind::boot_up), 1);
  pass(milliseconds(10));
  hear(0x700 + kUnlisted, {0x7F});
  pass(milliseconds(110));
  EXPECT_EQ(count(EventKind::heartbeat_lost), 1);
}

TEST_F(PresenceTest, TheOwn1016hShowsWhatTheManagerMonitors) {
  start();
  EXPECT_EQ(own(0x1016, 1), 0x0005'00FAU) << "2.5 heartbeat times";
  EXPECT_EQ(own(0x1016, 2), 0U);
  pass(milliseconds(100));
  hear(0x705, {0x05});
  pass(milliseconds(260));
  EXPECT_EQ(line_->node_state(5).heartbeats_lost, 1U);
  EXPECT_FALSE(emitted(EventKind::emcy_sent, 127)) << "not monitored by the own consumer";
}

TEST_F(PresenceTest, ANodeOfAManagerThatWasStoppedCountsAsPresentUntilItsHeartbeatIsLate) {
  start();
  line_->stop(now_);
  EXPECT_EQ(line_->node_state(5).presence, Presence::present);
  pass(seconds(1));
  EXPECT_EQ(line_->node_state(5).presence, Presence::missing);
}

TEST_F(PresenceTest, ANodeThatBootsUpWhileTheManagerIsStoppedNeedNotSendHeartbeats) {
  start();
  line_->stop(now_);
  hear(0x705, {0x00});
  pass(seconds(1));
  EXPECT_EQ(line_->node_state(5).presence, Presence::present);
  pass(nmt::LifeSigns::kHold);
  EXPECT_EQ(line_->node_state(5).presence, Presence::unknown);
}

// Its heartbeat was not configured, so that its silence does not show that it is gone.
TEST_F(PresenceTest, ANodeWhoseBootEndedBeforeItsHeartbeatWasConfiguredIsNotMissingForItsSilence) {
  make(config_with_axis());
  line_->start(now_);
  hear(0x705, {0x00});
  hear(0x585, {0x43, 0x00, 0x10, 0x00, 0x91, 0x01, 0x0F, 0x00});  // another device type
  EXPECT_EQ(line_->node_state(5).boot, 'C');
  EXPECT_EQ(line_->node_state(5).presence, Presence::present);
  pass(nmt::LifeSigns::kHold);
  EXPECT_EQ(line_->node_state(5).presence, Presence::unknown);
  EXPECT_EQ(line_->node_state(5).state, nmt::State::unknown);
}

TEST_F(PresenceTest, AManagerThatIsStoppedWhileANodeBootsDoesNotExpectItsHeartbeat) {
  make(config_with_axis());
  line_->start(now_);
  hear(0x705, {0x00});
  line_->stop(now_);
  pass(seconds(1));
  EXPECT_EQ(line_->node_state(5).presence, Presence::present);
  pass(nmt::LifeSigns::kHold);
  EXPECT_EQ(line_->node_state(5).presence, Presence::unknown);
}

}  // namespace
}  // namespace linegate::line

// SPDX-License-Identifier: Apache-2.0
#include "stack/line/output_service.h"

#include <algorithm>
#include <array>
#include <vector>

#include <gtest/gtest.h>

#include "tests/stack/line/service_fixture.h"

namespace linegate::line {
namespace {

constexpr std::uint16_t kSetpointIndex = 0x2002;  // entry 0, in RPDO 1 of node 5 with entry 1
constexpr std::uint16_t kUnmapped = 0x1017;

// A line that is not NMT master: it has received nothing from node 5.
struct OutputServiceTest : testing::Test, NmtHost {
  OutputServiceTest() { host.set_manages(false); }
  void nmt_sent(nmt::Command /*command*/, std::uint8_t /*node*/, Instant /*now*/) override {}
  bool has_failed() const override { return false; }

  void write_entry(std::uint32_t entry, std::vector<std::byte> data) {
    service.execute(
        {.tag = ++tag, .request = SingleOutput{.entry = entry, .data = std::move(data)}}, now);
  }
  void write_object(std::uint16_t index, std::vector<std::byte> data, bool force_sdo = false) {
    const ObjectWrite request{
        .node = kAxis, .address = {index, 0}, .data = std::move(data), .force_sdo = force_sdo};
    service.execute({.tag = ++tag, .request = request}, now);
  }
  void trigger(std::uint8_t node, std::uint16_t number) {
    service.execute({.tag = ++tag, .request = PdoTrigger{.node = node, .number = number}}, now);
  }
  // Writes all values of the PDO.
  void write_all() {
    write_entry(0, kSetpointValue);
    write_entry(1, {std::byte{3}});
  }
  OutputWrite group_write(std::uint64_t arming) const {
    return {.layout_id = parts.image.layout(Direction::outputs).id,
            .arming = arming,
            .watchdog = milliseconds(100),
            .reactions = kZeroOutputs,
            .values = {{.entry = 0, .length = 4, .data = {std::byte{9}}},
                       {.entry = 1, .length = 1, .data = {std::byte{3}}}},
            .bytes = {}};
  }
  // The frames of the PDO that were sent.
  std::vector<std::string> sent() {
    std::vector<std::string> out;
    for (can::Frame frame; parts.node->next_frame(frame, now);) {
      if (frame.id == 0x205) {
        out.push_back(text(frame));
      }
    }
    return out;
  }
  bool reported(EventKind kind) {
    std::array<Event, 16> events;
    const std::size_t count = parts.events.take(events);
    return std::ranges::any_of(std::span(events).first(count),
                               [kind](const Event& event) { return event.kind() == kind; });
  }
  PdoWait wait(std::uint64_t of) { return std::get<WrittenByPdo>(host.data(of)).wait; }

  const std::vector<std::byte> kSetpointValue{std::byte{9}, {}, {}, {}};
  NodeParts parts{config_with_axis()};
  ManagerParts managed{false};
  Instant now = parts.now;
  nmt::Master master{managed.transmit};
  RecordingHost host;
  NmtService nmt{host, *this, master, *parts.node, managed.manager, parts.config.node_id};
  NoFlyingMaster flying{host, parts, managed.manager};
  OutputReceivers receivers{host,
                            parts.config,
                            {.manager = managed.manager,
                             .nmt = managed,
                             .master = master,
                             .pdos = parts.node->pdos(),
                             .flying = flying.service}};
  diagnosis::ControlSettings settings;
  routing::Counters routed;
  ServiceStub by_sdo{host};
  OutputService service{host,
                        parts.config,
                        {.node = *parts.node,
                         .image = parts.image,
                         .plan = parts.plan,
                         .nmt = nmt,
                         .receivers = receivers,
                         .flying = flying.service,
                         .settings = settings,
                         .forwarded = parts.forwarded,
                         .routed = routed,
                         .events = parts.events},
                        by_sdo};
  std::uint64_t tag = 0;
};

TEST_F(OutputServiceTest, ASingleValueIsAnsweredWithWhatItsPdoWaitsFor) {
  receivers.follow();
  write_entry(0, kSetpointValue);
  EXPECT_EQ(host.answer(tag), Error{});
  EXPECT_EQ(wait(tag), PdoWait::values);
  EXPECT_TRUE(sent().empty());
  write_entry(1, {std::byte{3}});
  EXPECT_FALSE(host.answer(tag));
  EXPECT_EQ(sent(), std::vector<std::string>{"205#0900000003"});
  host.acknowledge();
  EXPECT_EQ(wait(tag), PdoWait::none);
}

TEST_F(OutputServiceTest, ASingleValueIsRefusedWhereItMakesNoSense) {
  write_entry(0, {std::byte{1}});
  EXPECT_EQ(host.answer(tag), to_error(Refusal::bad_request));
  write_entry(99, {std::byte{1}});
  EXPECT_EQ(host.answer(tag), to_error(Refusal::unknown_entry));
  managed.manager.heartbeat(kAxis, nmt::State::stopped, now);
  write_entry(1, {std::byte{1}});
  EXPECT_EQ(host.answer(tag), to_error(Refusal::wrong_state));
}

TEST_F(OutputServiceTest, AnObjectGoesByPdoIfOneCarriesIt) {
  write_object(kSetpointIndex, kSetpointValue);
  EXPECT_EQ(host.answer(tag), Error{});
  EXPECT_TRUE(std::holds_alternative<WrittenByPdo>(host.data(tag)));
  EXPECT_TRUE(by_sdo.taken.empty());
  write_object(kUnmapped, {std::byte{1}, std::byte{0}});
  write_object(kSetpointIndex, kSetpointValue, true);
  EXPECT_EQ(by_sdo.taken.size(), 2U);
  settings.enforce_sdo = true;
  write_object(kSetpointIndex, kSetpointValue);
  EXPECT_EQ(by_sdo.taken.size(), 3U);
}

TEST_F(OutputServiceTest, TheUpdateTimeCollectsTheValuesOfAPdo) {
  write_all();
  settings.update_time = milliseconds(20);
  write_object(kSetpointIndex, kSetpointValue);
  EXPECT_EQ(wait(tag), PdoWait::update_time);
  EXPECT_EQ(service.next_wake(), now + milliseconds(20));
  service.advance(now + milliseconds(20));
  EXPECT_EQ(service.next_wake(), kNever);
}

TEST_F(OutputServiceTest, AWatchdogZeroesTheGroupUntilItIsArmedAnew) {
  EXPECT_EQ(service.write(group_write(1), now), OutputRefusal::none);
  EXPECT_TRUE(reported(EventKind::output_armed));
  EXPECT_EQ(service.next_watchdog(), now + milliseconds(100));
  service.expire_watchdogs(now + milliseconds(100));
  EXPECT_TRUE(reported(EventKind::output_watchdog));
  EXPECT_EQ(parts.image.read_entry(Direction::outputs, 0), 0U);
  EXPECT_EQ(service.write(group_write(1), now), OutputRefusal::not_armed);
  EXPECT_EQ(service.write(group_write(2), now), OutputRefusal::none);
  EXPECT_EQ(parts.image.read_entry(Direction::outputs, 0), 9U);
}

TEST_F(OutputServiceTest, AnEmcyThatIsNotSentIsNoReaction) {
  const auto reactions = [this](std::uint64_t arming) {
    OutputWrite write = group_write(arming);
    write.reactions |= kSendEmcy;
    EXPECT_EQ(service.write(write, now), OutputRefusal::none);
    now += milliseconds(100);
    service.expire_watchdogs(now);
    std::array<Event, 16> events;
    const std::size_t count = parts.events.take(events);
    const auto fired =
        std::ranges::find(std::span(events).first(count), EventKind::output_watchdog, &Event::kind);
    return fired->get<event::OutputWatchdog>()->reactions;
  };
  EXPECT_EQ(reactions(1), kZeroOutputs | kSendEmcy);
  parts.node->command(nmt::Command::stop, now);
  EXPECT_EQ(reactions(2), kZeroOutputs) << "a stopped node sends no EMCY";
}

TEST_F(OutputServiceTest, AnotherClientThatTakesAGroupOverIsAnEvent) {
  OutputWrite write = group_write(1);
  write.client_number = 7;
  EXPECT_EQ(service.write(write, now), OutputRefusal::none);
  EXPECT_EQ(service.write(write, now), OutputRefusal::none);
  EXPECT_FALSE(reported(EventKind::output_owner));
  write.client_number = 8;
  write.client = "the same name";
  EXPECT_EQ(service.write(write, now), OutputRefusal::none);
  EXPECT_TRUE(reported(EventKind::output_owner));
}

TEST_F(OutputServiceTest, ARefusalByTheOwnerOfTheLineHasTheNumberOfItsClient) {
  OutputWrite write = group_write(1);
  write.client = "hmi";
  write.client_number = 7;
  write.layout_id = 1;
  EXPECT_EQ(service.write(write, now), OutputRefusal::stale_layout);
  OutputState state;
  service.describe(0, state, now);
  EXPECT_EQ(state.refused_client, "hmi");
  EXPECT_EQ(state.refused_number, 7U);
  service.note_refused({.refusal = OutputRefusal::not_permitted, .client = 8}, now);
  service.describe(0, state, now);
  EXPECT_EQ(state.refusal, OutputRefusal::not_permitted);
  EXPECT_EQ(state.refused_client, "");
  EXPECT_EQ(state.refused_number, 8U);
  EXPECT_EQ(state.refused, 2U);
}

// A write that waits for the share of its client keeps the group in use.
TEST_F(OutputServiceTest, AWriteThatWaitsFeedsTheWatchdog) {
  EXPECT_TRUE(service.feed_watchdog(group_write(1), now));
  EXPECT_EQ(service.next_watchdog(), kNever) << "it arms the group when it is applied";
  EXPECT_EQ(service.write(group_write(1), now), OutputRefusal::none);
  now += milliseconds(60);
  EXPECT_TRUE(service.feed_watchdog(group_write(1), now));
  EXPECT_EQ(service.next_watchdog(), now + milliseconds(100));
  OutputWrite other = group_write(1);
  other.layout_id = ~other.layout_id;
  EXPECT_FALSE(service.feed_watchdog(other, now + milliseconds(1)));
  EXPECT_EQ(service.next_watchdog(), now + milliseconds(100)) << "it would be refused";
  service.expire_watchdogs(now + milliseconds(100));
  EXPECT_FALSE(service.feed_watchdog(group_write(1), now + milliseconds(100)));
  EXPECT_TRUE(reported(EventKind::output_watchdog));
}

TEST_F(OutputServiceTest, AGroupTellsWhatItsValuesWaitFor) {
  OutputState state;
  service.describe(0, state, now);
  ASSERT_EQ(state.waits.size(), 2U);
  EXPECT_EQ(state.waits[0].reason, OutputWait::value);
  write_entry(0, kSetpointValue);
  state = {};
  service.describe(0, state, now);
  EXPECT_EQ(state.waits.at(0).reason, OutputWait::values);
}

TEST_F(OutputServiceTest, APdoIsTriggeredByItsNumberOrThatOfTheDevice) {
  trigger(kAxis, 1);
  EXPECT_EQ(host.answer(tag), to_error(Refusal::wrong_state)) << "its values were not written";
  write_all();
  trigger(kAxis, 1);
  EXPECT_FALSE(host.answer(tag));
  host.acknowledge();
  EXPECT_EQ(host.data(tag), ReplyData{TriggeredPdos{1}});
  trigger(0, 1);
  service.before_boot(now);
  EXPECT_EQ(host.answer(tag), to_error(Refusal::wrong_state));
  trigger(kAxis, 9);
  EXPECT_EQ(host.answer(tag), to_error(Refusal::unknown_entry));
  EXPECT_EQ(service.may_trigger({.node = kAxis, .number = 1}), AbortCode::none);
  EXPECT_EQ(service.may_trigger({.node = kAxis, .number = 9}), AbortCode::invalid_value);
}

TEST_F(OutputServiceTest, WithoutAnAcknowledgementItSaysWhatTheFrameWaitsFor) {
  write_all();
  host.expire(service, now);
  EXPECT_EQ(wait(tag), PdoWait::turn);
  write_entry(0, kSetpointValue);
  host.set_stuck(true);
  host.expire(service, now);
  EXPECT_EQ(wait(tag), PdoWait::bus);
  trigger(kAxis, 1);
  host.expire(service, now);
  EXPECT_EQ(host.answer(tag), to_error(Refusal::no_acknowledge));
}

TEST_F(OutputServiceTest, AValueOfAnotherLineIsWrittenOrForgotten) {
  receivers.follow();
  const std::array both{BoundValue{.entry = 0, .value = 7, .always = true},
                        BoundValue{.entry = 1, .value = 2, .always = true}};
  service.write_bound(both, now);
  EXPECT_EQ(routed.values, 2U);
  EXPECT_EQ(sent(), std::vector<std::string>{"205#0700000002"});
  const BoundValue lost{.entry = 0, .valid = false};
  service.write_bound(std::span(&lost, 1), now);
  EXPECT_FALSE(parts.image.is_known(Direction::outputs, 0));
}

}  // namespace
}  // namespace linegate::line

// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "fake_link.h"

namespace linegate::client {
namespace {

using namespace std::chrono_literals;
using enum image::Direction;

struct ClientCore : testing::Test {
  std::shared_ptr<FakeWorld> world = std::make_shared<FakeWorld>();
  Client client = fake_client(world);
  Line line = client.line("press");

  void begin() {
    world->whole_line(1);
    client.poll(0ms);
    ASSERT_TRUE(line.ready());
  }
  // Time passes, and the line publishes its state once a second.
  void publish_for(int seconds) {
    for (int i = 0; i < seconds; ++i) {
      world->now += 1s;
      world->line(1);
      client.poll(0ms);
    }
  }
  void applied(std::uint64_t arming, const std::string& owner, bool tripped = false) {
    line::OutputState state;
    state.owner = owner;
    state.arming = arming;
    state.arming_wanted = tripped;
    world->group(1, state);
    client.poll(0ms);
  }
};

TEST_F(ClientCore, ALayoutOfARestartedGatewayBeforeItsStateIsAccepted) {
  begin();
  for (const auto direction : {inputs, outputs}) {
    world->layout(direction, 2);
    client.poll(0ms);
  }
  world->line(2);
  world->image(inputs, 2, 9);
  world->image(outputs, 2, 9);
  client.poll(0ms);
  EXPECT_TRUE(line.ready());
  EXPECT_EQ(line.read("ram.In").as<int>(), 9);

  // Late samples of the former incarnation change nothing.
  world->layout(inputs, 1, 6);
  world->image(inputs, 1, 3, 6);
  world->line(1);
  client.poll(0ms);
  EXPECT_TRUE(line.ready());
  EXPECT_EQ(line.read("ram.In").as<int>(), 9);
}

// The layouts of the other gateway come only once, so they are kept.
TEST_F(ClientCore, TheGatewayThatStaysOfTwoWithOneNameIsReadAgain) {
  begin();
  world->whole_line(2);
  world->image(inputs, 2, 8);
  client.poll(0ms);
  EXPECT_EQ(line.read("ram.In").as<int>(), 8);
  for (int i = 0; i < 5; ++i) {
    world->now += 1s;
    world->line(1);
    world->image(inputs, 1, 6);
    world->image(outputs, 1, 6);
    client.poll(0ms);
  }
  EXPECT_TRUE(line.ready());
  EXPECT_EQ(line.read("ram.In").as<int>(), 6);
}

TEST_F(ClientCore, ALineOfTwoGatewaysWithOneNameIsAmbiguous) {
  begin();
  Group group = line.group("");
  ASSERT_EQ(group.arm(), Error::none);
  world->line(1, "1");
  client.poll(0ms);
  EXPECT_EQ(line.status(), LineStatus::ambiguous);
  EXPECT_EQ(line.read("ram.In").quality, Quality::ambiguous);
  EXPECT_EQ(group.reason(), LossReason::ambiguous);
  EXPECT_EQ(client.line("gw/press").status(), LineStatus::ambiguous);
  world->line(1);
  client.poll(0ms);
  EXPECT_TRUE(line.ready());
}

TEST_F(ClientCore, ALineOfTwoGatewaysThatEndIsLostOrSilent) {
  begin();
  std::vector<LineStatus> reported;
  const Subscription subscription =
      client.on_line([&](const Change& change) { reported.push_back(change.status); });
  client.poll(0ms);
  world->line(1, "1");
  client.poll(0ms);
  EXPECT_EQ(reported.back(), LineStatus::ambiguous);
  world->now += 4s;
  client.poll(0ms);
  EXPECT_EQ(line.status(), LineStatus::silent);
  world->gone();
  client.poll(0ms);
  client.poll(0ms);
  EXPECT_EQ(line.status(), LineStatus::lost);
  EXPECT_EQ(reported.back(), LineStatus::lost);
}

// The client begins while both run: layouts come before the states.
TEST_F(ClientCore, OfTwoGatewaysThatRanBeforeOneIsRead) {
  for (const std::uint64_t incarnation : {1U, 2U}) {
    for (const auto direction : {inputs, outputs}) {
      world->layout(direction, incarnation);
      world->image(direction, incarnation, static_cast<std::uint8_t>(incarnation));
    }
  }
  world->image(inputs, 1, 1);
  world->line(1);
  client.poll(0ms);
  EXPECT_TRUE(line.ready());
  EXPECT_EQ(line.read("ram.In").as<int>(), 1);
  world->line(2);
  world->image(inputs, 2, 2);
  world->image(outputs, 2, 2);
  client.poll(0ms);
  EXPECT_TRUE(line.ready());
  EXPECT_EQ(line.read("ram.In").as<int>(), 2);
}

// The gateway converts the time of a refusal anew in each state.
TEST_F(ClientCore, ARefusalIsNewOnlyIfItIsCounted) {
  begin();
  line::OutputState state{.refused = 1,
                          .refused_at = world->now,
                          .refusal = line::OutputRefusal::not_armed,
                          .refused_client = "app"};
  world->group(1, state);
  client.poll(0ms);
  Group group = line.group("");
  ASSERT_EQ(group.arm(), Error::none);
  state.owner = "app";
  state.arming = world->writes.back().second.arming;
  state.refused_at += std::chrono::nanoseconds(1);
  world->group(1, state);
  client.poll(0ms);
  EXPECT_TRUE(group.held());
  state.refused = 2;
  state.refused_at -= 1h;
  world->group(1, state);
  client.poll(0ms);
  EXPECT_EQ(group.state(), GroupState::refused);
}

// An earlier application of the same name was refused.
TEST_F(ClientCore, ARefusalBeforeTheFirstStateOfAGroupIsNotOfItsArming) {
  begin();
  Group group = line.group("1");
  ASSERT_EQ(group.arm(), Error::none);
  line::OutputState state{.group = 1,
                          .refused = 4,
                          .refused_at = world->now,
                          .refusal = line::OutputRefusal::not_armed,
                          .refused_client = "app"};
  world->group(1, state);
  client.poll(0ms);
  EXPECT_EQ(group.state(), GroupState::taking);
  state.refused = 5;
  world->group(1, state);
  client.poll(0ms);
  EXPECT_EQ(group.state(), GroupState::refused);
}

TEST_F(ClientCore, ANameWithoutDirectionNeedsTheLayoutOfTheInputs) {
  world->layout(outputs, 1, 7, "ram.X");
  world->image(outputs, 1, 4);
  world->line(1);
  client.poll(0ms);
  EXPECT_EQ(line.read("ram.X").quality, Quality::no_data);
  EXPECT_NE(line.read("outputs:ram.X").quality, Quality::no_data);
  world->layout(inputs, 1, 7, "ram.X");
  world->image(inputs, 1, 9);
  client.poll(0ms);
  EXPECT_EQ(line.read("ram.X").as<int>(), 9);
}

TEST_F(ClientCore, TheStateOfANodeMayComeBeforeThatOfItsLine) {
  begin();
  world->node(2, {.node = 1, .presence = line::Presence::missing});
  world->whole_line(2);
  world->invalid_image(inputs, 2);
  client.poll(0ms);
  EXPECT_EQ(line.read("ram.In").quality, Quality::node_missing);
}

TEST_F(ClientCore, EventsOfAGatewayThatStartedAgainAreNew) {
  std::vector<std::uint64_t> numbers;
  const Subscription subscription =
      client.on_event([&](const Event& event) { numbers.push_back(event.number); });
  world->gateway(1, 500);
  world->gateway_event(1, 500);
  world->gateway_event(1, 501);
  world->gateway(2, 0);
  world->gateway_event(2, 1);
  client.poll(0ms);
  client.poll(0ms);
  EXPECT_EQ(numbers, (std::vector<std::uint64_t>{501, 1}));
}

TEST_F(ClientCore, AGroupIsHeldLostAndArmedAgain) {
  begin();
  Group group = line.group("");
  EXPECT_EQ(group.set("ram.Out", 3), Error::none);
  client.poll(0ms);
  EXPECT_TRUE(world->writes.empty());
  ASSERT_EQ(group.arm(), Error::none);
  ASSERT_EQ(world->writes.size(), 1U);
  const std::uint64_t first = world->writes.back().second.arming;
  ASSERT_EQ(world->writes.back().second.values.size(), 1U);
  EXPECT_EQ(world->writes.back().second.values[0].data[0], std::byte{3});
  EXPECT_EQ(group.state(), GroupState::taking);
  applied(first, "app");
  EXPECT_TRUE(group.held());

  applied(first, "other");
  EXPECT_EQ(group.state(), GroupState::lost);
  EXPECT_EQ(group.reason(), LossReason::other_owner);
  const std::size_t writes = world->writes.size();
  client.poll(1s);
  EXPECT_EQ(world->writes.size(), writes);

  EXPECT_EQ(group.set("ram.Out", 4), Error::none);
  ASSERT_EQ(group.arm(), Error::none);
  const std::uint64_t second = world->writes.back().second.arming;
  EXPECT_GT(second, first);
  applied(second, "app");
  EXPECT_TRUE(group.held());
  applied(second, "app", true);
  EXPECT_EQ(group.reason(), LossReason::watchdog);
}

TEST_F(ClientCore, AGroupThatItsGatewayRemovedIsLostAtOnce) {
  begin();
  Group group = line.group("");
  EXPECT_EQ(group.set("ram.Out", 3), Error::none);
  ASSERT_EQ(group.arm(), Error::none);
  applied(world->writes.back().second.arming, "app");
  EXPECT_TRUE(group.held());
  world->group_gone(1);  // another one
  client.poll(0ms);
  EXPECT_TRUE(group.held());
  world->group_gone(0);
  client.poll(0ms);
  EXPECT_EQ(group.state(), GroupState::lost);
  EXPECT_EQ(group.reason(), LossReason::no_group);
  EXPECT_EQ(group.owner(), "");
}

// A reload that gives the name of a group to another one, or to none, with the same outputs.
TEST_F(ClientCore, AnotherGroupOfThatNameIsALoss) {
  world->group(1, {.group = 1, .name = "left"});
  begin();
  Group group = line.group("left");
  for (const std::uint16_t number : {std::uint16_t{1}, std::uint16_t{2}}) {
    EXPECT_EQ(group.set("ram.Out", 3), Error::none);
    ASSERT_EQ(group.arm(), Error::none);
    const line::OutputWrite& last = world->writes.back().second;
    EXPECT_EQ(last.group, number);
    world->group(1, {.group = number, .name = "left", .owner = "app", .arming = last.arming});
    client.poll(0ms);
    EXPECT_TRUE(group.held());
    world->group(1, {.group = number, .name = "right"});
    if (number == 1)
      world->group(1, {.group = 2, .name = "left"});
    const std::size_t writes = world->writes.size();
    client.poll(0ms);
    EXPECT_EQ(group.state(), GroupState::lost);
    EXPECT_EQ(group.reason(), LossReason::layout_changed);
    const Instant begun = world->now;
    client.poll(1s);
    EXPECT_GE(world->now - begun, 500ms) << "the thread is not kept busy";
    EXPECT_EQ(world->writes.size(), writes);
  }
}

// The state of each group is a sample of its own, and may come before the state of the line.
TEST_F(ClientCore, AGroupWhoseStateDidNotComeYetIsNotReady) {
  begin();
  Group lamps = line.group("lamps");
  world->group(1, {.group = 1, .name = "drives"});
  client.poll(0ms);
  EXPECT_EQ(lamps.arm(), Error::not_ready);
  publish_for(3);
  EXPECT_EQ(lamps.arm(), Error::no_name);

  world->group(2, {.group = 2, .name = "lamps"});
  world->whole_line(2);
  client.poll(0ms);
  EXPECT_EQ(lamps.arm(), Error::none);
  EXPECT_EQ(world->writes.back().second.group, 2U);
}

// A reload gave the name to another number, and the gateway publishes the former one no more.
TEST_F(ClientCore, AGroupIsFoundByTheNumberThatItsNameHasNow) {
  world->group(1, {.group = 1, .name = "lamps"});
  begin();
  Group lamps = line.group("lamps");
  ASSERT_EQ(lamps.arm(), Error::none);
  EXPECT_EQ(world->writes.back().second.group, 1U);
  world->now += 1s;
  world->group(1, {.group = 2, .name = "lamps"});
  client.poll(0ms);
  EXPECT_EQ(lamps.reason(), LossReason::layout_changed);
  ASSERT_EQ(lamps.arm(), Error::none);
  EXPECT_EQ(world->writes.back().second.group, 2U);
  EXPECT_EQ(line.group("1").arm(), Error::none) << "may be published still";
  for (int i = 0; i < 4; ++i) {
    world->now += 1s;
    world->line(1);
    world->group(1, {.group = 2, .name = "lamps"});
    client.poll(0ms);
  }
  EXPECT_EQ(lamps.state(), GroupState::taking);
  EXPECT_EQ(line.group("1").arm(), Error::no_name);
}

TEST_F(ClientCore, AGroupThatDoesNotExistIsLost) {
  begin();
  Group group = line.group("99");
  EXPECT_EQ(group.arm(), Error::none) << "its state may not have come yet";
  publish_for(3);
  EXPECT_EQ(group.reason(), LossReason::no_group);
  EXPECT_EQ(group.text(), "lost: the line has no such group");
  EXPECT_EQ(group.arm(), Error::no_name);
}

TEST_F(ClientCore, SeveralValuesAreSetOrNoneOfThem) {
  begin();
  Group group = line.group("");
  EXPECT_EQ(group.set("ram.Out", 3), Error::none);
  std::size_t failed = 7;
  const std::vector<Setting> good{{"ram.Out", std::uint64_t{9}}};
  std::vector<Setting> bad = good;
  bad.push_back({"typo", std::uint64_t{1}});
  EXPECT_EQ(group.set(bad, &failed), Error::no_name);
  EXPECT_EQ(failed, 1U);
  ASSERT_EQ(group.arm(), Error::none);
  EXPECT_EQ(world->writes.back().second.values[0].data[0], std::byte{3});
  EXPECT_EQ(group.set(good, &failed), Error::none);
  client.poll(0ms);
  EXPECT_EQ(world->writes.back().second.values[0].data[0], std::byte{9});
}

TEST_F(ClientCore, AClientThatHoldsTheGroupIsNamed) {
  begin();
  Group group = line.group("");
  ASSERT_EQ(group.arm(), Error::none);
  EXPECT_EQ(group.text(), "written, not applied yet");
  applied(7, "other");
  EXPECT_EQ(group.text(), "written, not applied yet; its last values are of other");
  applied(7, "app");
  EXPECT_EQ(group.text(), "written, not applied yet") << "of an earlier arming of this client";
}

TEST_F(ClientCore, AfterASilenceTheStatesOfGroupsMayComeLater) {
  world->group(1, {.group = 1, .name = "lamps"});
  begin();
  world->now += 4s;
  world->line(1);
  client.poll(0ms);
  ASSERT_TRUE(line.ready());
  EXPECT_EQ(line.group("lamps").arm(), Error::not_ready);
  world->group(1, {.group = 1, .name = "lamps"});
  client.poll(0ms);
  EXPECT_EQ(line.group("lamps").arm(), Error::none);
}

TEST_F(ClientCore, ALossDiscardsTheValues) {
  begin();
  Group group = line.group("");
  EXPECT_EQ(group.set("ram.Out", 3), Error::none);
  ASSERT_EQ(group.arm(), Error::none);
  world->whole_line(2);
  client.poll(0ms);
  EXPECT_EQ(group.reason(), LossReason::restarted);
  ASSERT_EQ(group.arm(), Error::none);
  EXPECT_EQ(world->writes.back().first.incarnation, 2U);
  EXPECT_TRUE(world->writes.back().second.values.empty());
}

// A reload that gives the name of an output to another one, at the same places.
TEST_F(ClientCore, OtherNamesAreALoss) {
  begin();
  Group group = line.group("");
  EXPECT_EQ(group.set("ram.Out", 3), Error::none);
  ASSERT_EQ(group.arm(), Error::none);
  const std::size_t writes = world->writes.size();
  world->layout(outputs, 1, 7, "ram.Valve");
  client.poll(0ms);
  EXPECT_EQ(group.reason(), LossReason::layout_changed);
  client.poll(1s);
  EXPECT_EQ(world->writes.size(), writes);
  EXPECT_EQ(group.set("ram.Out", 3), Error::no_name);
  EXPECT_EQ(group.set("ram.Valve", 4), Error::none);
  ASSERT_EQ(group.arm(), Error::none);
  EXPECT_EQ(world->writes.back().second.values.size(), 1U);
}

TEST_F(ClientCore, AGatewayIsLostAndReturns) {
  begin();
  Group group = line.group("");
  ASSERT_EQ(group.arm(), Error::none);
  world->gone();
  client.poll(0ms);
  EXPECT_EQ(line.status(), LineStatus::lost);
  EXPECT_EQ(line.read("ram.In").quality, Quality::gateway_lost);
  EXPECT_EQ(group.reason(), LossReason::gateway_lost);
  EXPECT_EQ(group.arm(), Error::not_ready);
  world->whole_line(1);
  client.poll(0ms);
  EXPECT_TRUE(line.ready());
  EXPECT_EQ(line.read("ram.In").as<int>(), 5);
  EXPECT_TRUE(group.lost());
  world->now += 4s;
  EXPECT_EQ(line.status(), LineStatus::silent);
}

// In a reload two nodes may exchange their names: the layout keeps its ID.
TEST_F(ClientCore, AnImageOfBeforeIsNotReadThroughTheNamesOfAfter) {
  begin();
  world->now += 5s;
  world->line(1);
  world->layout(inputs, 1, 7, "ram.Other");
  for (int i = 0; i < 3; ++i) {
    client.poll(0ms);
    EXPECT_EQ(line.status(), LineStatus::waiting) << i;
    EXPECT_EQ(line.read("ram.Other").quality, Quality::no_data) << i;
    EXPECT_EQ(line.read("ram.Other").data.index(), 0U) << i;
    world->now += 500ms;
  }
  world->image(inputs, 1, 9);
  client.poll(0ms);
  EXPECT_EQ(line.read("ram.Other").as<int>(), 9);
  EXPECT_TRUE(line.ready());
}

TEST_F(ClientCore, ALineOfTwoGatewaysIsReportedAsAmbiguous) {
  std::vector<Quality> reported;
  const Subscription values = line.on_change(
      {"ram.In"}, [&](const Snapshot& now) { reported.push_back(now.values[0].quality); });
  client.poll(0ms);
  for (const char* gateway : {"gw", "other"})
    world->samples.emplace_back([gateway](dds::ClientListener& to) {
      to.on_line({.gateway = gateway, .line = "press", .incarnation = 1}, {}, {}, {});
    });
  client.poll(0ms);
  EXPECT_EQ(reported, (std::vector{Quality::no_line, Quality::ambiguous}));
}

TEST_F(ClientCore, ANodeThatItsGatewayRemovedIsNotMissing) {
  begin();
  world->samples.emplace_back([](dds::ClientListener& to) {
    image::Snapshot image{.layout_id = 7, .sequence = 9};
    image.bytes = {std::byte{0}};
    image.changed = image.valid = image.known = {0};
    const dds::Source source{.gateway = "gw", .line = "press", .incarnation = 1};
    to.on_image(source, image);
    to.on_node(source, {}, {.node = 1, .presence = line::Presence::missing}, {});
  });
  client.poll(0ms);
  EXPECT_EQ(line.read("ram.In").quality, Quality::node_missing);
  world->samples.emplace_back([](dds::ClientListener& to) {
    to.on_node_gone("gw", "press", 1);
    to.on_node_gone("gw", "never received", 1);
  });
  client.poll(0ms);
  EXPECT_EQ(line.read("ram.In").quality, Quality::not_received);
}

TEST_F(ClientCore, ACallWithoutItsLineTimesOut) {
  Call call = line.sdo_read(1, 0x1000, 0, {.timeout = 2s});
  EXPECT_FALSE(call.wait());
  EXPECT_EQ(call.outcome(), Outcome::refused);
  EXPECT_EQ(call.code(), static_cast<std::uint32_t>(line::Refusal::timed_out));
  EXPECT_EQ(world->sent, 0U);
}

TEST_F(ClientCore, ACallIsAnsweredTriedAgainOrCancelled) {
  begin();
  Call call = line.sdo_read(1, 0x1000, 0, {.attempts = 2});
  ASSERT_EQ(world->sent, 1U);
  world->reply(1, line::to_error(line::Refusal::busy));
  client.poll(0ms);
  EXPECT_FALSE(call.done());
  ASSERT_EQ(world->sent, 2U);
  int called = 0;
  call.on_done([&](const Call& done) { called += done.ok() ? 1 : 100; });
  world->reply(2, {}, {std::byte{0x34}, std::byte{0x12}});
  EXPECT_TRUE(call.wait());
  EXPECT_EQ(call.number(), 0x1234U);
  EXPECT_EQ(called, 1);

  Call other = line.nmt(1, 1);
  other.cancel();
  EXPECT_EQ(other.code(), static_cast<std::uint32_t>(line::Refusal::cancelled));
  EXPECT_EQ(world->cancelled, std::vector<std::uint64_t>{3});
}

// SDO abort 0504 0000h: the device may have received all of the value (idl/README.md).
TEST_F(ClientCore, OnlyACallThatReadsIsTriedAgainAfterAnSdoTimeOut) {
  begin();
  const linegate::Error timed_out{Domain::sdo, 0x0504'0000};
  std::uint64_t sent = 0;
  const auto tries = [&](const Request& request) {
    Call call = line.request(request, {.attempts = 3});
    const std::uint64_t before = sent;
    while (!call.done()) {
      sent = world->sent;
      world->reply(sent, timed_out);
      client.poll(0ms);
    }
    EXPECT_EQ(call.outcome(), Outcome::sdo_abort);
    EXPECT_EQ(call.code(), 0x0504'0000U);
    return sent - before;
  };
  using Kind = line::CommandKind;
  const auto number = [](Kind kind) { return static_cast<std::uint8_t>(kind); };
  const std::vector<std::byte> data(1);
  EXPECT_EQ(tries({.kind = number(Kind::sdo_read), .node = 1}), 3U);
  EXPECT_EQ(tries({.kind = number(Kind::network_read), .node = 1, .code = 2}), 3U);
  EXPECT_EQ(tries({.kind = number(Kind::local_read)}), 3U);
  EXPECT_EQ(tries({.kind = number(Kind::scan)}), 3U);
  EXPECT_EQ(tries({.kind = number(Kind::sdo_write), .node = 1, .data = data}), 1U);
  EXPECT_EQ(tries({.kind = number(Kind::network_write), .node = 1, .code = 2, .data = data}), 1U);
  EXPECT_EQ(tries({.kind = number(Kind::object_write), .node = 1, .data = data}), 1U);
  EXPECT_EQ(tries({.kind = number(Kind::program), .node = 1, .sub = 1, .data = data}), 1U);

  Call write = line.sdo_write(1, 0x1017, 0, std::uint16_t{1}, {.attempts = 2});
  world->reply(++sent, line::to_error(line::Refusal::busy));  // it was not begun
  client.poll(0ms);
  EXPECT_FALSE(write.done());
  EXPECT_EQ(world->sent, sent + 1);
}

TEST_F(ClientCore, ACallThatCannotBeSentSaysWhy) {
  begin();
  EXPECT_FALSE(line.nmt(1, 1, {.timeout = 0s}).wait());
  EXPECT_EQ(line.nmt(1, 1, {.timeout = 0s}).text(), "");
  Call late = line.nmt(1, 1, {.timeout = 0s});
  client.poll(0ms);
  EXPECT_EQ(late.text(), "the time-out left no time to send it");
  world->gone();
  client.poll(0ms);
  Call lost = line.nmt(1, 1, {.timeout = 1s});
  EXPECT_FALSE(lost.wait());
  EXPECT_EQ(lost.text(), "line press is lost: its gateway has ended or removed it");
}

// As with the next attempt of an application that does not give up.
TEST_F(ClientCore, ACallBackThatCausesTheNextOneDoesNotKeepAPoll) {
  begin();
  int called = 0;
  const std::function<void(const Call&)> again = [&](const Call&) {
    ++called;
    line.request({.kind = 255}).on_done(again);
  };
  line.request({.kind = 255}).on_done(again);
  client.poll(0ms);
  client.poll(0ms);
  EXPECT_EQ(called, 2);
}

TEST_F(ClientCore, ACallWithoutAHandleCallsBack) {
  begin();
  std::uint64_t answer = 0;
  line.sdo_read(1, 0x1000, 0).on_done([&](const Call& done) { answer = done.number(); });
  world->reply(1, {}, {std::byte{0x34}, std::byte{0x12}});
  client.poll(0ms);
  EXPECT_EQ(answer, 0x1234U);
}

TEST_F(ClientCore, ASubscriptionThatItsCallBackEndsIsNotCalledAgain) {
  int lines_called = 0;
  int events_called = 0;
  Subscription lines = client.on_line([&](const Change&) {
    ++lines_called;
    lines = {};
    world->gone();
    client.poll(0ms);  // the call-back still runs
  });
  EventReader events = client.follow_events("3:0:gw/press", [&](const Event&) {
    ++events_called;
    events = {};
    client.poll(0ms);
  });
  for (const std::uint64_t number : {1U, 2U})
    world->samples.emplace_back([number](dds::ClientListener& to) {
      dds::ReceivedEvent event;
      event.stream = 3;
      event.number = number;
      to.on_event({.gateway = "gw", .line = "press"}, event, "", {});
    });
  world->whole_line(1);
  client.poll(0ms);
  EXPECT_EQ(lines_called, 1);
  EXPECT_EQ(events_called, 1);
}

TEST_F(ClientCore, AReportOfProgressBelongsToTheFirstCallOfItsKind) {
  begin();
  const auto kind = static_cast<std::uint8_t>(line::CommandKind::configure);
  const Call first = line.request({.kind = kind, .node = 1});
  const Call second = line.request({.kind = kind, .node = 1});
  world->progress(1, {.command = line::CommandKind::configure, .done = 3, .total = 9});
  client.poll(0ms);
  EXPECT_EQ(first.progress(), std::pair(3U, 9U));
  EXPECT_EQ(second.progress(), std::pair(0U, 0U));
}

}  // namespace
}  // namespace linegate::client

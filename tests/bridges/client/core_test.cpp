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
  void applied(std::uint64_t arming, const std::string& owner, bool tripped = false) {
    line::OutputState state;
    state.owner = owner;
    state.arming = arming;
    state.tripped = tripped;
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

// The state of each group is a sample of its own, and may come before the state of the line.
TEST_F(ClientCore, AGroupWhoseStateDidNotComeYetIsNotReady) {
  begin();
  Group lamps = line.group("lamps");
  world->group(1, {.group = 1, .name = "drives"});
  client.poll(0ms);
  EXPECT_EQ(lamps.arm(), Error::not_ready);
  world->now += 3s;
  world->line(1);
  client.poll(0ms);
  EXPECT_EQ(lamps.arm(), Error::no_name);

  world->group(2, {.group = 2, .name = "lamps"});
  world->whole_line(2);
  client.poll(0ms);
  EXPECT_EQ(lamps.arm(), Error::none);
  EXPECT_EQ(world->writes.back().second.group, 2U);
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

TEST_F(ClientCore, ACallWithoutAHandleCallsBack) {
  begin();
  std::uint64_t answer = 0;
  line.sdo_read(1, 0x1000, 0).on_done([&](const Call& done) { answer = done.number(); });
  world->reply(1, {}, {std::byte{0x34}, std::byte{0x12}});
  client.poll(0ms);
  EXPECT_EQ(answer, 0x1234U);
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

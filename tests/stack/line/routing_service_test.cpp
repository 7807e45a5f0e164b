// SPDX-License-Identifier: Apache-2.0
#include "stack/line/routing_service.h"

#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "tests/stack/line/service_fixture.h"

namespace linegate::line {
namespace {

constexpr std::uint16_t kOtherNetwork = 99;
constexpr std::uint8_t kOtherInterface = 99;
constexpr std::uint8_t kRoutedNode = 5;

LineConfig routing_config() {
  LineConfig config = config_with_axis();
  config.routing.interface = static_cast<std::uint8_t>(config.network_id);
  config.routing.interfaces = {
      {config.routing.interface, config.network_id, config.node_id, config.name},
      {kOtherInterface, kOtherNetwork, 1, "hall"}};
  config.routing.routes = {{config.network_id, config.network_id, config.routing.interface, 0, 0},
                           {kOtherNetwork, kOtherNetwork, kOtherInterface, 0, 0}};
  config.routing.access = {
      {.first = kOtherNetwork, .last = kOtherNetwork, .sdo_read = true, .sdo_write = true}};
  return config;
}

// A line with routing, without a bus; its messages to other lines are kept.
struct RoutingServiceTest : testing::Test, sdo::TransferOwner {
  explicit RoutingServiceTest(LineConfig config = routing_config()) : parts(std::move(config)) {}

  void completed(sdo::Completion& completion, Instant /*now*/) override {
    completions.push_back(std::move(completion));
  }

  std::uint64_t trace(std::uint16_t length) {
    service.execute(
        {.tag = ++tag, .request = RoutingTrace{.duration = std::chrono::seconds(length)}},
        parts.now);
    return tag;
  }
  void read(std::uint16_t network, std::uint64_t number) {
    service.start({.owner = this,
                   .number = number,
                   .network = network,
                   .node = kRoutedNode,
                   .address = {0x1000, 0},
                   .timeout = seconds(1)},
                  parts.now);
  }
  std::vector<routing::Message> sent() {
    std::vector<routing::Message> out;
    for (routing::Message message; messages.pop(message);) {
      out.push_back(message);
    }
    return out;
  }

  NodeParts parts;
  RecordingHost host;
  sdo::Arbiter arbiter{parts.node->dispatch(), parts.node->transmit(), parts.events};
  routing::MessageQueue messages{16};
  routing::Counters counters;
  EveryWrite rule;
  ManagerParts managed{false};
  NoFlyingMaster flying{host, parts, managed.manager};
  RoutingService service{host,     parts.config, *parts.node, arbiter,       parts.events,
                         messages, counters,     rule,        flying.service};
  std::vector<sdo::Completion> completions;
  std::uint64_t tag = 0;
};

struct NoRoutingServiceTest : RoutingServiceTest {
  NoRoutingServiceTest() : RoutingServiceTest(config_with_axis()) {}
};

TEST_F(NoRoutingServiceTest, ALineWithoutAnInterfaceTakesNoPart) {
  EXPECT_FALSE(service.takes_part());
  EXPECT_EQ(host.answer(trace(5)), to_error(Refusal::wrong_role));
  service.advance(parts.now);
  service.end(Refusal::cancelled, parts.now);
  EXPECT_EQ(service.next_wake(), kNever);
  std::vector<routing::Route> routes;
  service.routes(routes);
  EXPECT_TRUE(routes.empty());
}

TEST_F(RoutingServiceTest, ATraceHasALimit) {
  EXPECT_EQ(host.answer(trace(0)), to_error(Refusal::bad_request));
  EXPECT_EQ(host.answer(trace(routing::Trace::kLongest + 1)), to_error(Refusal::bad_request));
  EXPECT_EQ(host.answer(trace(routing::Trace::kLongest)), Error{});
}

TEST_F(RoutingServiceTest, ATransferWithoutARouteEndsAtOnce) {
  read(7, 1);
  ASSERT_EQ(completions.size(), 1U);
  EXPECT_EQ(completions[0].number, 1U);
  EXPECT_EQ(completions[0].abort, AbortCode::invalid_value);
  EXPECT_TRUE(sent().empty());
}

TEST_F(RoutingServiceTest, TheOwnerGetsWhatAnotherLineRefused) {
  read(kOtherNetwork, 2);
  const std::vector<routing::Message> asked = sent();
  ASSERT_EQ(asked.size(), 1U);
  EXPECT_EQ(asked[0].to, kOtherInterface);
  EXPECT_TRUE(completions.empty());
  service.deliver(routing::refusal(asked[0], AbortCode::local_control), parts.now);
  ASSERT_EQ(completions.size(), 1U);
  EXPECT_EQ(completions[0].number, 2U);
  EXPECT_EQ(completions[0].abort, AbortCode::local_control);
}

TEST_F(RoutingServiceTest, ACancelledTransferHasNoCompletion) {
  read(kOtherNetwork, 3);
  service.cancel(*this, 4, parts.now);
  ASSERT_EQ(sent().size(), 1U);
  service.cancel(*this, 3, parts.now);
  EXPECT_EQ(sent().at(0).kind, routing::MessageKind::sdo_close);
  service.end(Refusal::cancelled, parts.now);
  EXPECT_TRUE(completions.empty());
}

TEST_F(RoutingServiceTest, EndCompletesTheTransfersOfOtherNetworks) {
  read(kOtherNetwork, 5);
  service.end(Refusal::cancelled, parts.now);
  ASSERT_EQ(completions.size(), 1U);
  EXPECT_EQ(completions[0].number, 5U);
  EXPECT_NE(completions[0].abort, AbortCode::none);
}

TEST_F(RoutingServiceTest, WithoutABusRequestsOfOthersAreRefused) {
  const routing::Message open{.from = kOtherInterface,
                              .to = parts.config.routing.interface,
                              .connection = 1,
                              .network = parts.config.network_id,
                              .source = kOtherNetwork,
                              .node = kRoutedNode};
  host.set_usable(false);
  service.deliver(open, parts.now);
  const std::vector<routing::Message> answers = sent();
  ASSERT_EQ(answers.size(), 1U);
  EXPECT_EQ(answers[0].kind, routing::MessageKind::sdo_refused);
  EXPECT_EQ(routing::abort_of(answers[0]), AbortCode::device_state);
  host.set_usable(true);
  service.deliver(open, parts.now);
  EXPECT_EQ(sent().at(0).kind, routing::MessageKind::sdo_opened);
}

}  // namespace
}  // namespace linegate::line

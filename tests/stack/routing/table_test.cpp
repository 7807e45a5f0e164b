// SPDX-License-Identifier: Apache-2.0
#include "stack/routing/table.h"

#include <array>
#include <cstdint>
#include <iterator>
#include <memory>
#include <vector>

#include <gtest/gtest.h>

#include "stack/line/line.h"
#include "stack/routing/message.h"

namespace linegate::routing {
namespace {

const std::vector<Interface> kInterfaces = {{.number = 1, .network = 10, .node = 127},
                                            {.number = 2, .network = 20, .node = 126}};

TEST(RoutingTable, EntriesAreCodedAsDefinitionBSays) {  // network-IDs are 1 to 127, or to 65535
  const Route route{.first = 3, .last = 7, .interface = 2, .gateway = 126, .cost = 10};
  EXPECT_EQ(encode(route), 0x000A'7E02'0007'0003U);
  EXPECT_EQ(decode(0x000A'7E02'0007'0003U), route);
  EXPECT_EQ(
      decode(0xFFFF'FFFF'FFFF'FFFFU),
      (Route{.first = 0xFFFF, .last = 0xFFFF, .interface = 0xFF, .gateway = 0xFF, .cost = 0xFFFF}));
  EXPECT_FALSE(decode(0xFFFF'FF00'FFFF'FFFFU).used());
}

struct FaultRow {
  RouteFault fault;
  Route route;
  AbortCode abort;
};

class RouteFaults : public testing::TestWithParam<FaultRow> {};

TEST_P(RouteFaults, AreNamed) {  // there may be 127 networks
  EXPECT_EQ(check(GetParam().route, kInterfaces), GetParam().fault);
  EXPECT_EQ(abort_of(GetParam().fault), GetParam().abort);
  EXPECT_NE(describe(GetParam().fault), "unknown");
}

constexpr FaultRow kFaults[] = {
    {RouteFault::none, {.first = 20, .last = 20, .interface = 2}, AbortCode::none},
    {RouteFault::none, {.first = 1, .last = 65535, .interface = 2, .gateway = 5}, AbortCode::none},
    // An unused entry
    {RouteFault::none, {.first = 5, .last = 1, .interface = 0}, AbortCode::none},
    {RouteFault::bad_range, {.first = 0, .last = 1, .interface = 2}, AbortCode::invalid_value},
    {RouteFault::bad_range, {.first = 5, .last = 4, .interface = 2}, AbortCode::invalid_value},
    {RouteFault::unknown_interface,
     {.first = 20, .last = 20, .interface = 3},
     AbortCode::invalid_value},
    {RouteFault::bad_gateway,
     {.first = 30, .last = 30, .interface = 2, .gateway = 128},
     AbortCode::invalid_value},
    {RouteFault::not_attached, {.first = 20, .last = 21, .interface = 2}, AbortCode::invalid_value},
    {RouteFault::loop,
     // The node-ID of the own node on that interface
     {.first = 30, .last = 30, .interface = 2, .gateway = 126},
     AbortCode::invalid_value},
    {RouteFault::loop,
     // The network of that interface itself
     {.first = 20, .last = 20, .interface = 2, .gateway = 5},
     AbortCode::invalid_value},
};
INSTANTIATE_TEST_SUITE_P(Table, RouteFaults, testing::ValuesIn(kFaults));

TEST(RoutingTable, AWayOverAnotherGatewayHasNoNodeAndLeadsToNoOwnNetwork) {
  std::vector<Interface> interfaces(std::begin(kInterfaces), std::end(kInterfaces));
  const std::uint16_t own = interfaces.front().network;
  interfaces.push_back(
      {.number = 255,
       .name = "hall-b/press",
       .way = std::make_shared<const GatewayWay>(GatewayWay{.to = {"hall-b", "press"}})});
  const auto fault = [&](std::uint16_t first, std::uint16_t last, std::uint8_t node = 0) {
    return check(Route{.first = first, .last = last, .interface = 255, .gateway = node},
                 interfaces);
  };
  EXPECT_EQ(fault(70, 70), RouteFault::none);
  EXPECT_EQ(fault(70, 79), RouteFault::none);
  EXPECT_EQ(fault(70, 70, 5), RouteFault::bad_gateway);
  EXPECT_EQ(fault(own, own), RouteFault::loop);
  EXPECT_EQ(fault(1, 100), RouteFault::loop);
  EXPECT_EQ(find_way(interfaces, 255)->to.gateway, "hall-b");
  EXPECT_EQ(find_way(interfaces, interfaces.front().number), nullptr);
  EXPECT_EQ(find_way(interfaces, 254), nullptr);
}

TEST(RoutingTable, OverlappingRangesOfEqualCostAreAFault) {
  const std::vector<Route> routes = {
      {.first = 30, .last = 40, .interface = 1, .gateway = 5, .cost = 7},
      {.first = 40, .last = 50, .interface = 2, .gateway = 6, .cost = 8},
      {.first = 40, .last = 50, .interface = 2, .gateway = 7, .cost = 7}};
  const auto found = check(routes, kInterfaces);
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0].fault, RouteFault::overlap);
  EXPECT_EQ(found[0].entry, 2U);
  EXPECT_EQ(found[0].other, 0U);
  EXPECT_EQ(abort_of(RouteFault::overlap), AbortCode::parameter_incompatible);
}

TEST(RoutingTable, TheLowestCostWinsThenTheLowestSubIndex) {
  const std::vector<Route> routes = {
      {.first = 30, .last = 40, .interface = 1, .gateway = 5, .cost = 9},
      {},
      {.first = 35, .last = 35, .interface = 2, .gateway = 6, .cost = 2},
      {.first = 35, .last = 50, .interface = 2, .gateway = 7, .cost = 9}};
  const Table table(routes);
  EXPECT_EQ(table.find(35, 0)->gateway, 6);
  EXPECT_EQ(table.find(35, 0, 1)->gateway, 5);
  EXPECT_EQ(table.find(35, 0, 2)->gateway, 7);
  EXPECT_EQ(table.find(35, 0, 3), nullptr);
  EXPECT_EQ(table.find(51, 0), nullptr);
}

TEST(RoutingTable, TheNextHopIsNeverTheLineItCameFrom) {
  const std::vector<Route> routes = {
      {.first = 35, .last = 35, .interface = 1, .gateway = 5, .cost = 1},
      {.first = 35, .last = 35, .interface = 2, .gateway = 6, .cost = 2}};
  const Table table(routes);
  EXPECT_EQ(table.find(35, 1)->gateway, 6);
  EXPECT_EQ(table.find(35, 1, 1), nullptr);
}

TEST(RoutingMessages, KeepTheirOrderAndAFullQueueTakesNoMore) {
  MessageQueue queue(2);
  Message out;
  EXPECT_FALSE(queue.pop(out));
  for (const std::uint32_t connection : {1U, 2U, 3U}) {
    EXPECT_EQ(queue.push({.connection = connection}), connection < 3);
  }
  ASSERT_TRUE(queue.pop(out));
  EXPECT_EQ(out.connection, 1U);
  EXPECT_TRUE(queue.push({.connection = 4}));
  ASSERT_TRUE(queue.pop(out));
  ASSERT_TRUE(queue.pop(out));
  EXPECT_EQ(out.connection, 4U);
  EXPECT_TRUE(queue.empty());
}

TEST(RoutingMessages, WhatCannotBeDeliveredIsRefusedToItsSender) {
  const auto back = undeliverable(
      {.from = 1, .to = 2, .kind = MessageKind::sdo_open, .connection = 77, .network = 20});
  ASSERT_TRUE(back);
  EXPECT_EQ(back->from, 2);
  EXPECT_EQ(back->to, 1);
  EXPECT_EQ(back->kind, MessageKind::sdo_refused);
  EXPECT_EQ(back->connection, 77U);
  EXPECT_EQ(abort_of(*back), AbortCode::device_state);
  EXPECT_FALSE(undeliverable({.kind = MessageKind::sdo_refused}));
}

// --- configuration of a line --------------------------------------------------------------------

line::LineConfig routed_line() {
  line::LineConfig config;
  config.name = "press";
  config.network_id = 10;
  config.routing.interface = 1;
  config.routing.interfaces = kInterfaces;
  config.routing.routes = {{.first = 20, .last = 20, .interface = 2}};
  return config;
}

std::vector<std::string> errors_of(line::LineConfig config) {
  std::vector<std::string> out;
  for (const Diagnostic& found : line::Line::make(std::move(config)).diagnostics) {
    out.push_back(to_string(found));
  }
  return out;
}

TEST(RoutingConfig, OfALineIsCheckedAndErrorsNameTheEntry) {
  EXPECT_TRUE(errors_of(routed_line()).empty());
  line::LineConfig config = routed_line();
  config.routing.routes.push_back({.first = 30, .last = 30, .interface = 2, .gateway = 126});
  config.routing.routes.push_back({.first = 19, .last = 21, .interface = 2, .gateway = 4});
  const std::vector<std::string> expected = {
      "press: error: routing table, entry 2: a loop: the way leads back over the own node or the "
      "network itself",
      "press: error: routing table, entry 3: another route of equal cost leads to the same network "
      "(entry 1)"};
  EXPECT_EQ(errors_of(config), expected);
}

TEST(RoutingConfig, AnInterfaceThatIsNotItselfAmongTheLinesIsAnError) {
  line::LineConfig config = routed_line();
  config.routing.interface = 3;
  EXPECT_EQ(errors_of(config).size(), 1U);
  config.routing.interface = 2;  // the interface of another line
  EXPECT_EQ(errors_of(config).size(), 1U);
  config.routing = {};
  // A line that does not route
  config.routing.routes = {{.first = 20, .last = 20, .interface = 2}};
  EXPECT_EQ(errors_of(config).size(), 1U);
}

TEST(RoutingConfig, AnAccessRuleOfNoNetworkIsAnError) {
  line::LineConfig config = routed_line();
  config.routing.access = {{.first = 5, .last = 4, .sdo_read = true}};
  EXPECT_EQ(errors_of(config).size(), 1U);
}

TEST(RoutingOfALine, ARoleThatCannotRefusesAndCounts) {
  line::LineConfig config;
  config.name = "hall";
  config.role = line::Role::observer;
  auto line = *std::move(line::Line::make(config).value);
  line->deliver({.from = 1, .to = 2, .kind = MessageKind::sdo_open, .connection = 5}, Instant{});
  Message out;
  ASSERT_TRUE(line->pop_message(out));
  EXPECT_EQ(out.from, 2);  // the interface that was addressed: the line has no interface number
  EXPECT_EQ(out.to, 1);
  EXPECT_EQ(out.kind, MessageKind::sdo_refused);
  EXPECT_EQ(abort_of(out), AbortCode::device_state);
  EXPECT_FALSE(line->pop_message(out));
  EXPECT_EQ(line->state().routing.unexpected, 1U);
}

}  // namespace
}  // namespace linegate::routing

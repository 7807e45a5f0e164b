// SPDX-License-Identifier: Apache-2.0
// Networks, routes, and the requests that may enter, in plant.yaml.
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "gateway/config/plant.h"
#include "stack/routing/config.h"

namespace linegate::config {
namespace {

using namespace std::chrono_literals;

const std::string kTwoLines = R"(  - name: press
    interface: virtual:press
    node_id: 100
    enter: [{from: [hall, 10..19], services: [sdo, emcy], access: all}, 7]
  - {name: hall, interface: virtual:hall, enter: {from: all, services: pdo}}
)";

Loaded<Plant> read_routes(const std::string& top, const std::string& lines = kTwoLines) {
  return read("schema: 1\n" + top + "lines:\n" + lines, "plant.yaml");
}

std::vector<std::string> told(const Loaded<Plant>& loaded) {
  std::vector<std::string> out;
  for (const Diagnostic& diagnostic : loaded.diagnostics) {
    out.push_back(to_string(diagnostic));
  }
  return out;
}

TEST(Routes, AreTheSameOfEveryLineAndStartWithTheLinesThemselves) {
  const auto loaded = read_routes(
      "routes:\n"
      "  - {to: 10..19, via: hall:5}\n"
      "  - {to: 1, via: hall:6, cost: 0x20}\n");
  ASSERT_TRUE(loaded.ok()) << told(loaded).front();
  const std::vector<routing::Route> expected{
      {1, 1, 1, 0, 0}, {2, 2, 2, 0, 0}, {10, 19, 2, 5, 10}, {1, 1, 2, 6, 32}};
  for (std::size_t i = 0; i < 2; ++i) {
    const routing::Config& config = loaded.value->lines[i].config.routing;
    EXPECT_EQ(config.interface, i + 1);
    EXPECT_EQ(config.routes, expected);
    ASSERT_EQ(config.interfaces.size(), 2U);
    EXPECT_EQ(config.interfaces[0].node, 100);
    EXPECT_EQ(config.interfaces[1].network, 2);
  }
}

TEST(Routes, NobodyEntersUnlessItIsSaid) {
  const auto loaded = read_routes("");
  ASSERT_TRUE(loaded.ok()) << told(loaded).front();
  const auto& press = loaded.value->lines[0].config.routing.access;
  ASSERT_EQ(press.size(), 3U);
  EXPECT_EQ(press[0].first, 2) << "the network-ID of hall";
  EXPECT_EQ(press[0].last, 2);
  EXPECT_TRUE(press[0].sdo_read && press[0].sdo_write && press[0].emcy && !press[0].pdo);
  EXPECT_EQ(press[1].first, 10);
  EXPECT_EQ(press[1].last, 19);
  EXPECT_EQ(press[2].first, 7);
  EXPECT_TRUE(press[2].sdo_read && !press[2].sdo_write && !press[2].emcy && !press[2].pdo);
  const auto& hall = loaded.value->lines[1].config.routing.access;
  ASSERT_EQ(hall.size(), 1U);
  EXPECT_EQ(hall[0].first, 1);
  EXPECT_EQ(hall[0].last, 65535);
  EXPECT_TRUE(!hall[0].sdo_read && hall[0].pdo);

  const auto closed = read_routes("routes: [{to: 9, via: hall:5}]\n",
                                  "  - {name: hall, interface: virtual:hall}\n");
  ASSERT_TRUE(closed.ok());
  EXPECT_EQ(closed.value->lines[0].config.routing.interface, 1);
  EXPECT_TRUE(closed.value->lines[0].config.routing.access.empty());
  const auto none = read_routes("", "  - {name: hall, interface: virtual:hall}\n");
  EXPECT_EQ(none.value->lines[0].config.routing.interface, 0) << "nothing is routed";
}

TEST(Routes, EmcysGoOnToTheNetworksThatAreNamed) {
  const std::string lines =
      R"(  - {name: press, interface: virtual:press, emcy_to: [hall, 3..4], gateways: [9]}
  - {name: hall, interface: virtual:hall, emcy_to: all}
  - {name: pack, interface: virtual:pack}
)";
  const auto loaded = read_routes("routes: [{to: 4, via: hall:5}]\n", lines);
  ASSERT_TRUE(loaded.ok()) << told(loaded).front();
  const auto of_line = [&](std::size_t i) { return loaded.value->lines[i].config.routing; };
  EXPECT_EQ(of_line(0).emcy_networks[1], 0b1110U);
  EXPECT_EQ(of_line(0).emcy_networks[127], 0b1110U);
  EXPECT_EQ(of_line(0).gateways, std::vector<std::uint8_t>{9});
  EXPECT_EQ(of_line(1).emcy_networks[1], 0b1101U) << "all networks except its own";
  EXPECT_EQ(of_line(2).emcy_networks[1], 0U);

  EXPECT_EQ(
      told(read_routes("", R"(  - {name: press, interface: virtual:press, emcy_to: [33, 7, halle]}
  - {name: hall, interface: virtual:hall, gateways: [0]}
  - {name: seen, interface: virtual:seen, role: observer, emcy_to: hall}
)")),
      (std::vector<std::string>{
          "plant.yaml:3:55: error: EMCYs are forwarded to the networks 1..32 (object 1F2Fh)",
          "plant.yaml:3:59: error: no route leads to network 7",
          "plant.yaml:3:62: error: there is no line \"halle\"; did you mean \"hall\"?",
          "plant.yaml:4:54: error: expected a node-ID 1..127",
          "plant.yaml:5:68: error: only a manager's line forwards EMCYs to other networks"}));
}

TEST(Routes, TimesAndDefinitionsCount) {
  const auto loaded = read_routes(
      "routing: {network_indication: own, routing_table: own, forwarded_emcy: own, channels: "
      "per_node, arm_timeout: 1s, "
      "hop_limit: 3, frame_timeout: 2s, gateway_timeout: 3s, channel_wait: 4s, additional_servers: "
      "2}\n");
  ASSERT_TRUE(loaded.ok()) << told(loaded).front();
  const routing::Config& config = loaded.value->lines[1].config.routing;
  EXPECT_EQ(config.channels, routing::ChannelRule::per_node);
  EXPECT_EQ(config.hop_limit, 3);
  EXPECT_EQ(config.arm_timeout, 1s);
  EXPECT_EQ(config.frame_timeout, 2s);
  EXPECT_EQ(config.gateway_timeout, 3s);
  EXPECT_EQ(config.channel_wait, 4s);
  EXPECT_EQ(config.additional_servers, 2);
}

TEST(Routes, WhatIsWrongIsToldWithItsPlace) {
  EXPECT_EQ(told(read_routes("routes:\n"
                             "  - {to: 10..9, via: hall:5}\n"
                             "  - {to: 10, via: hal:5}\n"
                             "  - {to: 11, via: hall:128}\n"
                             "  - {to: 12, via: hall}\n"
                             "  - {to: 2, via: hall:5}\n"
                             "  - {to: 14, via: press:100}\n"
                             "  - {to: 20..30, via: hall:5}\n"
                             "  - {to: 25, via: press:6}\n"
                             "  - {to: 25, via: press:6, cost: 0}\n"
                             "  - {via: press:6}\n")),
            (std::vector<std::string>{
                "plant.yaml:3:10: error: expected a network-ID 1..65535 or a range such as "
                "10..19, got \"10..9\"",
                "plant.yaml:4:19: error: there is no line \"hal\"; did you mean \"hall\"?",
                "plant.yaml:5:19: error: expected LINE:NODE with the node-ID 1..127 of the next "
                "gateway, got \"hall:128\"",
                "plant.yaml:6:19: error: network 12 is not that of line \"hall\": name the next "
                "gateway, hall:NODE",
                "plant.yaml:7:18: error: a loop: network 2 is that of line \"hall\"",
                "plant.yaml:8:19: error: a loop: node 100 is this gateway itself on line "
                "\"press\"",
                "plant.yaml:10:10: error: another route of cost 10 leads to the same network, that "
                "in line 9",
                "plant.yaml:11:34: error: expected a number from 1 to 65535, got \"0\"",
                "plant.yaml:12:5: error: a route needs the key \"to\""}));
}

TEST(Routes, RulesOfEnteringThatMakeNoSenseAreTold) {
  EXPECT_EQ(told(read_routes("", R"(  - name: press
    interface: virtual:press
    enter:
      - {from: hal}
      - {from: 0}
      - {from: [7..x, []], services: emcy, access: all}
      - {from: 3, services: [sdo, nmt]}
      - {services: sdo}
  - {name: hall, interface: virtual:hall, role: observer, enter: all}
)")),
            (std::vector<std::string>{
                "plant.yaml:6:16: error: there is no line \"hal\"; did you mean \"hall\"?",
                "plant.yaml:7:16: error: expected a network-ID 1..65535 or a range such as "
                "10..19, got \"0\"",
                "plant.yaml:8:17: error: there is no line \"7..x\"",
                "plant.yaml:8:23: error: expected a network-ID, a range such as 10..19, the name "
                "of a line, or all",
                "plant.yaml:8:52: error: access is about sdo, which is not among the services",
                "plant.yaml:9:35: error: expected sdo, emcy or pdo, got \"nmt\"",
                "plant.yaml:10:9: error: a rule of enter needs the key \"from\"",
                "plant.yaml:11:66: error: only a manager's line can be entered from other "
                "networks"}));
}

TEST(Routes, OverAnotherGatewayAreWaysOfTheirOwn) {
  const auto loaded = read_routes(
      "routes:\n"
      "  - {to: 7, via: hall-b/press, enter: pack, timeout: 4s}\n"
      "  - {to: 20..29, via: hall-b/press}\n"
      "  - {to: 8, via: hall-b/press, enter: pack, timeout: 4s, cost: 20}\n");
  ASSERT_TRUE(loaded.ok()) << told(loaded).front();
  const routing::Config& config = loaded.value->lines[1].config.routing;
  const std::vector<routing::Route> expected{{1, 1, 1, 0, 0},
                                             {2, 2, 2, 0, 0},
                                             {7, 7, 254, 0, 10},
                                             {20, 29, 255, 0, 10},
                                             {8, 8, 254, 0, 20}};
  EXPECT_EQ(config.routes, expected);
  ASSERT_EQ(config.interfaces.size(), 4U);
  const routing::Interface& client = config.interfaces[2];
  EXPECT_EQ(client.number, 255);
  EXPECT_EQ(client.name, "hall-b/press");
  EXPECT_EQ(*client.way, (routing::GatewayWay{.to = {"hall-b", "press"}}));
  EXPECT_EQ(client.way->addressed(), (routing::GatewayLine{"hall-b", "press"}));
  const routing::Interface& device = config.interfaces[3];
  EXPECT_EQ(device.number, 254);
  EXPECT_EQ(*device.way,
            (routing::GatewayWay{.to = {"hall-b", "press"}, .enter = "pack", .timeout = 4s}));
  EXPECT_EQ(device.way->addressed(), (routing::GatewayLine{"hall-b", "pack"}));
}

TEST(Routes, OverAnotherGatewayThatMakeNoSenseAreTold) {
  EXPECT_EQ(
      told(read_routes("gateway: {name: hall-a}\n"
                       "routes:\n"
                       "  - {to: 7, via: hall-a/press}\n"
                       "  - {to: 7, via: hall-b/press:5}\n"
                       "  - {to: 7, via: /press}\n"
                       "  - {to: 2, via: hall-b/press}\n"
                       "  - {to: 7, via: hall:5, enter: pack, timeout: 3s}\n"
                       "  - {to: 8, via: hall-b/press, timeout: 499ms}\n"
                       "  - {to: 9, via: hall-b/press, enter: p.q}\n"
                       "  - {to: 2..6, via: hall-b/press}\n")),
      (std::vector<std::string>{
          "plant.yaml:4:18: error: \"hall-a\" is this gateway: name its line alone, via: "
          "\"press\", or \"press:NODE\"",
          "plant.yaml:5:18: error: a name of a line has 1 to 64 letters, digits, '-' and '_', not "
          "\"press:5\"",
          "plant.yaml:6:18: error: a name of a gateway has 1 to 64 letters, digits, '-' and '_', "
          "not "
          "\"\"",
          "plant.yaml:7:10: error: network 2 is, or includes, that of a line of this gateway: the "
          "route would lead to another network of that number",
          "plant.yaml:8:33: error: enter is for a route over another gateway, via: GATEWAY/LINE",
          "plant.yaml:8:48: error: timeout is for a route over another gateway, via: GATEWAY/LINE",
          "plant.yaml:9:41: error: expected a time from 500ms to 600s, got \"499ms\"",
          "plant.yaml:10:39: error: a name of a line has 1 to 64 letters, digits, '-' and '_', not "
          "\"p.q\"",
          "plant.yaml:11:10: error: network 2..6 is, or includes, that of a line of this gateway: "
          "the route would lead to another network of that number"}));
}

TEST(Routes, OverAnotherGatewayNeedALineThatUsesThem) {
  const std::string routes = "routes: [{to: 7, via: hall-b/press}]\n";
  EXPECT_EQ(told(read_routes(routes, "  - {name: a, interface: virtual:a, role: observer}\n")),
            (std::vector<std::string>{"plant.yaml:2:23: error: no line of this gateway is a "
                                      "manager: nothing would use the route"}));
  EXPECT_TRUE(read_routes("dds: {process: own}\n" + routes).ok());
}

TEST(Routes, OverAnotherGatewayNeedAnIdentityOfTheirOwnInASecuredDomain) {
  const std::string routes = "routes: [{to: 7, via: hall-b/press}]\n";
  EXPECT_EQ(told(read_routes("dds: {security: /proc/self}\n" + routes)),
            (std::vector<std::string>{
                "plant.yaml:3:23: error: a route over another gateway needs an identity of role "
                "operator or engineer for its requests, because that of the gateway sends none: "
                "dds: {routes_security: FOLDER}"}));
  const auto loaded =
      read_routes("dds: {security: /proc/self, routes_security: /proc/self}\n" + routes);
  ASSERT_TRUE(loaded.ok()) << told(loaded).front();
  EXPECT_EQ(loaded.value->dds_routes_security, "/proc/self");
}

TEST(Routes, EmcysAreNotForwardedOverAnotherGateway) {
  const std::string lines =
      "  - {name: press, interface: virtual:press, emcy_to: 7}\n"
      "  - {name: hall, interface: virtual:hall, emcy_to: all}\n";
  const std::string routes = "routes: [{to: 7, via: hall-b/press}]\n";
  EXPECT_EQ(told(read_routes(routes, lines)),
            (std::vector<std::string>{"plant.yaml:4:54: error: network 7 is reached over another "
                                      "gateway, to which EMCYs are not forwarded"}));
  const auto all = read_routes(routes, lines.substr(lines.find('\n') + 1));
  ASSERT_TRUE(all.ok());
  EXPECT_EQ(all.value->lines[0].config.routing.emcy_networks[1], 0U);
}

TEST(Routes, EmcysOfAnotherGatewayGoToTheLinesThatAcceptThem) {
  const std::string routes =
      "routes:\n"
      "  - {to: 7..9, via: hall-b/press, enter: pack, emcy: true}\n"
      "  - {to: 12, via: hall-b/store, emcy: false}\n";
  const std::string lines =
      "  - {name: press, interface: virtual:press, enter: [{from: 8, services: [emcy]}, {from: 12, "
      "services: [emcy]}]}\n"
      "  - {name: hall, interface: virtual:hall, enter: [{from: 7..9, services: [sdo]}]}\n";
  const auto loaded = read_routes(routes, lines);
  ASSERT_TRUE(loaded.ok()) << told(loaded).front();
  const Plant& plant = *loaded.value;
  EXPECT_EQ(plant.lines[0].remote_emcys,
            (std::vector<RemoteEmcys>{{{"hall-b", "press"}, 7, 9, 255}}));
  EXPECT_TRUE(plant.lines[1].remote_emcys.empty());
  const auto without = read_routes(
      "routes:\n"
      "  - {to: 7..9, via: hall-b/press, enter: pack}\n"
      "  - {to: 12, via: hall-b/store}\n",
      lines);
  EXPECT_NE(without.value->lines[0].routes, plant.lines[0].routes) << "a reload";
  EXPECT_EQ(without.value->lines[0].source, plant.lines[0].source) << "of a running line";
  EXPECT_EQ(
      told(read_routes(routes + "  - {to: 20, via: hall-b/press, emcy: true}\n"
                                "  - {to: 21, via: 'hall:5', emcy: true}\n",
                       lines)),
      (std::vector<std::string>{
          "plant.yaml:5:5: error: no line accepts EMCYs of network 20: a line that shall send "
          "them needs enter: [{from: 20, services: [emcy]}]",
          "plant.yaml:6:35: error: emcy is for a route over another gateway, via: "
          "GATEWAY/LINE"}));
}

// A reload changes the routes of running lines. The order of the routes has no effect.
TEST(Routes, AreNoneOfTheSourcesOfALine) {
  const auto plan = [](const std::string& top) {
    const auto loaded = read_routes(top);
    EXPECT_TRUE(loaded.ok());
    return loaded.ok() ? loaded.value->lines[0] : LinePlan{};
  };
  const LinePlan same = plan("routes: [{to: 9, via: hall:5}, {to: 8, via: hall:4}]\n");
  EXPECT_FALSE(same.source.empty());
  const LinePlan turned =
      plan("routes:\n - {via: hall:4, to: 8}\n - via: hall:5\n   to: 9..9\n   cost: 10\n");
  EXPECT_EQ(turned.source, same.source);
  EXPECT_EQ(turned.routes, same.routes);
  const LinePlan other = plan("routes: [{to: 9, via: hall:6}, {to: 8, via: hall:4}]\n");
  EXPECT_EQ(other.source, same.source);
  EXPECT_NE(other.routes, same.routes);
  EXPECT_NE(plan("routing: {arm_timeout: 1s}\nroutes: [{to: 9, via: hall:5}]\n").source,
            same.source);
  const LinePlan over = plan("routes: [{to: 9, via: b/c}, {to: 8, via: b/d}]\n");
  EXPECT_EQ(over.source, same.source);
  EXPECT_EQ(plan("routes: [{to: 8, via: b/d}, {to: 9, via: b/c}]\n").routes, over.routes);
  for (const char* const keys : {"b/c, timeout: 4s", "b/c, enter: x", "b/x", "x/c"}) {
    const LinePlan changed =
        plan(std::string("routes: [{to: 9, via: ") + keys + "}, {to: 8, via: b/d}]\n");
    EXPECT_EQ(changed.source, same.source);
    EXPECT_NE(changed.routes, over.routes) << keys;
  }
}

}  // namespace
}  // namespace linegate::config

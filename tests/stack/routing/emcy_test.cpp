// SPDX-License-Identifier: Apache-2.0
// EMCYs that are forwarded to other networks, byte by byte (OWN definition C,
// stack/routing/README.md).
#include <array>
#include <cstdio>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "stack/od/dictionary.h"
#include "stack/od/objects.h"
#include "stack/routing/emcy_frame.h"
#include "stack/routing/emcy_router.h"

#include "tests/stack/routing/routed_lines.h"

namespace linegate::routing {
namespace {

constexpr std::uint32_t kNetwork1 = 1U << 0;
constexpr std::uint32_t kNetwork2 = 1U << 1;

class EmcyRouting : public test::RoutedLines {
 protected:
  EmcyRouting() {
    of_line(1).emcy_networks[5] = kNetwork2;
    for (unsigned number : {1U, 2U}) {
      of_line(number).access = {{.first = 1, .last = 2, .emcy = true}};
    }
  }

  // Node 9 of line 2 is the gateway to networks 3 and 4, and its EMCYs are forwarded to network 1.
  void with_a_gateway_on_line_2() {
    of_line(2).routes.push_back({.first = 3, .last = 4, .interface = 2, .gateway = 9});
    of_line(2).emcy_networks[9] = kNetwork1;
  }

  // Code 8130h of node 5 on line 1, with manufacturer bytes.
  void emcy_of_node_5() { hear(1, 0x085, {0x30, 0x81, 0x11, 1, 2, 3, 4, 5}); }

  // "0FE 3081110100050100"
  std::vector<std::string> emcys(unsigned number) {
    std::vector<std::string> out;
    can::Frame frame;
    while (line(number).next_frame(frame, now_)) {
      if ((frame.id & 0x780U) != 0x080 || frame.id == 0x080) {
        continue;
      }
      char digits[8];
      std::snprintf(digits, sizeof digits, "%03X ", frame.id);
      out.emplace_back(digits);
      for (const std::byte b : frame.bytes()) {
        std::snprintf(digits, sizeof digits, "%02X", std::to_integer<unsigned>(b));
        out.back() += digits;
      }
    }
    return out;
  }
  std::vector<Event> events(unsigned number, EventKind kind) {
    std::vector<Event> out;
    std::array<Event, 64> events;
    while (const std::size_t count = line(number).pop_events(events)) {
      for (const Event& event : std::span(events).first(count)) {
        if (event.kind() == kind) {
          out.push_back(event);
        }
      }
    }
    return out;
  }
};

TEST(ForwardedEmcy, IsCodedAsDefinitionCSays) {
  const ForwardedEmcy emcy{.code = 0x8130,
                           .error_register = 0x11,
                           .network = 0x0203,
                           .node = 5,
                           .hops = 2,
                           .number = 0xFE};
  const emcy::Message message = encode(emcy);
  EXPECT_EQ(message.code, 0x8130);
  EXPECT_EQ(message.error_register, 0x11);
  const emcy::ManufacturerInfo bytes{std::byte{3}, std::byte{2}, std::byte{5}, std::byte{2},
                                     std::byte{0xFE}};
  EXPECT_EQ(message.info, bytes);
  const auto back = decode(message);
  ASSERT_TRUE(back);
  EXPECT_TRUE(back->same(emcy));
  EXPECT_EQ(back->hops, 2);
  EXPECT_EQ(back->code, 0x8130);
}

TEST(ForwardedEmcy, IsNoneWithoutNetworkNodeOrHops) {
  const auto with = [](std::uint16_t network, std::uint8_t node, std::uint8_t hops) {
    return decode(encode(ForwardedEmcy{.network = network, .node = node, .hops = hops}))
        .has_value();
  };
  EXPECT_TRUE(with(1, 127, 1));
  EXPECT_FALSE(with(0, 1, 1));
  EXPECT_FALSE(with(1, 0, 1));
  EXPECT_FALSE(with(1, 128, 1));
  EXPECT_FALSE(with(1, 1, 0));
}

TEST_F(EmcyRouting, GoesOnToTheNetworksOf1F2FWithoutItsManufacturerBytes) {
  start();
  emcy_of_node_5();
  EXPECT_EQ(emcys(2), Frames{"0FE 3081110100050100"});
  EXPECT_EQ(emcys(1), Frames{});
  const auto told = events(2, EventKind::emcy_routed);
  ASSERT_EQ(told.size(), 1U);
  EXPECT_EQ(told[0].node, 0);
  EXPECT_EQ(std::get<event::EmcyRouted>(told[0].data).code, 0x8130U);
  EXPECT_EQ(std::get<event::EmcyRouted>(told[0].data).source_node, 5);
  hear(1, 0x085, {0, 0, 0, 0, 0, 0, 0, 0});
  EXPECT_EQ(emcys(2), Frames{"0FE 0000000100050101"}) << "an error reset with the next number";
  EXPECT_EQ(counters(1).emcy_forwarded, 2U);
  EXPECT_EQ(counters(1).emcy_dropped + counters(2).emcy_dropped, 0U);
  EXPECT_EQ(line(2).dictionary().number({0x1001, 0}), 0U) << "it is not the gateway's own error";
}

TEST_F(EmcyRouting, OfOtherNodesStaysUntilTheListSaysSo) {  // 1F2Fh, 1028h
  start();
  hear(1, 0x086, {0x30, 0x81, 0x11, 1, 2, 3, 4, 5});
  EXPECT_EQ(emcys(2), Frames{});
  const std::array<std::byte, 4> both{std::byte{kNetwork1 | kNetwork2}};
  ASSERT_EQ(line(1).dictionary().write({od::objects::kEmcyRouting, 6}, both), AbortCode::none);
  hear(1, 0x086, {0x30, 0x81, 0x11, 1, 2, 3, 4, 5});
  EXPECT_EQ(emcys(2), Frames{"0FE 3081110100060101"}) << "not sent on its own network again";
  EXPECT_EQ(emcys(1), Frames{});
}

TEST_F(EmcyRouting, OfANetworkThatMayNotEnterIsRefused) {
  of_line(2).access = {{.first = 1, .last = 2, .sdo_read = true, .sdo_write = true, .pdo = true}};
  start();
  emcy_of_node_5();
  EXPECT_EQ(emcys(2), Frames{});
  EXPECT_EQ(counters(2).not_permitted, 1U);
  const auto told = events(2, EventKind::routing_refused);
  ASSERT_EQ(told.size(), 1U);
  const auto& refused = std::get<event::RoutingRefused>(told[0].data);
  EXPECT_EQ(refused.source, 1);
  EXPECT_EQ(refused.service, RoutedService::emcy);
}

TEST_F(EmcyRouting, WithoutARouteIsAnEvent) {
  of_line(1).emcy_networks[5] = 1U << 31;
  start();
  emcy_of_node_5();
  EXPECT_EQ(counters(1).emcy_dropped, 1U);
  const auto told = events(1, EventKind::routing_refused);
  ASSERT_EQ(told.size(), 1U);
  EXPECT_EQ(std::get<event::RoutingRefused>(told[0].data).target, 32);
}

TEST_F(EmcyRouting, ForSeveralNetworksBehindOneLineIsSentOnce) {
  with_next_gateway();
  of_line(1).emcy_networks[5] = kNetwork2 | 1U << 2 | 1U << 3;
  start();
  emcy_of_node_5();
  EXPECT_EQ(emcys(2), Frames{"0FE 3081110100050100"});
}

TEST_F(EmcyRouting, OfAGatewayGoesOnAsThatOfItsSource) {
  with_a_gateway_on_line_2();
  start();
  hear(2, 0x089, {0x30, 0x81, 0x11, 3, 0, 12, 1, 7});
  EXPECT_EQ(emcys(1), Frames{"0FF 30811103000C0207"});
  const auto told = events(2, EventKind::emcy_routed);
  ASSERT_EQ(told.size(), 1U);
  EXPECT_EQ(told[0].node, 9) << "the gateway that sent the EMCY";
  EXPECT_EQ(std::get<event::EmcyRouted>(told[0].data).source_node, 12);
}

TEST_F(EmcyRouting, AGatewayMayBeNamedWithoutARoute) {
  of_line(2).gateways = {9};
  of_line(2).emcy_networks[9] = kNetwork1;
  start();
  hear(2, 0x089, {0x30, 0x81, 0x11, 3, 0, 12, 1, 7});
  EXPECT_EQ(emcys(1), Frames{"0FF 30811103000C0207"});
}

TEST_F(EmcyRouting, OfAnotherNodeIsNotTakenForAForwardedOne) {
  of_line(2).emcy_networks[9] = kNetwork1;
  start();
  hear(2, 0x089, {0x30, 0x81, 0x11, 3, 0, 12, 1, 7});
  EXPECT_EQ(emcys(1), Frames{"0FF 3081110200090100"});
}

TEST_F(EmcyRouting, OnOtherWaysIsDroppedSoThatALoopSettles) {
  with_a_gateway_on_line_2();
  start();
  emcy_of_node_5();
  EXPECT_EQ(emcys(2), Frames{"0FE 3081110100050100"});
  hear(2, 0x089, {0x30, 0x81, 0x11, 1, 0, 5, 2, 0});
  EXPECT_EQ(emcys(1), Frames{}) << "it has passed this network";
  EXPECT_EQ(emcys(2), Frames{});
  EXPECT_EQ(counters(2).emcy_dropped, 1U);
  hear(2, 0x089, {0x30, 0x81, 0x11, 1, 0, 5, 2, 9});
  EXPECT_EQ(emcys(1), Frames{}) << "never back to its source";
  hear(2, 0x089, {0x30, 0x81, 0x11, 3, 0, 12, 1, 7});
  hear(2, 0x089, {0x30, 0x81, 0x11, 3, 0, 12, 4, 7});
  EXPECT_EQ(emcys(1), Frames{"0FF 30811103000C0207"}) << "forwarded once";
}

TEST_F(EmcyRouting, OfAGatewayThatWasStartedAgainIsHeard) {
  with_a_gateway_on_line_2();
  start();
  hear(2, 0x089, {0x30, 0x81, 0x11, 3, 0, 12, 1, 0});
  EXPECT_EQ(emcys(1), Frames{"0FF 30811103000C0200"});
  hear(2, 0x089, {0x10, 0x50, 0x01, 3, 0, 12, 1, 0});
  EXPECT_EQ(emcys(1), Frames{"0FF 10500103000C0200"}) << "another error with the same number";
  pass(test::seconds(2));
  hear(2, 0x089, {0x30, 0x81, 0x11, 3, 0, 12, 1, 0});
  EXPECT_EQ(emcys(1), Frames{"0FF 30811103000C0200"}) << "the same EMCY later";
}

TEST_F(EmcyRouting, EndsAfterEightHops) {
  with_a_gateway_on_line_2();
  start();
  hear(2, 0x089, {0x30, 0x81, 0x11, 3, 0, 12, 7, 1});
  EXPECT_EQ(emcys(1), Frames{"0FF 30811103000C0801"});
  hear(2, 0x089, {0x30, 0x81, 0x11, 3, 0, 12, 8, 2});
  EXPECT_EQ(emcys(1), Frames{});
  EXPECT_EQ(counters(2).emcy_dropped, 1U);
}

TEST_F(EmcyRouting, KeepsTheInhibitTimeOfTheTargetLine) {
  start();
  const std::array<std::byte, 2> tenth{std::byte{0xE8}, std::byte{0x03}};  // 1000 x 100 us
  ASSERT_EQ(line(2).dictionary().write({0x1015, 0}, tenth), AbortCode::none);
  for (int i = 0; i < 20; ++i) {
    emcy_of_node_5();
  }
  EXPECT_EQ(emcys(2), Frames{"0FE 3081110100050100"});
  EXPECT_EQ(counters(2).emcy_dropped, 3U) << "16 are queued";
  pass(test::milliseconds(99));
  EXPECT_EQ(emcys(2), Frames{});
  pass(test::milliseconds(1));
  EXPECT_EQ(emcys(2), Frames{"0FE 3081110100050101"});
  pass(test::seconds(2));
  EXPECT_EQ(emcys(2).size(), 15U);
}

// Line 2 is one of CANopen FD with EMCYs of its own format.
TEST_F(EmcyRouting, OfADeviceOfCanopenFdIsForwardedAsAClassicalFrame) {
  config_of(2).canopen_fd = true;
  config_of(2).emcy_fd = true;
  of_line(2).emcy_networks[5] = kNetwork1;
  start();
  (void)emcys(1);
  const std::vector<std::uint8_t> frame{0x30, 0x81, 0x11, 0, 0x91, 1, 1, 0,   0, 0,
                                        0,    0,    0,    0, 1,    2, 3, 0xA, 5, 0};
  hear_fd(2, 0x085, frame);
  EXPECT_EQ(emcys(1), std::vector<std::string>{"0FF 3081110200050100"});
  EXPECT_EQ(counters(2).emcy_forwarded, 1U);
}

TEST_F(EmcyRouting, ToALineOfCanopenFdIsAClassicalFrame) {
  config_of(2).canopen_fd = true;
  config_of(2).emcy_fd = true;
  start();
  (void)emcys(2);
  emcy_of_node_5();
  EXPECT_EQ(emcys(2), std::vector<std::string>{"0FE 3081110100050100"});
}

// The forwarded EMCY of another gateway on a line of CANopen FD goes on as that of its source.
TEST_F(EmcyRouting, OfAGatewayOnALineOfCanopenFdGoesOnAsThatOfItsSource) {
  config_of(2).canopen_fd = true;
  of_line(2).gateways = {9};
  of_line(2).emcy_networks[9] = kNetwork1;
  start();
  (void)emcys(1);
  hear(2, 0x089, {0x30, 0x81, 0x11, 7, 0, 5, 1, 42});
  EXPECT_EQ(emcys(1), std::vector<std::string>{"0FF 308111070005022A"});
}

}  // namespace
}  // namespace linegate::routing

// SPDX-License-Identifier: Apache-2.0
// Networks that are reached over another gateway: each transfer is a request that the owner of the
// line passes on, and its answer. The head of gateway_egress.h has the invariants.
#include "stack/routing/gateway_egress.h"

#include <initializer_list>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "tests/stack/routing/routed_lines.h"

namespace linegate::routing::test {
namespace {

constexpr std::uint8_t kWay = 255;
const GatewayLine kPress{"hall-b", "press"};

std::vector<std::byte> bytes(std::initializer_list<unsigned> of) {
  std::vector<std::byte> out;
  for (const unsigned value : of) {
    out.push_back(static_cast<std::byte>(value));
  }
  return out;
}

// Network 7 is behind line press of gateway hall-b, from line 1.
class OverGateway : public SdoRouting {
 protected:
  OverGateway() {
    of_line(1).interfaces.push_back(
        {.number = kWay,
         .name = "hall-b/press",
         .way = std::make_shared<const GatewayWay>(GatewayWay{.to = kPress})});
    of_line(1).routes.push_back({.first = 7, .last = 7, .interface = kWay, .cost = 10});
  }
  void start_present() {
    start();
    line(1).set_present_gateways({kPress});
  }

  void execute(line::Request request, Duration timeout = {}) {
    line(1).execute({.tag = 7, .timeout = timeout, .request = std::move(request)}, now_);
    carry();
  }
  void read(std::uint8_t hops = 0) {
    execute(line::NetworkRead{.network = 7, .node = 5, .address = {0x1018, 1}, .hops = hops});
  }
  void write(std::vector<std::byte> data, Duration timeout = {}) {
    execute(
        line::NetworkWrite{
            .network = 7, .node = 5, .address = {0x6040, 0}, .data = std::move(data)},
        timeout);
  }
  std::optional<line::Reply> reply() {
    line::Reply out;
    return line(1).pop_reply(out) ? std::optional(std::move(out)) : std::nullopt;
  }
  std::optional<GatewayRequest> request() {
    GatewayRequest out;
    return line(1).pop_gateway_request(out) ? std::optional(std::move(out)) : std::nullopt;
  }
  void answer(const GatewayRequest& to, AbortCode abort, std::vector<std::byte> data = {}) {
    line(1).answer_gateway_request({.number = to.number, .abort = abort, .data = std::move(data)},
                                   now_);
    carry();
  }
  void answer_unknown(const GatewayRequest& to) {
    line(1).answer_gateway_request(
        {.number = to.number, .abort = AbortCode::timeout, .unknown = true}, now_);
    carry();
  }
  std::size_t unanswered() {
    return events(1, EventKind::routing_unanswered, EventKind::routing_unanswered).size();
  }
  // A device on line 1 has the connection to node 5 of network 7.
  void open_device() {
    hear(1, 0x67F, {0xE0, 7, 0, 5, 1, 0, 0, 0});
    ASSERT_EQ(sent(1), Frames{"5FF E007000501000000"});
  }
};

TEST_F(OverGateway, AReadIsOneRequestAndItsAnswerTheValue) {
  start_present();
  read();
  const auto asked = request();
  ASSERT_TRUE(asked);
  EXPECT_FALSE(request());
  EXPECT_EQ(asked->way->to, kPress);
  EXPECT_EQ(asked->network, 7);
  EXPECT_EQ(asked->node, 5);
  EXPECT_EQ(asked->hops, 1);
  EXPECT_EQ(asked->address, (od::Address{0x1018, 1}));
  EXPECT_FALSE(asked->write);
  EXPECT_EQ(asked->deadline, now_ + seconds(3));
  EXPECT_FALSE(reply());
  answer(*asked, AbortCode::none, bytes({1, 2, 3, 4}));
  const auto got = reply();
  ASSERT_TRUE(got);
  EXPECT_TRUE(got->ok());
  EXPECT_EQ(got->bytes(), bytes({1, 2, 3, 4}));
  EXPECT_FALSE(request());
  expect_nothing_left();
}

TEST_F(OverGateway, AWriteIsDoneWhenTheOtherGatewaySaysSo) {
  start_present();
  for (const std::size_t size : {1U, 4U, 5U, 200U, 5000U}) {
    std::vector<std::byte> value(size, std::byte{0x5A});
    value.back() = std::byte{1};
    write(value);
    std::optional<GatewayRequest> asked;
    for (int ms = 0; ms < 5000 && !(asked = request()); ++ms) {
      pass(milliseconds(1));
    }
    ASSERT_TRUE(asked) << size << (reply() ? " has ended" : "");
    EXPECT_TRUE(asked->write);
    EXPECT_EQ(asked->data, value);
    EXPECT_FALSE(reply()) << size;
    answer(*asked, AbortCode::none);
    const auto got = reply();
    ASSERT_TRUE(got) << size;
    EXPECT_TRUE(got->ok()) << size;
  }
  EXPECT_EQ(unanswered(), 0U);
  expect_nothing_left();
}

TEST_F(OverGateway, ALongValueIsRead) {
  start_present();
  read();
  const auto asked = request();
  ASSERT_TRUE(asked);
  const std::vector<std::byte> value(GatewayEgress::kLongest, std::byte{7});
  answer(*asked, AbortCode::none, value);
  pass(milliseconds(20));
  const auto got = reply();
  ASSERT_TRUE(got);
  EXPECT_EQ(got->bytes(), value);

  read();
  const auto next = request();
  ASSERT_TRUE(next);
  answer(*next, AbortCode::none, std::vector<std::byte>(GatewayEgress::kLongest + 1));
  const auto refused = reply();
  ASSERT_TRUE(refused);
  EXPECT_EQ(refused->error, to_error(AbortCode::out_of_memory));
  expect_nothing_left();
}

TEST_F(OverGateway, AValueThatIsTooLongIsNotWritten) {
  start_present();
  write(std::vector<std::byte>(GatewayEgress::kLongest + 1));
  pass(milliseconds(50));
  EXPECT_FALSE(request());
  const auto got = reply();
  ASSERT_TRUE(got);
  EXPECT_EQ(got->error, to_error(AbortCode::out_of_memory));
  EXPECT_EQ(unanswered(), 0U);
  expect_nothing_left();
}

TEST_F(OverGateway, AnAbortIsThatOfTheTarget) {
  start_present();
  write(bytes({1}));
  const auto asked = request();
  ASSERT_TRUE(asked);
  answer(*asked, AbortCode::value_too_high);
  const auto got = reply();
  ASSERT_TRUE(got);
  EXPECT_EQ(got->error, to_error(AbortCode::value_too_high));
  EXPECT_EQ(unanswered(), 0U);
  expect_nothing_left();
}

// Whatever number a device puts into its abort: the access must end.
TEST_F(OverGateway, AnyAbortCodeEndsTheTransfer) {
  start_present();
  read();
  const auto asked = request();
  ASSERT_TRUE(asked);
  answer(*asked, od::kLater);
  const auto got = reply();
  ASSERT_TRUE(got);
  EXPECT_EQ(got->error, to_error(AbortCode::general));
  expect_nothing_left();
}

TEST_F(OverGateway, AGatewayThatIsNotThereIsNoWay) {
  start();
  read();
  EXPECT_FALSE(request());
  const auto got = reply();
  ASSERT_TRUE(got);
  EXPECT_EQ(got->error, to_error(AbortCode::timeout));
  EXPECT_TRUE(refused_with(1, AbortCode::timeout));
  line(1).set_present_gateways({{"hall-b", "pack"}, {"hall-c", "press"}});
  read();
  EXPECT_EQ(reply()->error, to_error(AbortCode::timeout)) << "another line, another gateway";
  expect_nothing_left();
}

TEST_F(OverGateway, WithoutAnswerAWriteMayHaveBeenCarriedOut) {
  start_present();
  write(bytes({1}));
  const auto asked = request();
  ASSERT_TRUE(asked);
  pass(milliseconds(2990));
  EXPECT_FALSE(reply()) << "the time-outs of the client were restarted";
  pass(milliseconds(20));
  const auto got = reply();
  ASSERT_TRUE(got);
  EXPECT_EQ(got->error, to_error(AbortCode::timeout));
  const auto seen = events(1, EventKind::routing_unanswered, EventKind::routing_unanswered);
  ASSERT_EQ(seen.size(), 1U);
  EXPECT_EQ(seen[0].data, EventData(event::RoutingUnanswered{.source = 0,
                                                             .target = 7,
                                                             .index = 0x6040,
                                                             .sub = 0,
                                                             .target_node = 5,
                                                             .interface = kWay}));
  const auto end = request();
  ASSERT_TRUE(end);
  EXPECT_TRUE(end->cancelled);
  EXPECT_EQ(end->number, asked->number);
  answer(*asked, AbortCode::none);  // too late
  EXPECT_FALSE(reply());
  expect_nothing_left();
}

TEST_F(OverGateway, ARequestThatWasNeverHandedOutIsNotCarriedOut) {
  start_present();
  write(bytes({1}));
  pass(seconds(4));
  EXPECT_EQ(reply()->error, to_error(AbortCode::timeout));
  EXPECT_FALSE(request()) << "its deadline has passed";
  EXPECT_EQ(unanswered(), 0U) << "nobody can have carried it out";
  expect_nothing_left();
}

TEST_F(OverGateway, AnUnknownResultIsATimeoutWithAnEvent) {
  start_present();
  write(bytes({1}));
  answer_unknown(*request());
  EXPECT_EQ(reply()->error, to_error(AbortCode::timeout));
  EXPECT_EQ(unanswered(), 1U);
  read();
  answer_unknown(*request());
  EXPECT_EQ(reply()->error, to_error(AbortCode::timeout));
  EXPECT_EQ(unanswered(), 0U) << "a read changes nothing";
  expect_nothing_left();
}

TEST_F(OverGateway, ALateAnswerNeverAnswersAnotherRequest) {
  start_present();
  read();
  const auto first = request();
  pass(seconds(4));
  EXPECT_EQ(reply()->error, to_error(AbortCode::timeout));
  (void)request();
  read();
  const auto second = request();
  ASSERT_TRUE(second);
  EXPECT_NE(second->number, first->number);
  answer(*first, AbortCode::none, bytes({1}));
  EXPECT_FALSE(reply());
  answer(*second, AbortCode::none, bytes({2}));
  EXPECT_EQ(reply()->bytes(), bytes({2}));
  answer(*second, AbortCode::none, bytes({3}));
  EXPECT_FALSE(reply());
  expect_nothing_left();
}

TEST_F(OverGateway, TheTimeoutOfACommandCancelsItsRequest) {
  start_present();
  write(bytes({1}), milliseconds(200));
  const auto asked = request();
  ASSERT_TRUE(asked);
  pass(milliseconds(250));
  EXPECT_EQ(reply()->error, to_error(AbortCode::timeout)) << "it may be carried out";
  const auto end = request();
  ASSERT_TRUE(end);
  EXPECT_TRUE(end->cancelled);
  EXPECT_EQ(unanswered(), 1U);
  expect_nothing_left();
}

TEST_F(OverGateway, AStopDuringAWriteIsNoRefusal) {
  start_present();
  open_device();
  client({0x2F, 0x40, 0x60, 0, 5, 0, 0, 0});
  ASSERT_TRUE(request());
  line(1).stop(now_);
  EXPECT_EQ(sent(1), Frames{"5FF 8040600000000405"});
  EXPECT_EQ(unanswered(), 1U);
  const auto end = request();
  ASSERT_TRUE(end);
  EXPECT_TRUE(end->cancelled);
}

TEST_F(OverGateway, ADeviceReadsAndWrites) {
  start_present();
  open_device();
  client({0x40, 0x18, 0x10, 1, 0, 0, 0, 0});
  EXPECT_EQ(sent(1), Frames{});
  const auto asked = request();
  ASSERT_TRUE(asked);
  EXPECT_EQ(asked->hops, 2) << "the client counts as one gateway";
  answer(*asked, AbortCode::none, bytes({0x11, 0x22}));
  EXPECT_EQ(sent(1), Frames{"5FF 4B18100111220000"});
  EXPECT_EQ(sent(1), Frames{});
  client({0x40, 0x18, 0x10, 1, 0, 0, 0, 0});
  EXPECT_FALSE(request()) << "each transfer needs an indication of its own";
  (void)sent(1);

  open_device();
  client({0x23, 0x40, 0x60, 0, 1, 2, 3, 4});
  const auto written = request();
  ASSERT_TRUE(written);
  EXPECT_EQ(written->data, bytes({1, 2, 3, 4}));
  EXPECT_EQ(sent(1), Frames{});
  answer(*written, AbortCode::none);
  EXPECT_EQ(sent(1), Frames{"5FF 6040600000000000"});
  expect_nothing_left();
}

TEST_F(OverGateway, ADeviceTransfersByBlocks) {
  start_present();
  open_device();
  client({0xA0, 0x18, 0x10, 1, 4, 0, 0, 0});
  const auto read = request();
  ASSERT_TRUE(read);
  answer(*read, AbortCode::none, bytes({1, 2, 3, 4, 5, 6, 7, 8, 9, 10}));
  EXPECT_EQ(sent(1), Frames{"5FF C61810010A000000"});
  client({0xA3, 0, 0, 0, 0, 0, 0, 0});
  pass(milliseconds(2));
  EXPECT_EQ(sent(1), (Frames{"5FF 0101020304050607", "5FF 8208090A00000000"}));
  client({0xA2, 2, 4, 0, 0, 0, 0, 0});
  EXPECT_EQ(sent(1), Frames{"5FF D100000000000000"});
  client({0xA1, 0, 0, 0, 0, 0, 0, 0});
  expect_nothing_left();

  open_device();
  client({0xC2, 0x40, 0x60, 0, 10, 0, 0, 0});
  ASSERT_EQ(sent(1).size(), 1U);
  client({0x01, 1, 2, 3, 4, 5, 6, 7});
  client({0x82, 8, 9, 10, 0, 0, 0, 0});
  ASSERT_EQ(sent(1).size(), 1U);
  EXPECT_FALSE(request()) << "the value is not complete";
  client({0xD1, 0, 0, 0, 0, 0, 0, 0});
  const auto written = request();
  ASSERT_TRUE(written);
  EXPECT_EQ(written->data, bytes({1, 2, 3, 4, 5, 6, 7, 8, 9, 10}));
  EXPECT_EQ(sent(1), Frames{});
  answer(*written, AbortCode::none);
  EXPECT_EQ(sent(1), Frames{"5FF A100000000000000"});
  expect_nothing_left();
}

// A connection that ends within a block leaves nothing to the next one.
TEST_F(OverGateway, AConnectionThatEndsWithinABlockLeavesNothing) {
  start_present();
  open_device();
  client({0xC2, 0x40, 0x60, 0, 100, 0, 0, 0});
  client({0x01, 1, 2, 3, 4, 5, 6, 7});
  pass(seconds(2));
  (void)sent(1);
  expect_nothing_left();
  open_device();
  client({0x2F, 0x40, 0x60, 0, 5, 0, 0, 0});
  const auto written = request();
  ASSERT_TRUE(written);
  EXPECT_EQ(written->data, bytes({5}));
}

TEST_F(OverGateway, ADeviceThatAbortsCancelsItsRequest) {
  start_present();
  open_device();
  client({0x23, 0x40, 0x60, 0, 1, 2, 3, 4});
  const auto asked = request();
  ASSERT_TRUE(asked);
  client({0x80, 0x40, 0x60, 0, 0, 0, 4, 5});
  const auto end = request();
  ASSERT_TRUE(end);
  EXPECT_TRUE(end->cancelled);
  EXPECT_EQ(end->number, asked->number);
  EXPECT_EQ(unanswered(), 1U);
  expect_nothing_left();
}

// A device that begins anew does not wait for the request before.
TEST_F(OverGateway, AnotherInitiateReplacesTheRequest) {
  start_present();
  open_device();
  client({0x40, 0x18, 0x10, 1, 0, 0, 0, 0});
  const auto first = request();
  ASSERT_TRUE(first);
  client({0x40, 0x18, 0x10, 2, 0, 0, 0, 0});
  const auto end = request();
  ASSERT_TRUE(end);
  EXPECT_TRUE(end->cancelled);
  const auto second = request();
  ASSERT_TRUE(second);
  EXPECT_EQ(second->address, (od::Address{0x1018, 2}));
  answer(*first, AbortCode::none, bytes({9}));
  EXPECT_EQ(sent(1), Frames{});
  answer(*second, AbortCode::none, bytes({8}));
  EXPECT_EQ(sent(1), Frames{"5FF 4F18100208000000"});
  expect_nothing_left();
}

TEST_F(OverGateway, ObjectsThatNoCommandCanNameAreRefused) {
  start_present();
  open_device();
  client({0x40, 0, 0, 1, 0, 0, 0, 0});
  EXPECT_EQ(sent(1), Frames{"5FF 8000000100000206"});
  open_device();
  client({0x40, 0x18, 0x10, 0xFF, 0, 0, 0, 0});
  EXPECT_EQ(sent(1), Frames{"5FF 801810FF11000906"});
  hear(1, 0x67F, {0xE0, 7, 0, 0, 1, 0, 0, 0});  // the other gateway itself
  EXPECT_EQ(sent(1), Frames{"5FF 8000000030000906"});
  EXPECT_FALSE(request());
  expect_nothing_left();
}

TEST_F(OverGateway, TheHopLimitCutsALoop) {
  start_present();
  read(7);
  const auto asked = request();
  ASSERT_TRUE(asked);
  EXPECT_EQ(asked->hops, 8);
  answer(*asked, AbortCode::none, bytes({1}));
  EXPECT_TRUE(reply()->ok());
  read(9);
  EXPECT_FALSE(request());
  EXPECT_EQ(reply()->error, to_error(AbortCode::invalid_value));
  expect_nothing_left();
}

TEST_F(OverGateway, MoreConnectionsThanThereIsRoomForAreRefused) {
  start_present();
  for (std::size_t i = 0; i < GatewayEgress::kMost; ++i) {
    read();
  }
  EXPECT_FALSE(reply());
  read();
  EXPECT_EQ(reply()->error, to_error(AbortCode::out_of_memory));
  pass(seconds(4));
  for (std::size_t i = 0; i < GatewayEgress::kMost; ++i) {
    EXPECT_EQ(reply()->error, to_error(AbortCode::timeout));
  }
  EXPECT_FALSE(request()) << "their deadlines have passed";
  expect_nothing_left();
}

TEST_F(OverGateway, OneClientLeavesRoomForOthers) {
  start_present();
  const auto read_as = [&](std::uint32_t client) {
    line(1).execute({.tag = 7,
                     .client = client,
                     .request = line::NetworkRead{.network = 7, .node = 5, .address = {0x1018, 1}}},
                    now_);
    carry();
  };
  for (std::size_t i = 0; i < GatewayEgress::kMostOfOneClient; ++i) {
    read_as(3);
  }
  EXPECT_FALSE(reply());
  read_as(3);
  EXPECT_EQ(reply()->error, to_error(AbortCode::out_of_memory));
  read_as(4);
  EXPECT_FALSE(reply());
}

// When the other gateway has gone, the next route is tried.
TEST_F(OverGateway, AnotherRouteStandsIn) {
  of_line(1).routes.push_back({.first = 7, .last = 7, .interface = 2, .gateway = 9, .cost = 20});
  start();
  read();
  EXPECT_EQ(sent(2), Frames{"609 E007000501000000"});
}

// A reload may give the number of a way to another one: the connection keeps its own.
TEST_F(OverGateway, AReloadDoesNotChangeAnOpenConnection) {
  start_present();
  open_device();
  Config other = of_line(1);
  other.interfaces.back().way =
      std::make_shared<const GatewayWay>(GatewayWay{.to = {"hall-c", "press"}});
  line(1).set_routes(other, now_);
  client({0x40, 0x18, 0x10, 1, 0, 0, 0, 0});
  const auto asked = request();
  ASSERT_TRUE(asked);
  EXPECT_EQ(asked->way->to, kPress);
  answer(*asked, AbortCode::none, bytes({1}));
  EXPECT_EQ(sent(1), Frames{"5FF 4F18100101000000"});
  read();
  EXPECT_EQ(reply()->error, to_error(AbortCode::timeout)) << "hall-c is not present";
}

TEST_F(OverGateway, EmcysAreNotForwardedToIt) {
  of_line(1).emcy_networks[5] = 1U << 6U;
  start_present();
  hear(1, 0x085, {0x30, 0x81, 0x11, 0, 0, 0, 0, 0});
  EXPECT_TRUE(refused_with(1, AbortCode::invalid_value));
}

}  // namespace
}  // namespace linegate::routing::test

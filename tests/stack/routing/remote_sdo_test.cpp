// SPDX-License-Identifier: Apache-2.0
// Commands of the process for nodes of other networks, and commands on behalf of a device.
#include <initializer_list>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "tests/stack/routing/routed_lines.h"

namespace linegate::routing::test {
namespace {

class RemoteSdo : public SdoRouting {
 protected:
  void read(std::uint16_t network, std::uint8_t node) {
    line(1).execute(
        {.tag = 7,
         .request = line::NetworkRead{.network = network, .node = node, .address = {0x1000, 0}}},
        now_);
    carry();
  }
  // In the place of a device on the bus of line 1.
  void access_as_device(line::Request request) {
    line(1).execute({.tag = 7, .request = std::move(request)}, now_);
    carry();
  }
  void read_as_device(std::uint16_t network, std::uint8_t node) {
    access_as_device(line::NetworkRead{
        .network = network, .node = node, .address = {0x1000, 0}, .as_device = true});
  }
  void write_as_device(std::uint16_t network, std::uint8_t node) {
    access_as_device(line::NetworkWrite{.network = network,
                                        .node = node,
                                        .address = {0x1000, 0},
                                        .as_device = true,
                                        .data = {std::byte{1}}});
  }
  line::Reply reply() {
    line::Reply out;
    EXPECT_TRUE(line(1).pop_reply(out));
    return out;
  }
};

TEST_F(RemoteSdo, AnotherLineOfTheProcessIsReachedDirectly) {
  start();
  read(2, 5);
  EXPECT_EQ(sent(2), Frames{"605 4000100000000000"});
  server({0x43, 0, 0x10, 0, 0x91, 1, 2, 3});
  const line::Reply got = reply();
  EXPECT_TRUE(got.ok());
  EXPECT_EQ(got.bytes(),
            (std::vector<std::byte>{std::byte{0x91}, std::byte{1}, std::byte{2}, std::byte{3}}));
  EXPECT_EQ(sent(1), Frames{});
  expect_nothing_left();
}

TEST_F(RemoteSdo, AGatewayOnTheOwnLineIsToldTheNetworkFirst) {
  of_line(1).routes.push_back({.first = 5, .last = 5, .interface = 1, .gateway = 9});
  start();
  for (int i = 0; i < 2; ++i) {  // each transfer needs its own network indication
    read(5, 33);
    EXPECT_EQ(sent(1), Frames{"609 E005002101000000"});
    hear(1, 0x589, {0xE0, 5, 0, 33, 1, 0, 0, 0});
    EXPECT_EQ(sent(1), Frames{"609 4000100000000000"});
    hear(1, 0x589, {0x4F, 0, 0x10, 0, 5, 0, 0, 0});
    EXPECT_EQ(reply().bytes(), std::vector<std::byte>{std::byte{5}});
  }
  expect_nothing_left();
}

TEST_F(RemoteSdo, EachWayToFailHasItsCode) {
  of_line(1).routes.push_back({.first = 5, .last = 5, .interface = 1, .gateway = 9});
  start();
  read(8, 1);
  EXPECT_EQ(reply().error, to_error(AbortCode::invalid_value));  // no route
  read(5, 33);
  hear(1, 0x589, {0x80, 0, 0, 0, 1, 0, 4, 5});
  EXPECT_EQ(reply().error, to_error(AbortCode::command_specifier));  // not a gateway
  read(5, 33);
  pass(milliseconds(1100));
  EXPECT_EQ(reply().error, to_error(AbortCode::timeout));  // the gateway does not answer
  read(2, 5);
  pass(milliseconds(1100));
  EXPECT_EQ(reply().error, to_error(AbortCode::timeout));  // the target does not answer
  read(2, 200);
  EXPECT_EQ(reply().error, to_error(line::Refusal::bad_request));
  for (const std::uint8_t node : std::initializer_list<std::uint8_t>{0, 5, 127}) {
    read(0, node);  // network-ID 0 is invalid
    EXPECT_EQ(reply().error, to_error(line::Refusal::bad_request));
  }
  expect_nothing_left();
}

TEST_F(RemoteSdo, ACommandsOwnTimeoutFreesTheWay) {
  start();
  line(1).execute({.tag = 7,
                   .timeout = milliseconds(100),
                   .request = line::NetworkRead{.network = 2, .node = 5, .address = {0x1000, 0}}},
                  now_);
  carry();
  pass(milliseconds(110));
  EXPECT_FALSE(reply().ok());
  EXPECT_EQ(sent(2), (Frames{"605 4000100000000000", "605 8000100000000405"}));
  expect_nothing_left();
}

// The target may have carried it out, also if the command permits a repetition.
TEST_F(RemoteSdo, AWriteThatAStopEndsIsATimeoutOnceItWasSent) {
  for (const std::uint8_t repeats : std::initializer_list<std::uint8_t>{0, 1}) {
    for (const std::size_t octets : {std::size_t{4}, std::size_t{9}}) {
      start();
      line(1).execute({.tag = 7,
                       .request = line::NetworkWrite{.network = 2,
                                                     .node = 5,
                                                     .address = {0x2000, 0},
                                                     .data = std::vector<std::byte>(octets),
                                                     .repeats = repeats}},
                      now_);
      carry();
      EXPECT_EQ(sent(2).size(), 1U);
      line(1).stop(now_);
      carry();
      EXPECT_EQ(reply().error, to_error(octets == 4 ? AbortCode::timeout : AbortCode::device_state))
          << int{repeats} << " repetitions, octets: " << octets;
    }
  }
}

TEST_F(RemoteSdo, InThePlaceOfADeviceIsRefusedWhereNoRuleAdmitsItsNetwork) {
  of_line(2).access = {{.first = 2, .last = 9, .sdo_read = true, .sdo_write = true}};
  start();
  read_as_device(2, 5);
  EXPECT_EQ(reply().error, to_error(AbortCode::local_control));
  EXPECT_EQ(sent(2), Frames{});
  const auto refused = events(2, EventKind::routing_refused, EventKind::routing_refused);
  ASSERT_EQ(refused.size(), 1U);
  EXPECT_EQ(std::get<event::RoutingRefused>(refused[0].data).source, 1U) << "the network of line 1";
  EXPECT_EQ(counters(2).not_permitted, 1U);
  read(2, 5);  // on behalf of the process
  EXPECT_EQ(sent(2), Frames{"605 4000100000000000"});
}

TEST_F(RemoteSdo, InThePlaceOfADeviceReadsAndWritesAsTheRuleSays) {
  of_line(2).access = {{.first = 1, .last = 1, .sdo_read = true}};
  start();
  read_as_device(2, 5);
  EXPECT_EQ(sent(2), Frames{"605 4000100000000000"});
  server({0x4F, 0, 0x10, 0, 5, 0, 0, 0});
  EXPECT_EQ(reply().bytes(), std::vector<std::byte>{std::byte{5}});
  write_as_device(2, 5);
  EXPECT_EQ(reply().error, to_error(AbortCode::read_only));
  EXPECT_EQ(sent(1), Frames{});
  expect_nothing_left();
}

TEST_F(RemoteSdo, InThePlaceOfADeviceCountsAHopAndDoesNotReturnToItsLine) {
  with_next_gateway();
  of_line(1).routes.push_back({.first = 5, .last = 5, .interface = 1, .gateway = 9});
  start();
  read_as_device(3, 7);
  EXPECT_EQ(sent(2), Frames{"609 E003000702000000"});
  pass(seconds(3));
  (void)reply();
  (void)sent(2);
  read_as_device(5, 7);
  EXPECT_EQ(reply().error, to_error(AbortCode::invalid_value));
  EXPECT_EQ(sent(1), Frames{});
  expect_nothing_left();
}

// A route that was written by SDO and is not in the configuration of the gateway.
class RemoteSdoByWrittenRoute : public RemoteSdo {
 protected:
  void start_with_route() {
    start();
    client({0x21, 0x2C, 0x1F, 2, 8, 0, 0, 0});
    client({0x00, 4, 0, 4, 0, 2, 9, 1});  // network 4 over interface 2, next gateway 9
    client({0x1D, 0, 0, 0, 0, 0, 0, 0});
    client({0x2F, 0x2C, 0x1F, 0, 2, 0, 0, 0});
    ASSERT_EQ(sent(1).back(), "5FF 602C1F0000000000");
  }
};

TEST_F(RemoteSdoByWrittenRoute, DoesNotEnterALineThatIsClosedToTheProcess) {
  of_line(2).process_reads = of_line(2).process_writes = false;
  start_with_route();
  read(4, 7);
  EXPECT_EQ(reply().error, to_error(AbortCode::local_control));
  EXPECT_EQ(sent(2), Frames{});
  EXPECT_TRUE(refused_with(2, AbortCode::local_control));
  EXPECT_EQ(counters(2).not_permitted, 1U);
  read_as_device(4, 7);  // a command of the process, although devices have access
  EXPECT_EQ(reply().error, to_error(AbortCode::local_control));
  EXPECT_EQ(sent(2), Frames{});
  client({0xE0, 4, 0, 7, 1, 0, 0, 0});  // clients on the bus have other access rules
  EXPECT_EQ(sent(2), Frames{"609 E004000702000000"});
}

TEST_F(RemoteSdoByWrittenRoute, OnlyReadsInALineThatMayBeRead) {
  of_line(2).process_writes = false;
  start_with_route();
  read(4, 7);
  EXPECT_EQ(sent(2), Frames{"609 E004000701000000"});
  hear(2, 0x589, {0xE0, 4, 0, 7, 1, 0, 0, 0});
  EXPECT_EQ(sent(2), Frames{"609 4000100000000000"});
  hear(2, 0x589, {0x4F, 0, 0x10, 0, 5, 0, 0, 0});
  EXPECT_EQ(reply().bytes(), std::vector<std::byte>{std::byte{5}});
  line(1).execute(
      {.tag = 8,
       .request =
           line::NetworkWrite{
               .network = 4, .node = 7, .address = {0x2000, 0}, .data = {std::byte{1}}}},
      now_);
  carry();
  EXPECT_EQ(sent(2), Frames{"609 E004000701000000"});
  hear(2, 0x589, {0xE0, 4, 0, 7, 1, 0, 0, 0});
  EXPECT_EQ(reply().error, to_error(AbortCode::read_only));
  EXPECT_EQ(sent(2), Frames{"609 8000000000000008"});
  expect_nothing_left();
}

TEST_F(RemoteSdo, TheRoutesInForceAreKnown) {
  start();
  std::vector<Route> routes;
  line(1).routes(routes);
  EXPECT_EQ(routes, of_line(1).routes);
  client({0x2F, 0x2C, 0x1F, 0, 0, 0, 0, 0});
  line(1).routes(routes);
  EXPECT_EQ(routes, std::vector<Route>{});
  line(1).execute(
      {.tag = 9,
       .request = line::NmtRequest{.node = 127, .command = nmt::Command::reset_communication}},
      now_);
  pass(milliseconds(10));
  line(1).routes(routes);
  EXPECT_EQ(routes, of_line(1).routes);
}

TEST_F(RemoteSdo, CommandsOfTheProcessAreNotSubjectToTheRulesOfAccess) {
  of_line(2).access.clear();
  start();
  read(2, 5);
  EXPECT_EQ(sent(2), Frames{"605 4000100000000000"});
}

// --- the share of a client on the line of the target ---------------------------------------------

constexpr std::uint32_t kClient = 42;

// Permits everything or nothing, and records for whom frames were counted.
class FakePace final : public sdo::Pace {
 public:
  bool permits(std::uint32_t client, bool /*awaited*/) const override {
    asked.push_back(client);
    return permitted;
  }
  void count(std::uint32_t client, const can::Header& /*frame*/) override {
    counted.push_back(client);
  }

  bool permitted = true;
  mutable std::vector<std::uint32_t> asked;
  std::vector<std::uint32_t> counted;
};

class PacedRemoteSdo : public RemoteSdo {
 protected:
  void start_paced() {
    start();
    line(2).set_pace(pace_);
  }
  void write(std::size_t octets, std::uint32_t client) {
    line(1).execute({.tag = 7,
                     .client = client,
                     .request = line::NetworkWrite{.network = 2,
                                                   .node = 5,
                                                   .address = {0x2000, 0},
                                                   .data = std::vector<std::byte>(octets)}},
                    now_);
    carry();
  }

  FakePace pace_;
};

TEST_F(PacedRemoteSdo, FramesOfBothDirectionsCountForTheClientOfTheCommand) {
  start_paced();
  write(4, kClient);
  EXPECT_EQ(sent(2), Frames{"605 2300200000000000"});
  server({0x60, 0, 0x20, 0, 0, 0, 0, 0});
  EXPECT_TRUE(reply().ok());
  EXPECT_EQ(pace_.counted, (std::vector<std::uint32_t>{kClient, kClient}));
}

TEST_F(PacedRemoteSdo, FramesThatTheShareDoesNotPermitWaitWithoutATimeout) {
  start_paced();
  write(10, kClient);
  EXPECT_EQ(sent(2), Frames{"605 210020000A000000"});
  pace_.permitted = false;
  server({0x60, 0, 0x20, 0, 0, 0, 0, 0});
  pass(seconds(60));
  EXPECT_EQ(sent(2), Frames{});
  line::Reply none;
  EXPECT_FALSE(line(1).pop_reply(none));
  pace_.permitted = true;
  pass(milliseconds(1));
  EXPECT_EQ(sent(2), Frames{"605 0000000000000000"});
  server({0x20, 0, 0, 0, 0, 0, 0, 0});
  EXPECT_EQ(sent(2), Frames{"605 1900000000000000"});
  server({0x30, 0, 0, 0, 0, 0, 0, 0});
  EXPECT_TRUE(reply().ok());
  expect_nothing_left();
}

TEST_F(PacedRemoteSdo, AServerThatDoesNotAnswerIsATimeoutAfterTheWait) {
  start_paced();
  write(10, kClient);
  pace_.permitted = false;
  server({0x60, 0, 0x20, 0, 0, 0, 0, 0});
  pass(seconds(10));
  pace_.permitted = true;
  pass(seconds(10));
  EXPECT_EQ(reply().error, to_error(AbortCode::timeout));
  expect_nothing_left();
}

TEST_F(PacedRemoteSdo, ATransferThatHasNotBegunDoesNotOccupyTheServer) {
  start_paced();
  pace_.permitted = false;
  write(4, kClient);
  pass(milliseconds(5));
  EXPECT_EQ(sent(2), Frames{});
  line(2).execute({.tag = 9, .request = line::SdoRead{.node = 5, .address = {0x1000, 0}}}, now_);
  EXPECT_EQ(sent(2), Frames{"605 4000100000000000"}) << "nobody's frames are not limited";
}

TEST_F(PacedRemoteSdo, FramesOfDevicesAndOfTheLineItselfAreNotLimited) {
  start_paced();
  pace_.permitted = false;
  write(4, 0);
  EXPECT_EQ(sent(2), Frames{"605 2300200000000000"});
  server({0x60, 0, 0x20, 0, 0, 0, 0, 0});
  EXPECT_TRUE(reply().ok());
  EXPECT_TRUE(pace_.asked.empty());
  EXPECT_TRUE(pace_.counted.empty());
}

}  // namespace
}  // namespace linegate::routing::test

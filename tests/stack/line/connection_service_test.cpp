// SPDX-License-Identifier: Apache-2.0
#include "stack/line/connection_service.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "stack/sdo/protocol.h"

#include "tests/stack/line/diagnosed_parts.h"

namespace linegate::line {
namespace {

using testing::HasSubstr;

constexpr std::uint8_t kConnectedClient = 5;
constexpr std::uint8_t kConnectedServer = 8;

LineConfig config_with_pool(LineConfig config, manager::ConnectionPool pool = {0x680, 0x683}) {
  config.connection_pool = pool;
  return config;
}

// Each device has one record, 1280h and 1201h, which is free at first.
struct ConnectionServiceTest : testing::Test {
  std::uint64_t execute(Request request, Duration timeout = {}) {
    service.execute({.tag = ++tag, .timeout = timeout, .request = std::move(request)}, parts.now);
    return tag;
  }
  std::uint64_t open(std::uint8_t client = kConnectedClient,
                     std::uint8_t server = kConnectedServer) {
    return execute(ConnectionOpen{.node = client, .server = server});
  }
  void answer(const can::Frame& request) {
    const auto node = static_cast<std::uint8_t>(request.id & 0x7FU);
    const std::uint64_t word = sdo::word_of(request);
    const auto command = static_cast<std::uint8_t>(word);
    if ((request.id & ~0x7FU) != can::kSdoRequestBase || command == 0x80) {
      return;
    }
    const od::Address object = sdo::multiplexer(word);
    const std::uint64_t head = word & 0xFFFF'FF00;
    const bool is_record = object.index == (node == kConnectedServer ? 0x1201 : 0x1280);
    std::uint32_t& value = values[{node, object.sub}];
    std::uint64_t response = sdo::abort_word(object, AbortCode::no_object);
    if (is_record && command == 0x40) {
      response = 0x43U | head | std::uint64_t{value} << 32U;
    } else if (is_record) {
      value = static_cast<std::uint32_t>(word >> 32U);
      response = 0x60U | head;
    }
    can::Frame frame{.id = can::kSdoResponseBase + node, .length = sdo::kFrameSize};
    frame.time = parts.now;
    store_le(frame.data.data(), response);
    parts.sdo.receive({.service = can::Service::sdo_client, .index = node}, frame);
    parts.sdo.deliver_completions(parts.now);
  }
  void run() {
    for (int round = 0; round < 1000; ++round) {
      service.advance(parts.now);
      can::Frame request;
      while (parts.node.transmit().pop_rest(request)) {
        if (answers) {
          answer(request);
        }
      }
      if (service.next_wake() > parts.now && parts.node.transmit().empty()) {
        return;
      }
    }
    FAIL() << "the service does not come to rest";
  }
  bool valid(std::uint8_t node) {
    return ((values[{node, 1}] | values[{node, 2}]) & 0x8000'0000U) == 0;
  }

  DiagnosedParts parts;
  RecordingHost& host = parts.host;
  LineConfig config = config_with_pool(parts.config);
  ConnectionService service{host, config, parts.node, parts.plan.tpdos, parts.sdo, parts.events};
  std::map<std::pair<std::uint8_t, std::uint8_t>, std::uint32_t> values{
      {{kConnectedClient, 1}, 0x8000'0000U},
      {{kConnectedClient, 2}, 0x8000'0000U},
      {{kConnectedServer, 1}, 0x8000'0000U},
      {{kConnectedServer, 2}, 0x8000'0000U}};
  bool answers = true;
  std::uint64_t tag = 0;
};

TEST_F(ConnectionServiceTest, IsRefusedWhereItMakesNoSense) {
  for (const auto& [client, server] : {std::pair<std::uint8_t, std::uint8_t>{0, 8},
                                       {5, 0},
                                       {5, 5},
                                       {5, 128},
                                       {128, 5},
                                       {parts.config.node_id, 5},
                                       {5, parts.config.node_id}}) {
    EXPECT_EQ(host.answer(open(client, server)), to_error(Refusal::bad_request)) << int{client};
  }
  EXPECT_EQ(host.answer(execute(ConnectionClose{.number = 1})), to_error(Refusal::bad_request));
  host.set_usable(false);
  EXPECT_EQ(host.answer(open()), to_error(Refusal::line_down));
  EXPECT_EQ(host.answer(execute(ConnectionList{})), Error{});
  host.set_manages(false);
  EXPECT_EQ(host.answer(open()), to_error(Refusal::wrong_role));
  EXPECT_EQ(host.answer(execute(ConnectionList{})), to_error(Refusal::wrong_role));
  EXPECT_EQ(service.next_wake(), kNever);
}

TEST_F(ConnectionServiceTest, WithoutAPoolNothingIsOpened) {
  ConnectionService without(host, parts.config, parts.node, parts.plan.tpdos, parts.sdo,
                            parts.events);
  without.execute({.tag = 99, .request = ConnectionOpen{.node = 5, .server = 8}}, parts.now);
  EXPECT_EQ(host.answer(99), to_error(Refusal::wrong_state));
}

TEST_F(ConnectionServiceTest, OpensListsAndCloses) {
  const std::uint64_t opening = open();
  EXPECT_FALSE(host.answer(opening));
  EXPECT_EQ(host.answer(execute(ConnectionClose{.number = 1})), to_error(Refusal::wrong_state));
  run();
  ASSERT_EQ(host.answer(opening), Error{});
  const SdoConnections opened{{.number = 1,
                               .client = kConnectedClient,
                               .server = kConnectedServer,
                               .client_record = 0x1280,
                               .server_record = 0x1201,
                               .request = 0x681,
                               .response = 0x680,
                               .state = manager::ConnectionState::open}};
  EXPECT_EQ(host.data(opening), ReplyData{opened});
  EXPECT_EQ(host.data(execute(ConnectionList{})), ReplyData{opened});
  EXPECT_TRUE(valid(kConnectedClient) && valid(kConnectedServer));
  const std::uint64_t closing = execute(ConnectionClose{.number = 1});
  run();
  EXPECT_EQ(host.answer(closing), Error{});
  EXPECT_EQ(host.data(closing), ReplyData{});
  EXPECT_EQ(host.data(execute(ConnectionList{})), ReplyData{SdoConnections{}});
  EXPECT_FALSE(valid(kConnectedClient) || valid(kConnectedServer));
}

TEST_F(ConnectionServiceTest, AnswersWithTheAbortCode) {
  const std::uint64_t backwards = open(kConnectedServer, kConnectedClient);
  run();
  EXPECT_EQ(host.answer(backwards), to_error(AbortCode::no_object)) << "no client, no server";
}

TEST_F(ConnectionServiceTest, ANodeThatBootsLosesItsConnections) {
  open();
  run();
  service.boot_up(kConnectedServer, parts.now);
  run();
  EXPECT_EQ(host.data(execute(ConnectionList{})), ReplyData{SdoConnections{}});
  EXPECT_FALSE(valid(kConnectedClient) || valid(kConnectedServer));
}

TEST_F(ConnectionServiceTest, EndAnswersOnce) {
  answers = false;
  const std::uint64_t first = open();
  const std::uint64_t second = open();
  run();
  service.end(Refusal::wrong_role, parts.now);
  EXPECT_EQ(host.answer(first), to_error(Refusal::wrong_role));
  EXPECT_EQ(host.answer(second), to_error(Refusal::wrong_role));
  service.end(Refusal::wrong_role, parts.now);
  run();
  EXPECT_FALSE(service.is_ending());
  EXPECT_EQ(host.data(execute(ConnectionList{})), ReplyData{SdoConnections{}});
}

TEST_F(ConnectionServiceTest, ASlaveIgnoresBootUps) {
  open();
  run();
  service.end(Refusal::wrong_role, parts.now);
  host.set_manages(false);
  service.boot_up(kConnectedServer, parts.now);
  service.heartbeat_recovered(kConnectedClient, parts.now);
  can::Frame none;
  run();
  EXPECT_FALSE(parts.node.transmit().pop_rest(none));
}

// --- the configuration ---------------------------------------------------------------------------

std::string errors_of(const LineConfig& config) {
  std::string out;
  for (const Diagnostic& each : Line::make(config).diagnostics) {
    out += each.text + '\n';
  }
  return out;
}

TEST(ConnectionPool, HasTwoCanIdsForEach) {
  EXPECT_EQ((manager::ConnectionPool{}.pairs()), 0U);
  EXPECT_EQ((manager::ConnectionPool{0x680, 0x680}.pairs()), 0U);
  EXPECT_EQ((manager::ConnectionPool{0x680, 0x681}.pairs()), 1U);
  EXPECT_EQ((manager::ConnectionPool{0x680, 0x682}.pairs()), 1U);
  EXPECT_EQ((manager::ConnectionPool{0x680, 0x6DF}.pairs()), 48U);
}

TEST(ConnectionPool, IsCheckedAgainstAllThatIsKnown) {
  const LineConfig config = config_with_axis();
  EXPECT_EQ(errors_of(config_with_pool(config, {0x680, 0x6DF})), "");
  EXPECT_THAT(errors_of(config_with_pool(config, {0x6D0, 0x6E0})),
              HasSubstr("sdo_connections: 6E0h is restricted"));
  EXPECT_THAT(errors_of(config_with_pool(config, {0x681, 0x680})), HasSubstr("two CAN-IDs"));
  EXPECT_THAT(errors_of(config_with_pool(config, {0x80, 0x90})), HasSubstr("080h is that of SYNC"));
  EXPECT_THAT(errors_of(config_with_pool(config, {0x81, 0x90})),
              HasSubstr("085h is that of the EMCY of axis"));
  EXPECT_THAT(errors_of(config_with_pool(config, {0x181, 0x190})),
              HasSubstr("185h is that of TPDO 1 of axis"));
  EXPECT_THAT(errors_of(config_with_pool(config, {0x900, 0x901})), HasSubstr("11 bits"));
  LineConfig connected = config;
  connected.nodes[0].objects.push_back(
      {{0x1280, 1}, {std::byte{0x85}, std::byte{6}, std::byte{0}, std::byte{0}}});
  EXPECT_THAT(errors_of(config_with_pool(connected, {0x680, 0x6DF})),
              HasSubstr("685h is that of object 1280h of axis"));
}

}  // namespace
}  // namespace linegate::line

// SPDX-License-Identifier: Apache-2.0
// Further SDO servers and clients of a node: 1200h to 127Fh and 1280h to 12FFh.
#include "stack/node/sdo_clients.h"

#include "tests/stack/node/node_fixture.h"

namespace linegate::node {
namespace {

using enum od::DataType;

constexpr std::uint32_t kNotValid = 0x8000'0000;
constexpr std::uint32_t kExtendedId = 0x2000'0000;

od::ObjectDescription channel(std::uint16_t index, std::uint32_t request, std::uint32_t response) {
  return testing::record(
      index,
      {testing::sub(0, unsigned8, 3, od::Access::constant), testing::sub(1, unsigned32, request),
       testing::sub(2, unsigned32, response), testing::sub(3, unsigned8, 0)});
}

// A pair of identifiers for each of 128 channels.
std::uint32_t request_id(unsigned number) {
  return 0x10000 + 2 * number;
}
std::uint32_t response_id(unsigned number) {
  return request_id(number) + 1;
}

std::unique_ptr<Node> make_node(const std::vector<od::ObjectDescription>& channels,
                                EventLog& events, std::uint8_t id = kNodeId) {
  od::Dictionary dictionary = example_dictionary();
  for (const od::ObjectDescription& each : channels) {
    EXPECT_TRUE(dictionary.add(each).ok());
  }
  return std::make_unique<Node>(std::move(dictionary), Options{.node_id = id}, events, nullptr);
}

TEST_F(NodeTest, TheDefaultSdoServerShowsItsIdentifiersAndKeepsThem) {
  node = make_node({channel(0x1200, 0x123, 0x124)}, events);
  boot();
  EXPECT_EQ(number(0x1200, 1), 0x605U);
  EXPECT_EQ(number(0x1200, 2), 0x585U);
  EXPECT_EQ(sdo_write({0x1200, 1}, 4, 0x606), 0x0601'0002U);
  EXPECT_EQ(sdo_write({0x1200, 2}, 4, kNotValid), 0x0601'0002U);
  nmt(0x82);
  boot();
  EXPECT_EQ(sdo_write({0x2000, 1}, 2, 1), 0U);
}

struct CobIdRow {
  std::uint32_t value;
  std::uint32_t server;  // abort code of a write of value to sub 1 of 1201h
  std::uint32_t client;  // abort code of the same write to 1280h
};

class SdoCobIds : public NodeTest {
 protected:
  SdoCobIds() {
    node = make_node({channel(0x1201, kNotValid, kNotValid), channel(0x1280, kNotValid, kNotValid)},
                     events);
    boot();
  }
};

TEST_F(SdoCobIds, WhatMayBeWritten) {
  constexpr std::uint32_t kBad = 0x0609'0030;
  const CobIdRow rows[] = {
      {0x6C0, 0, 0},
      {0x4000'06C0, 0, 0},  // assigned dynamically
      {kExtendedId | 0x1234567, 0, 0},
      {kNotValid | 0x000, 0, 0},  // not valid: the other bits are not checked
      {kNotValid | 0x7FF, 0, 0},
      {0x000, kBad, kBad},  // restricted CAN-ID
      {0x07F, kBad, kBad},
      {0x101, kBad, kBad},
      {0x606, kBad, 0},  // of a default server: permitted for a client only
      {0x586, kBad, kBad},
      {0x701, kBad, kBad},
      {0x0000'0800, kBad, kBad},  // reserved bits of an 11-bit identifier
      {0x1000'06C0, kBad, kBad},
      {0x1000'0606, kBad, kBad},
  };
  for (const CobIdRow& row : rows) {
    SCOPED_TRACE(row.value);
    EXPECT_EQ(sdo_write({0x1201, 1}, 4, kNotValid), 0U);
    EXPECT_EQ(sdo_write({0x1280, 1}, 4, kNotValid), 0U);
    EXPECT_EQ(sdo_write({0x1201, 1}, 4, row.value), row.server);
    EXPECT_EQ(sdo_write({0x1280, 1}, 4, row.value), row.client);
  }
}

TEST_F(SdoCobIds, ChangeOnlyWhileNotValid) {
  for (const std::uint16_t index : {std::uint16_t{0x1201}, std::uint16_t{0x1280}}) {
    EXPECT_EQ(sdo_write({index, 2}, 4, 0x6C1), 0U);
    EXPECT_EQ(sdo_write({index, 2}, 4, 0x6C1), 0U);
    EXPECT_EQ(sdo_write({index, 2}, 4, 0x6C2), 0x0609'0030U);
    EXPECT_EQ(sdo_write({index, 2}, 4, 0x4000'06C1), 0x0609'0030U);
    EXPECT_EQ(sdo_write({index, 2}, 4, kNotValid | 0x6C1), 0U);
    EXPECT_EQ(sdo_write({index, 2}, 4, 0x6C2), 0U);
    EXPECT_EQ(sdo_write({index, 3}, 1, 127), 0U);
    EXPECT_EQ(sdo_write({index, 3}, 1, 128), 0x0609'0030U);
  }
}

// Two channels with one identifier would receive the frames of each other.
TEST_F(NodeTest, AnIdentifierOfAnotherChannelIsRefused) {
  for (const std::uint16_t first : {std::uint16_t{0x1201}, std::uint16_t{0x1280}}) {
    const auto second = static_cast<std::uint16_t>(first + 1);
    node = make_node(
        {channel(first, 0x206, 0x186), channel(second, kNotValid | 0x206, kNotValid | 0x186)},
        events);
    boot();
    EXPECT_EQ(sdo_write({second, 1}, 4, 0x206), 0x0609'0030U);
    EXPECT_EQ(sdo_write({second, 2}, 4, 0x186), 0x0609'0030U);
    EXPECT_EQ(sdo_write({second, 1}, 4, kExtendedId | 0x206), 0U);
    EXPECT_EQ(sdo_write({first, 2}, 4, kNotValid | 0x186), 0U);
    EXPECT_EQ(sdo_write({second, 2}, 4, 0x186), 0U);
  }
}

TEST_F(NodeTest, TheFirstOfTwoChannelsDescribedWithOneIdentifierIsValid) {
  node = make_node({channel(0x1201, 0x206, 0x186), channel(0x1202, 0x206, 0x187),
                    channel(0x1280, 0x306, 0x286), channel(0x1281, 0x307, 0x286)},
                   events);
  boot();
  hear(0ms, 0x206, {0x40, 0x00, 0x10, 0, 0, 0, 0, 0});
  const std::vector<Sent> answers = drain(at(0ms));
  ASSERT_EQ(answers.size(), 1U);
  EXPECT_EQ(answers[0].id, 0x186U);
  EXPECT_TRUE(node->sdo_clients().client(1).ok());
  EXPECT_EQ(node->sdo_clients().client(2).error(), to_error(AbortCode::sdo_connection));
}

TEST_F(NodeTest, AllSdoServersAnswer) {
  std::vector<od::ObjectDescription> channels;
  for (unsigned i = 0; i < 128; ++i) {
    channels.push_back(channel(static_cast<std::uint16_t>(0x1200 + i), kExtendedId | request_id(i),
                               kExtendedId | response_id(i)));
  }
  node = make_node(channels, events);
  boot();
  for (unsigned i = 1; i < 128; ++i) {
    can::Frame ask = frame_at(at(1ms), request_id(i), {0x40, 0x00, 0x20, 0x01, 0, 0, 0, 0});
    ask.flags = can::Frame::kExtended;
    node->receive({&ask, 1});
    EXPECT_EQ(
        drain(at(1ms)),
        (std::vector<Sent>{{at(1ms), response_id(i), {0x4B, 0x00, 0x20, 0x01, 0x11, 0x11, 0, 0}}}));
  }
  EXPECT_EQ(sdo_write({0x2000, 1}, 2, 1), 0U);
}

TEST_F(NodeTest, AnSdoServerAddedAtRunTimeAnswersAfterAReset) {
  boot();
  ASSERT_TRUE(node->dictionary().add(channel(0x1205, 0x6C0, 0x6C1)).ok());
  nmt(0x82);
  drain(at(0ms));
  hear(1ms, 0x6C0, {0x40, 0x00, 0x20, 0x01, 0, 0, 0, 0});
  EXPECT_EQ(drain(at(1ms)).at(0).id, 0x6C1U);
}

// Together with an sdo::Arbiter, see Options.
TEST_F(NodeTest, SdoClientsMayBeKeptFromDefaultServers) {
  od::Dictionary dictionary = example_dictionary();
  ASSERT_TRUE(dictionary.add(channel(0x1280, 0x606, 0x586)).ok());
  ASSERT_TRUE(dictionary.add(channel(0x1281, kNotValid, kNotValid)).ok());
  ASSERT_TRUE(dictionary.add(channel(0x1282, 0x6C0, 0x6C1)).ok());
  node = std::make_unique<Node>(std::move(dictionary),
                                Options{.node_id = kNodeId, .clients_of_default_servers = false},
                                events, nullptr);
  boot();
  const auto why_not = [this](std::uint16_t number) {
    const Result<sdo::Client*> found = node->sdo_clients().client(number);
    return found.ok() ? 0 : found.error().code;
  };
  EXPECT_EQ(why_not(1), static_cast<std::uint32_t>(AbortCode::sdo_connection)) << "as documented";
  EXPECT_EQ(why_not(3), 0U);
  EXPECT_EQ(sdo_write({0x1280, 1}, 4, 0x606), 0x0609'0030U);
  EXPECT_EQ(sdo_write({0x1281, 1}, 4, 0x606), 0x0609'0030U);
  EXPECT_EQ(sdo_write({0x1281, 2}, 4, 0x586), 0x0609'0030U);
  EXPECT_EQ(sdo_write({0x1281, 2}, 4, 0x4000'0586), 0x0609'0030U);
  EXPECT_EQ(sdo_write({0x1281, 2}, 4, 0x6C2), 0U);
  const std::uint64_t unused = node->counters().unused;
  hear(1ms, 0x586, {0x43, 0x00, 0x10, 0, 0, 0, 0, 0});
  EXPECT_EQ(node->counters().unused, unused + 1);
}

// Two nodes on a bus: the node of the fixture has the servers, the other one the clients.
class SdoClientsTest : public NodeTest {
 protected:
  SdoClientsTest() {
    std::vector<od::ObjectDescription> servers;
    std::vector<od::ObjectDescription> clients;
    for (unsigned i = 0; i < 128; ++i) {
      const auto offset = static_cast<std::uint16_t>(i);
      const std::uint32_t request = i == 0 ? 0x605 : kExtendedId | request_id(i);
      const std::uint32_t response = i == 0 ? 0x585 : kExtendedId | response_id(i);
      servers.push_back(channel(static_cast<std::uint16_t>(0x1200 + offset), request, response));
      clients.push_back(channel(static_cast<std::uint16_t>(0x1280 + offset), request, response));
    }
    node = make_node(servers, events);
    boot();
    other = make_node(clients, events, 6);
    other->start(at(0ms));
    exchange();
    testing::pop_events(events);
  }

  // Delivers frames until neither node sends any.
  void exchange() {
    for (bool any = true; any;) {
      now += 100us;
      any = pass(*other, *node) || pass(*node, *other);
      const bool due = now >= node->next_wake() || now >= other->next_wake();
      node->advance(now);
      other->advance(now);
      any = any || due;
    }
  }
  bool pass(Node& from, Node& to) {
    can::Frame frame;
    if (!from.next_frame(frame, now)) {
      return false;
    }
    frame.time = now;
    to.receive({&frame, 1});
    return true;
  }
  sdo::Client& client(std::uint16_t number) {
    const Result<sdo::Client*> found = other->sdo_clients().client(number);
    EXPECT_TRUE(found.ok()) << number;
    return **found;
  }
  std::uint32_t why_not(std::uint16_t number) {
    const Result<sdo::Client*> found = other->sdo_clients().client(number);
    return found.ok() ? 0 : found.error().code;
  }

  std::unique_ptr<Node> other;
  Instant now = at(1ms);
};

TEST_F(SdoClientsTest, EachClientReachesItsServer) {
  for (std::uint16_t number = 1; number <= 128; ++number) {
    SCOPED_TRACE(number);
    sdo::Client& used = client(number);
    used.write({0x2000, 1}, {std::byte{1}, static_cast<std::byte>(number)}, 500ms, now,
               other->transmit());
    exchange();
    EXPECT_EQ(used.take()->abort, AbortCode::none);
    EXPECT_EQ(this->number(0x2000, 1), 1U | static_cast<unsigned>(number) << 8U);
    used.read({0x2001, 1}, 500ms, now, other->transmit());
    exchange();
    EXPECT_EQ(used.take()->data, (std::vector{std::byte{0x11}, std::byte{0x11}}));
  }
}

TEST_F(SdoClientsTest, AllAtOnceInBlocks) {
  const std::vector<std::byte> value(3000, std::byte{0x5A});
  ASSERT_TRUE(node->dictionary().add(testing::object(0x2100, domain, 0)).ok());
  for (std::uint16_t number = 2; number <= 20; ++number) {
    client(number).write({0x2100, 0}, value, 500ms, now, other->transmit());
  }
  exchange();
  for (std::uint16_t number = 2; number <= 20; ++number) {
    EXPECT_EQ(client(number).take()->abort, AbortCode::none);
  }
  EXPECT_EQ(node->dictionary().find({0x2100, 0})->size, 3000U);
}

TEST_F(SdoClientsTest, AClientThatIsNotThereOrNotValidHasNoConnection) {
  constexpr auto kNoConnection = static_cast<std::uint32_t>(AbortCode::sdo_connection);
  EXPECT_EQ(why_not(0), kNoConnection);
  EXPECT_EQ(why_not(129), kNoConnection);
  ASSERT_TRUE(other->dictionary().set({0x1281, 2}, kNotValid));
  EXPECT_EQ(why_not(2), kNoConnection);
  ASSERT_TRUE(other->dictionary().set({0x1281, 2}, kExtendedId | response_id(1)));
  EXPECT_EQ(why_not(2), 0U);
  client(2).read({0x2001, 1}, 500ms, now, other->transmit());
  EXPECT_EQ(why_not(2), kNoConnection);  // one transfer at a time
}

TEST_F(SdoClientsTest, AResetEndsTransfersWithoutAConnection) {
  sdo::Client& used = client(2);
  used.read({0x2001, 1}, 500ms, now, other->transmit());
  other->command(nmt::Command::reset_communication, now);
  EXPECT_EQ(used.take()->abort, AbortCode::sdo_connection);
  used.read({0x2001, 1}, 500ms, now, other->transmit());
  ASSERT_TRUE(other->dictionary().set({0x1281, 1}, kNotValid));
  other->advance(now);
  EXPECT_EQ(used.take()->abort, AbortCode::sdo_connection);
}

TEST_F(SdoClientsTest, NoAnswerIsATimeOut) {
  sdo::Client& used = client(2);
  used.read({0x2001, 1}, 500ms, now, other->transmit());
  EXPECT_EQ(other->next_wake(), now + 500ms);
  other->advance(now + 500ms);
  EXPECT_EQ(used.take()->abort, AbortCode::timeout);
}

TEST_F(SdoClientsTest, AMalformedAnswerIsCountedAndTold) {
  client(2).read({0x2001, 1}, 500ms, now, other->transmit());
  can::Frame answer = frame_at(now, response_id(1), {0x4B, 0x01, 0x20});
  answer.flags = can::Frame::kExtended;
  other->receive({&answer, 1});
  EXPECT_EQ(other->counters().malformed, 1U);
  EXPECT_EQ(testing::pop_events(events).at(0).kind(), EventKind::malformed_frame);
  exchange();
  EXPECT_EQ(client(2).take()->abort, AbortCode::none);
}

}  // namespace
}  // namespace linegate::node

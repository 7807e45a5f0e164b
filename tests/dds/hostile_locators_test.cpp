// SPDX-License-Identifier: Apache-2.0
// Whatever locators are announced, a gateway with images by multicast goes on, and sends to its own
// group alone.
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <linegatePubSubTypes.h>

#include "tests/dds/fixtures.h"
#include "tests/dds/guard/datagram.h"
#include "tests/dds/guard/forger.h"
#include "tests/dds/image_traffic.h"

namespace linegate::test {
namespace {

namespace entity = dds::guard::entity;

constexpr unsigned kUnicast = 0x2F;  // IDs of locators, RTPS 2.3 table 9.13
constexpr unsigned kMulticast = 0x30;
constexpr unsigned kDefaultUnicast = 0x31;
constexpr unsigned kMetatrafficUnicast = 0x32;
constexpr unsigned kMetatrafficMulticast = 0x33;
constexpr unsigned kDefaultMulticast = 0x48;

constexpr std::uint32_t kGroup = 0xEFFF4C47;  // 239.255.76.71
constexpr std::uint32_t kForeign = 0xEF070707;
constexpr std::uint32_t kHost = 0x7F000001;

std::uint16_t group_port() {
  return static_cast<std::uint16_t>(7401 + 250 * domain());
}

struct Announced {
  unsigned id;
  std::uint32_t address;
  std::uint32_t port;
  std::uint32_t kind = 1;
};

Fields locator(const Announced& it) {
  Fields out;
  out.u32(it.kind).u32(it.port).zeros(12);
  for (unsigned shift = 32; shift != 0; shift -= 8)
    out.u8(it.address >> (shift - 8) & 0xFF);
  return out;
}

Fields guid(Sender sender, std::uint32_t id) {
  Fields out;
  for (const std::uint8_t octet : dds::guard::make_guid(prefix_of(sender), id))
    out.u8(octet);
  return out;
}

void add_locators(Fields& list, const std::vector<Announced>& locators) {
  for (const Announced& it : locators)
    list.parameter(it.id, locator(it));
}

// A participant that exists in its announcements alone, with readers of process images.
class LocatorAnnouncer {
 public:
  explicit LocatorAnnouncer(Sender sender) : sender_(sender) {}

  void announce(const std::vector<Announced>& locators) {
    Fields list;
    list.u8(0).u8(3).u16(0);
    list.parameter(0x15, Fields().u8(2).u8(3).zeros(2));
    list.parameter(0x16, Fields().u8(1).u8(0x0F).zeros(2));
    list.parameter(0x50, guid(sender_, 0x000001C1));
    list.parameter(0x02, Fields().u32(600).zeros(4));
    list.parameter(0x58, Fields().u32(0x0C3F));
    add_locators(list, locators);
    send(entity::kParticipants, ++participants_, list);
  }
  void announce_reader(std::uint32_t number, const std::vector<Announced>& locators,
                       const std::vector<std::string>& topics = {v1::TOPIC_PROCESS_IMAGE}) {
    Fields list;
    list.u8(0).u8(3).u16(0);
    list.parameter(0x5A, guid(sender_, 0x00000007 | number << 8U));
    list.parameter(0x50, guid(sender_, 0x000001C1));
    for (const std::string& topic : topics)
      list.parameter(0x05, Fields().string(topic));
    list.parameter(0x07, Fields().string(type_of(topics.back())));
    list.parameter(0x1D, Fields().u32(1));                          // transient-local
    list.parameter(0x1A, Fields().u32(2).u32(0).u32(100'000'000));  // reliable
    add_locators(list, locators);
    send(entity::kSubscriptions, ++readers_, list);
  }
  void announce_writer(std::uint32_t number, const std::vector<Announced>& locators) {
    Fields list;
    list.u8(0).u8(3).u16(0);
    list.parameter(0x5A, guid(sender_, 0x00000002 | number << 8U));
    list.parameter(0x50, guid(sender_, 0x000001C1));
    list.parameter(0x05, Fields().string(v1::TOPIC_PROCESS_IMAGE));
    list.parameter(0x07, Fields().string(type_of(v1::TOPIC_PROCESS_IMAGE)));
    list.parameter(0x1D, Fields().u32(1));                          // transient-local
    list.parameter(0x1A, Fields().u32(2).u32(0).u32(100'000'000));  // reliable
    add_locators(list, locators);
    send(entity::kPublications, ++writers_, list);
  }

 private:
  static std::string type_of(const std::string& topic) {
    if (topic == v1::TOPIC_LINE_STATE)
      return v1::LineStatePubSubType().getName();
    return topic == v1::TOPIC_COMMAND_REQUEST ? v1::CommandRequestPubSubType().getName()
                                              : v1::ProcessImagePubSubType().getName();
  }
  // Several times, in case that one is lost.
  void send(std::uint32_t writer, std::int64_t number, Fields& list) {
    list.sentinel();
    Datagram datagram(sender_);
    datagram.add(0x15, data(number, writer).octets(list.get()), kHasData);
    for (int i = 0; i < 3; ++i)
      forger_.unicast(datagram.get());
  }

  Forger forger_;
  Sender sender_;
  std::int64_t participants_ = 0;
  std::int64_t readers_ = 0;
  std::int64_t writers_ = 0;
};

class HostileLocators : public testing::Test {
 protected:
  void SetUp() override {
    ASSERT_TRUE(traffic.ok());
    ASSERT_FALSE(gateway.expect("ready").empty());
    ASSERT_FALSE(client.expect("image ").empty());
    traffic.begin();
    traffic.only_of(gateway.process());
    traffic.only_of(client.process());
  }
  // The gateway continues: the client, and a new one, receive images. It ends as usual.
  void TearDown() override {
    EXPECT_TRUE(images_go_on(client));
    Peer late("multicast_subscriber");
    EXPECT_TRUE(images_go_on(late));
    Peer usual("subscriber");
    EXPECT_TRUE(images_go_on(usual));
    traffic.read();
    EXPECT_TRUE(traffic.groups.contains({kGroup, group_port()}));
    for (const ImageTraffic::Place& place : traffic.groups) {
      EXPECT_TRUE(place == ImageTraffic::Place(kGroup, group_port()) ||
                  place == ImageTraffic::Place(0xEFFF0001, group_port() - 1))
          << std::hex << place.first << std::dec << ':' << place.second;
    }
    EXPECT_TRUE(gateway.end()) << "the gateway ended unexpectedly";
    EXPECT_TRUE(client.end()) << "the client ended unexpectedly";
  }
  // The library has processed what was announced, and the gateway has written after it.
  bool images_go_on(Peer& subscriber) {
    for (int i = 0; i < 25; ++i) {
      if (subscriber.expect("image ").empty())
        return false;
    }
    return true;
  }
  static std::vector<Announced> own_locators(unsigned unicast, unsigned metatraffic) {
    return {{unicast, kHost, 9}, {metatraffic, kHost, 9}};
  }

  ImageTraffic traffic;
  Peer gateway{"multicast_gateway"};
  Peer client{"multicast_subscriber"};
  LocatorAnnouncer first{101};
  LocatorAnnouncer second{102};
};

TEST_F(HostileLocators, UnicastAndTheGroup) {
  for (auto [announcer, port] : {std::pair{&first, 20'001U}, {&second, 20'002U}}) {
    announcer->announce(own_locators(kDefaultUnicast, kMetatrafficUnicast));
    announcer->announce_reader(1, {{kUnicast, kHost, port}, {kMulticast, kGroup, group_port()}});
    EXPECT_TRUE(images_go_on(client));
  }
}

TEST_F(HostileLocators, UnicastAndAForeignGroup) {
  for (auto [announcer, port] : {std::pair{&first, 20'001U}, {&second, 20'002U}}) {
    announcer->announce(own_locators(kDefaultUnicast, kMetatrafficUnicast));
    announcer->announce_reader(1, {{kMulticast, kForeign, 27'777}, {kUnicast, kHost, port}});
    EXPECT_TRUE(images_go_on(client));
  }
}

TEST_F(HostileLocators, NoUnicastLocatorAtAll) {
  first.announce(own_locators(kDefaultUnicast, kMetatrafficUnicast));
  second.announce({});
  for (const std::uint32_t address : {kForeign, kGroup}) {
    for (std::uint32_t reader = 1; reader <= 3; ++reader) {
      first.announce_reader(reader, {{kMulticast, address, group_port()}});
      second.announce_reader(reader, {{kMulticast, address, 27'777}});
      EXPECT_TRUE(images_go_on(client));
    }
  }
}

// The locators of the participant count for its readers without any.
TEST_F(HostileLocators, AGroupForAllReadersOfAParticipant) {
  for (LocatorAnnouncer* announcer : {&first, &second}) {
    announcer->announce(
        {{kMetatrafficUnicast, kHost, 9}, {kDefaultMulticast, kGroup, group_port()}});
    announcer->announce_reader(1, {});
    announcer->announce_reader(2, {{kMulticast, kForeign, 27'777}});
    announcer->announce_reader(3, {}, {v1::TOPIC_LINE_STATE});
  }
}

TEST_F(HostileLocators, NoLocatorAtAll) {
  first.announce({});
  second.announce({});
  first.announce_reader(1, {});
  second.announce_reader(1, {});
}

TEST_F(HostileLocators, DefaultAndMetatrafficGroupsOfParticipants) {
  const std::vector<Announced> groups = {{kDefaultMulticast, kForeign, 27'777},
                                         {kMetatrafficMulticast, kForeign, 27'778},
                                         {kDefaultUnicast, kHost, 20'001},
                                         {kMetatrafficUnicast, kHost, 20'002}};
  first.announce(groups);
  second.announce({groups[0], groups[1]});
  for (std::uint32_t reader = 1; reader <= 3; ++reader) {
    first.announce_reader(reader, {});
    second.announce_reader(reader, {});
  }
}

TEST_F(HostileLocators, GroupsAsUnicastLocators) {
  first.announce({{kDefaultUnicast, kForeign, 27'777}, {kMetatrafficUnicast, kForeign, 27'777}});
  second.announce({{kDefaultUnicast, kGroup, 27'777}, {kMetatrafficUnicast, kGroup, 27'777}});
  first.announce_reader(1, {{kUnicast, kForeign, 27'777}});
  second.announce_reader(1, {{kUnicast, kGroup, group_port()}, {kUnicast, kHost, 20'001}});
}

TEST_F(HostileLocators, OtherPortsAndKindsOfTheGroup) {
  first.announce(own_locators(kDefaultUnicast, kMetatrafficUnicast));
  second.announce(own_locators(kDefaultUnicast, kMetatrafficUnicast));
  const std::uint32_t logical = std::uint32_t{group_port()} | 0x10000U;
  for (LocatorAnnouncer* announcer : {&first, &second}) {
    announcer->announce_reader(1, {{kUnicast, kHost, 20'001}, {kMulticast, kGroup, 7400}});
    announcer->announce_reader(2, {{kUnicast, kHost, 20'002}, {kMulticast, kGroup, logical}});
    announcer->announce_reader(3, {{kUnicast, kHost, 20'003}, {kMulticast, kGroup, 0}});
    announcer->announce_reader(4, {{kMulticast, kGroup, group_port(), 2}});
    announcer->announce_reader(5, {{kMulticast, kGroup, group_port(), 0x01000000}});
    announcer->announce_reader(6, {{kMulticast, kGroup, group_port(), 4}});
  }
}

TEST_F(HostileLocators, OtherTopicsToTheGroup) {
  first.announce(own_locators(kDefaultUnicast, kMetatrafficUnicast));
  second.announce(own_locators(kDefaultUnicast, kMetatrafficUnicast));
  for (auto [announcer, port] : {std::pair{&first, 20'001U}, {&second, 20'002U}}) {
    const std::vector<Announced> both = {{kUnicast, kHost, port},
                                         {kMulticast, kGroup, group_port()}};
    announcer->announce_reader(1, both, {v1::TOPIC_LINE_STATE});
    announcer->announce_reader(2, both, {v1::TOPIC_PROCESS_IMAGE, v1::TOPIC_LINE_STATE});
    announcer->announce_reader(3, both, {v1::TOPIC_LINE_STATE, v1::TOPIC_PROCESS_IMAGE});
    EXPECT_TRUE(images_go_on(client));
  }
  EXPECT_TRUE(images_go_on(client));
  traffic.read();
  std::set<dds::guard::Guid> writers;
  for (const auto& [sample, places] : traffic.samples) {
    if (places.contains({kGroup, group_port()}))
      writers.insert(sample.first);
  }
  EXPECT_EQ(writers.size(), 1U);  // of the images of the line's inputs
}

TEST_F(HostileLocators, ThousandsOfLocators) {
  first.announce(own_locators(kDefaultUnicast, kMetatrafficUnicast));
  second.announce(own_locators(kDefaultUnicast, kMetatrafficUnicast));
  std::vector<Announced> many;
  for (std::uint32_t i = 0; i < 1'000; ++i) {
    many.push_back({kMulticast, kForeign + i, 27'777 + i});
    many.push_back({kUnicast, kHost, 20'000 + i});
  }
  first.announce_reader(1, many);
  many.insert(many.begin() + 900, 100, {kMulticast, kGroup, group_port()});
  second.announce_reader(1, many);
}

// A client has writers, too, and sends to the writers that it receives from.
TEST_F(HostileLocators, EndpointsThatMatchThoseOfAClient) {
  for (auto [announcer, port] : {std::pair{&first, 20'001U}, {&second, 20'002U}}) {
    announcer->announce(own_locators(kDefaultUnicast, kMetatrafficUnicast));
    for (const std::uint32_t address : {kGroup, kForeign}) {
      const std::vector<Announced> both = {{kUnicast, kHost, port},
                                           {kMulticast, address, group_port()}};
      announcer->announce_reader(address == kGroup ? 1 : 2, both, {v1::TOPIC_COMMAND_REQUEST});
      announcer->announce_writer(address == kGroup ? 1 : 2, both);
    }
    announcer->announce_writer(3, {{kMulticast, kForeign, 27'777}});
    EXPECT_TRUE(images_go_on(client));
  }
}

TEST_F(HostileLocators, AReaderChangesItsLocators) {
  const Announced unicast{kUnicast, kHost, 20'001};
  const Announced other{kUnicast, kHost, 20'002};
  const Announced multicast{kMulticast, kGroup, group_port()};
  const Announced foreign{kMulticast, kForeign, 27'777};
  first.announce(own_locators(kDefaultUnicast, kMetatrafficUnicast));
  second.announce(own_locators(kDefaultUnicast, kMetatrafficUnicast));
  const std::vector<std::vector<Announced>> steps = {{unicast},
                                                     {multicast},
                                                     {unicast, multicast},
                                                     {},
                                                     {foreign},
                                                     {other},
                                                     {foreign, unicast},
                                                     {multicast, foreign},
                                                     {unicast, other, multicast},
                                                     {unicast}};
  for (const std::vector<Announced>& step : steps) {
    first.announce_reader(1, step);
    second.announce_reader(1, {multicast, unicast});
    first.announce_reader(2, step);
    EXPECT_TRUE(images_go_on(client));
    second.announce_reader(1, step);
    EXPECT_TRUE(images_go_on(client));
  }
}

TEST_F(HostileLocators, AParticipantChangesItsLocators) {
  first.announce(own_locators(kDefaultUnicast, kMetatrafficUnicast));
  second.announce(own_locators(kDefaultUnicast, kMetatrafficUnicast));
  first.announce_reader(1, {});
  second.announce_reader(1, {});
  for (const std::uint32_t address : {kForeign, kGroup}) {
    for (LocatorAnnouncer* announcer : {&first, &second}) {
      announcer->announce({{kDefaultMulticast, address, group_port()},
                           {kMetatrafficMulticast, address, group_port()}});
      announcer->announce_reader(2, {});
      EXPECT_TRUE(images_go_on(client));
    }
  }
}

}  // namespace
}  // namespace linegate::test

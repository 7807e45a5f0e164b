// SPDX-License-Identifier: Apache-2.0
// The locators that remain in an announcement, octet by octet.
#include "bridges/dds/guard/announced_locators.h"

#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "tests/dds/guard/datagram.h"
#include "tests/dds/guard/guard_fixture.h"

namespace linegate::test {
namespace {

using dds::guard::Announcer;

constexpr std::uint32_t kGroup = 0xEFFF4C47;  // 239.255.76.71
constexpr std::uint16_t kPort = 7651;
constexpr std::uint32_t kHost = 0x0A000001;
constexpr const char* kTopic = "images";
constexpr unsigned kName = 0x05;
constexpr unsigned kUnicast = 0x2F;
constexpr unsigned kMulticast = 0x30;

dds::guard::MulticastGroup group() {
  return {{239, 255, 76, 71}, kPort, kTopic};
}

class AnnouncedLocators : public testing::TestWithParam<bool> {
 protected:
  const bool little = GetParam();

  // A list, and whether each of its parameters remains.
  using List = std::vector<std::pair<std::pair<unsigned, Fields>, bool>>;

  Fields locator(std::uint32_t address, std::uint32_t port, std::uint32_t kind = 1) const {
    Fields out(little);
    out.u32(kind).u32(port).zeros(12);
    return out.entity(address);  // in this order of octets in any case
  }
  std::pair<unsigned, Fields> unicast() const { return {kUnicast, locator(kHost, 9)}; }
  std::pair<unsigned, Fields> multicast() const { return {kMulticast, locator(kGroup, kPort)}; }
  std::pair<unsigned, Fields> name(const std::string& text = kTopic) const {
    return {kName, Fields(little).string(text)};
  }

  // Only the IDs of the parameters that do not remain become 0.
  void expect_left(const List& list, Announcer announcer = Announcer::reader) const {
    Fields before(little);
    Fields after(little);
    for (const auto& [parameter, remains] : list) {
      before.parameter(parameter.first, parameter.second);
      after.parameter(remains ? parameter.first : 0, parameter.second);
    }
    std::vector<std::uint8_t> octets =
        before.sentinel().parameter(kMulticast, before_of(list)).get();
    dds::guard::confine_locators(octets, little, announcer, group());
    EXPECT_EQ(octets, after.sentinel().parameter(kMulticast, before_of(list)).get());
  }

 private:
  // What follows the sentinel is no parameter.
  Fields before_of(const List& list) const {
    Fields out(little);
    for (const auto& [parameter, remains] : list)
      out.parameter(parameter.first, parameter.second);
    return out.sentinel();
  }
};
INSTANTIATE_TEST_SUITE_P(OctetOrders, AnnouncedLocators, testing::Bool());

TEST_P(AnnouncedLocators, AReaderOfTheTopicKeepsTheGroupAlone) {
  expect_left({{unicast(), false}, {name(), true}, {multicast(), true}, {unicast(), false}});
  expect_left({{multicast(), true}, {multicast(), false}, {name(), true}});
  expect_left({{multicast(), true},
               {{kMulticast, locator(0xEF070707, kPort)}, false},
               {name(), true},
               {{0x31, locator(kHost, 9)}, false},
               {{0x32, locator(kHost, 9)}, false}});
}

TEST_P(AnnouncedLocators, AReaderWithoutTheGroupKeepsItsUnicastLocators) {
  expect_left({{name(), true}, {unicast(), true}});
  for (const Fields& other :
       {locator(kGroup, kPort + 1), locator(kGroup, kPort | 0x10000U), locator(kGroup, 0),
        locator(kGroup + 1, kPort), locator(kGroup, kPort, 2), locator(kGroup, kPort, 0x01000000),
        Fields(little).u32(1).u32(kPort).zeros(11).u8(1).entity(kGroup)})
    expect_left({{unicast(), true}, {{kMulticast, other}, false}, {name(), true}});
}

TEST_P(AnnouncedLocators, AReaderOfAnotherTopicKeepsItsUnicastLocators) {
  for (const std::string other : {"image", "imagesx", "imageS", ""})
    expect_left({{name(other), true}, {multicast(), false}, {unicast(), true}});
  expect_left({{multicast(), false}, {unicast(), true}});
  expect_left({{name(), true}, {name("states"), true}, {multicast(), false}, {unicast(), true}});
  expect_left({{name("states"), true}, {name(), true}, {multicast(), false}, {unicast(), true}});
}

TEST_P(AnnouncedLocators, OthersKeepNoMulticastLocator) {
  const Fields address = Fields(little).entity(kGroup);
  expect_left({{name(), true},
               {multicast(), false},
               {unicast(), true},
               {{0x33, locator(0xEFFF0001, 7400)}, false},
               {{0x48, locator(kGroup, kPort)}, false},
               {{0x0B, address}, false},
               {{0x11, address}, false}},
              Announcer::other);
}

TEST_P(AnnouncedLocators, AUnicastLocatorIsNoGroup) {
  const Fields ipv6 = Fields(little).u32(2).u32(9).u8(0xFF).u8(2).zeros(14);
  const Fields ipv6_host = Fields(little).u32(2).u32(9).u8(0xFE).u8(0x80).zeros(10).entity(kGroup);
  for (const Announcer announcer : {Announcer::reader, Announcer::other}) {
    for (const unsigned id : {0x2FU, 0x31U, 0x32U}) {
      expect_left({{name(), true},
                   {{id, locator(kGroup, kPort)}, false},
                   {{id, locator(0xE0000001, 9)}, false},
                   {{id, locator(0xDFFFFFFF, 9)}, true},
                   {{id, locator(0xF0000001, 9)}, true},
                   {{id, locator(kHost, 9)}, true},
                   {{id, ipv6}, false},
                   {{id, ipv6_host}, true}},
                  announcer);
    }
  }
}

// The announcement in a datagram, as the guard passes it on.
class ConfinedAnnouncements : public GuardTest {
 protected:
  static Fields endpoint(std::uint32_t id) {
    Fields out;
    for (const std::uint8_t octet : dds::guard::make_guid(prefix_of(Sender{1}), id))
      out.u8(octet);
    return out;
  }
  static Fields group_locator() { return Fields().u32(1).u32(kPort).zeros(12).entity(kGroup); }
  static Fields host_locator() { return Fields().u32(1).u32(9).zeros(12).entity(kHost); }
  // ids: of the parameters of the name, the group and the host.
  static Datagram announcement(std::uint32_t writer, unsigned group_id, unsigned host_id) {
    const Fields list = Fields()
                            .u8(0)
                            .u8(3)
                            .u16(0)
                            .parameter(0x5A, endpoint(kReader))
                            .parameter(kName, Fields().string(kTopic))
                            .parameter(group_id, group_locator())
                            .parameter(host_id, host_locator())
                            .sentinel();
    return Datagram(Sender{1}).add(0x15, data(1, writer).octets(list.get()), kHasData);
  }
  static std::vector<std::uint8_t> passed_on(Datagram datagram, bool confined) {
    Guard guard{false};
    dds::guard::PassedOn out;
    if (confined)
      guard.confine_multicast(group());
    EXPECT_EQ(guard.judge(datagram.get(), 1, {}, &out).reason, Reason::none);
    return {out.octets().begin(), out.octets().end()};
  }
};

TEST_F(ConfinedAnnouncements, OnlyIfAGroupIsSet) {
  const std::uint32_t readers = dds::guard::entity::kSubscriptions;
  const auto usual = passed_on(announcement(readers, kMulticast, kUnicast), false);
  EXPECT_NE(passed_on(announcement(readers, kMulticast, kUnicast), true), usual);
  EXPECT_EQ(passed_on(announcement(readers, kMulticast, kUnicast), true),
            passed_on(announcement(readers, kMulticast, 0), false));
}

TEST_F(ConfinedAnnouncements, OnlyReadersKeepTheGroup) {
  const std::uint32_t writers = dds::guard::entity::kPublications;
  EXPECT_EQ(passed_on(announcement(writers, kMulticast, kUnicast), true),
            passed_on(announcement(writers, 0, kUnicast), false));
}

}  // namespace
}  // namespace linegate::test

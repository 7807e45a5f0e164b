// SPDX-License-Identifier: Apache-2.0
// Process images by multicast: one datagram for all readers that ask for it, and unicast for all
// others.
#include <string>

#include <gtest/gtest.h>

#include "tests/dds/fixtures.h"
#include "tests/dds/image_traffic.h"

namespace linegate::test {
namespace {

ImageTraffic::Place group() {
  return {0xEFFF4C47, static_cast<std::uint16_t>(7401 + 250 * domain())};  // 239.255.76.71
}

class FanOut : public testing::Test {
 protected:
  void SetUp() override { ASSERT_TRUE(traffic.ok()); }

  // Whether the subscriber receives `images` images, each once and in order. A process that does
  // not run for a while skips some, because a reader keeps the newest alone.
  static bool receives(Peer& subscriber, std::uint64_t images = 20) {
    std::uint64_t before = 0;
    for (std::uint64_t i = 0; i < images; ++i) {
      const std::string line = subscriber.expect("image ");
      const std::uint64_t number = line.empty() ? 0 : std::stoull(line.substr(6));
      if (number <= before)
        return false;
      before = number;
    }
    return true;
  }

  // Two subscribers of these kinds receive images of a gateway of that kind. Then `traffic` has
  // what was sent meanwhile.
  void serve(const char* gateway_kind, const char* first_kind, const char* second_kind) {
    Peer gateway(gateway_kind);
    ASSERT_FALSE(gateway.expect("ready").empty());
    Peer first(first_kind);
    Peer second(second_kind);
    ASSERT_FALSE(first.expect("image ").empty());
    ASSERT_FALSE(second.expect("image ").empty());
    traffic.begin();
    EXPECT_TRUE(receives(first));
    EXPECT_TRUE(receives(second));
    traffic.read();
    EXPECT_TRUE(gateway.end());
  }

  // The number of samples that were sent `by_group` times to the group, and `by_unicast` times
  // elsewhere.
  std::size_t images_sent(std::size_t by_group, std::size_t by_unicast) const {
    return count_if([&](std::size_t to_group, std::size_t elsewhere) {
      return to_group == by_group && elsewhere == by_unicast;
    });
  }
  std::size_t samples_to_group() const {
    return count_if([](std::size_t to_group, std::size_t) { return to_group != 0; });
  }

  template <class Wanted>
  std::size_t count_if(Wanted wanted) const {
    std::size_t out = 0;
    for (const auto& [sample, places] : traffic.samples) {
      const std::size_t to_group = places.count(group());
      if (wanted(to_group, places.size() - to_group))
        ++out;
    }
    return out;
  }

  ImageTraffic traffic;
};

TEST_F(FanOut, OneDatagramServesTwoClientsThatAskForIt) {
  ASSERT_NO_FATAL_FAILURE(
      serve("multicast_gateway", "multicast_subscriber", "multicast_subscriber"));
  EXPECT_GT(2 * images_sent(1, 0), samples_to_group());  // some may be repeated
}

TEST_F(FanOut, AClientThatDoesNotAskForItReceivesByUnicast) {
  ASSERT_NO_FATAL_FAILURE(serve("multicast_gateway", "multicast_subscriber", "subscriber"));
  EXPECT_GT(2 * images_sent(1, 1), samples_to_group());  // some may be repeated
}

TEST_F(FanOut, AGatewayWithoutItServesClientsThatAskForItByUnicast) {
  ASSERT_NO_FATAL_FAILURE(serve("image_gateway", "multicast_subscriber", "multicast_subscriber"));
  EXPECT_GT(images_sent(0, 2), 0U);
  EXPECT_EQ(samples_to_group(), 0U);
}

// Each reader would respond to each of them.
TEST_F(FanOut, NoHeartbeatFollowsAnImage) {
  Peer gateway("multicast_gateway");
  ASSERT_FALSE(gateway.expect("ready").empty());
  Peer client("multicast_subscriber");
  ASSERT_FALSE(client.expect("image ").empty());
  traffic.begin();
  EXPECT_TRUE(receives(client, 100));
  traffic.read();
  EXPECT_GT(samples_to_group(), 0U);
  EXPECT_EQ(traffic.piggybacked.count(group()), 0U);
  EXPECT_TRUE(gateway.end());
}

TEST_F(FanOut, ALateClientReceivesThePresentImage) {
  Peer gateway("multicast_gateway");
  ASSERT_FALSE(gateway.expect("ready").empty());
  for (int i = 0; i < 3; ++i) {
    Peer client("multicast_subscriber");
    EXPECT_TRUE(receives(client, 3));
    EXPECT_TRUE(client.end());
  }
  EXPECT_TRUE(gateway.end());
}

}  // namespace
}  // namespace linegate::test

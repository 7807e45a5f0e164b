// SPDX-License-Identifier: Apache-2.0
// Which participants are gateways.
#include "bridges/dds/peer_gateways.h"

#include <chrono>

#include <gmock/gmock.h>

namespace linegate::dds {
namespace {

using namespace std::chrono_literals;
using testing::ElementsAre;

TEST(PeerGateways, AreParticipantsWithTheNameOfAGateway) {
  EXPECT_EQ(gateway_of("linegate hall-7"), "hall-7");
  for (const char* other : {"linegate client host/1/1", "linegate ", "linegate a,b", "rviz", ""}) {
    EXPECT_EQ(gateway_of(other), std::nullopt) << other;
  }
}

TEST(PeerGateways, ComeAndGoWithTheirParticipants) {
  PeerGateways<int> peers(Instant{1s});
  EXPECT_EQ(peers.changed(), Instant{1s});
  peers.come(7, "linegate b", Instant{2s});
  peers.come(8, "linegate a", Instant{3s});
  peers.come(9, "linegate b", Instant{4s});  // restarted, before the old participant has expired
  EXPECT_THAT(peers.names(), ElementsAre("a", "b"));
  peers.come(8, "linegate a", Instant{5s});
  peers.come(10, "linegate client x", Instant{6s});
  EXPECT_EQ(peers.changed(), Instant{4s}) << "neither a client nor a known gateway is a change";
  peers.go(7, Instant{7s});
  EXPECT_THAT(peers.names(), ElementsAre("a", "b"));
  peers.go(9, Instant{8s});
  peers.go(10, Instant{9s});
  EXPECT_THAT(peers.names(), ElementsAre("a"));
  EXPECT_EQ(peers.changed(), Instant{8s});
}

TEST(PeerGateways, AreBounded) {
  PeerGateways<std::size_t> peers(Instant{});
  for (std::size_t i = 0; i < 2 * PeerGateways<std::size_t>::kMost; ++i) {
    peers.come(i, "linegate g" + std::to_string(i), Instant{1s});
  }
  EXPECT_EQ(peers.names().size(), PeerGateways<std::size_t>::kMost);
}

}  // namespace
}  // namespace linegate::dds

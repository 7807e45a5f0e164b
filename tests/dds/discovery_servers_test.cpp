// SPDX-License-Identifier: Apache-2.0
#include "bridges/dds/discovery_servers.h"

#include <gtest/gtest.h>

namespace linegate::dds {
namespace {

TEST(DiscoveryServers, HaveAHostAndPerhapsIdAndPort) {
  EXPECT_EQ(parse_discovery_server("10.0.0.9", 0), (DiscoveryServer{0, "10.0.0.9", 11811}));
  EXPECT_EQ(parse_discovery_server("hall.plant:1", 3), (DiscoveryServer{3, "hall.plant", 1}));
  EXPECT_EQ(parse_discovery_server("255@hall:65535", 3), (DiscoveryServer{255, "hall", 65535}));
  EXPECT_EQ(parse_discovery_server("0@hall", 3), (DiscoveryServer{0, "hall", 11811}));
}

TEST(DiscoveryServers, OtherTextsAreNone) {
  for (const char* const text : {"", ":1", "0@", "@hall", "256@hall", "-1@hall", "x@hall",
                                 "hall:", "hall:0", "hall:65536", "hall:1x", "hall:1:2", "0@:1"}) {
    EXPECT_FALSE(parse_discovery_server(text, 0)) << text;
  }
  EXPECT_FALSE(parse_discovery_server("hall", 256));
  EXPECT_TRUE(parse_discovery_server("9@hall", 256));
}

}  // namespace
}  // namespace linegate::dds

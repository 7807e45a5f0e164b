// SPDX-License-Identifier: Apache-2.0
#include "gateway/runtime/channels.h"

#include <optional>
#include <string>

#include <gtest/gtest.h>

namespace linegate::gateway {
namespace {

can_bridge::ControllerSetup setup_of(const std::string& uri, Use use) {
  std::string error;
  const config::Interface interface = config::parse_interface(uri, "/", error);
  EXPECT_EQ(error, "");
  return controller_setup(interface, use);
}

TEST(Channels, AnObserverListensOnlyUnlessItIsToldOtherwise) {
  const struct {
    const char* options;
    std::optional<bool> transmit;
    std::optional<bool> observe;
  } table[] = {{"?bitrate=500000", std::nullopt, true},
               {"?restart-ms=100", std::nullopt, true},
               {"?bitrate=500000&listen-only=on", true, true},
               {"?bitrate=500000&listen-only=off", false, false}};
  for (const auto& row : table) {
    const std::string uri = std::string("socketcan:can0") + row.options;
    EXPECT_EQ(setup_of(uri, Use::transmit).listen_only, row.transmit) << uri;
    EXPECT_EQ(setup_of(uri, Use::observe).listen_only, row.observe) << uri;
  }
}

TEST(Channels, AnOperatorReadsTheNameThatIpWants) {
  std::string error;
  EXPECT_EQ(name_for_people(config::parse_interface("socketcan:can0?bitrate=500000", "/", error)),
            "can0");
  EXPECT_EQ(name_for_people(config::parse_interface("virtual:a", "/", error)), "virtual:a");
}

// Otherwise the controller would be reconfigured, which the operator did not request.
TEST(Channels, AnInterfaceWithoutOptionsIsLeftAsItIs) {
  EXPECT_FALSE(setup_of("socketcan:can0", Use::observe).any());
  EXPECT_FALSE(setup_of("socketcan:can0?listen-only=off", Use::observe).any());
}

}  // namespace
}  // namespace linegate::gateway

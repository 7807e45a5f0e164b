// SPDX-License-Identifier: Apache-2.0
// Routes that change while a line runs, without any effect on its bus.
#include "stack/base/byte_order.h"
#include "stack/od/objects.h"
#include "stack/routing/emcy_router.h"
#include "stack/routing/table.h"

#include "tests/stack/line/line_fixture.h"

namespace linegate::line {
namespace {

using testing::IsEmpty;

constexpr od::Address kNumberOfRoutes{0x1F2C, 0};

class SetRoutesTest : public LineTest {
 protected:
  static LineConfig routing_config() {
    LineConfig config = config_with_axis();
    config.routing.interface = static_cast<std::uint8_t>(config.network_id);
    config.routing.interfaces = {
        {config.routing.interface, config.network_id, config.node_id, config.name}};
    config.routing.routes = {
        {config.network_id, config.network_id, config.routing.interface, 0, 0}};
    return config;
  }
};

TEST_F(SetRoutesTest, TheTablesChangeAndNothingElse) {
  const LineConfig config = routing_config();
  make(config);
  boot();
  (void)sent();
  (void)events();
  routing::Config wanted = config.routing;
  wanted.interfaces.push_back({99, 99, 1, "hall"});
  wanted.routes.push_back({99, 99, 99, 0, 0});
  wanted.emcy_networks[5] = 1;
  line_->set_routes(wanted, now_);
  pass(Duration{});
  EXPECT_THAT(sent(), IsEmpty());
  EXPECT_TRUE(events().empty());
  od::Dictionary& dictionary = line_->dictionary();
  EXPECT_EQ(dictionary.number(kNumberOfRoutes), 2U);
  EXPECT_EQ(routing::routes_of(dictionary), wanted.routes);
  EXPECT_EQ(dictionary.number({0x5F20, 99}), 99U);
  EXPECT_EQ(dictionary.number({od::objects::kEmcyRouting, 5}), 1U);
  EXPECT_EQ(line_->config().routing.routes, wanted.routes);
  dictionary.reset_values(0x1000, 0xFFFF);
  EXPECT_EQ(dictionary.number(kNumberOfRoutes), 2U) << "they became the default values";

  line_->set_routes(config.routing, now_);
  EXPECT_EQ(dictionary.number(kNumberOfRoutes), 1U);
  EXPECT_FALSE(dictionary.number({0x5F20, 99}));
}

TEST_F(SetRoutesTest, WhatIsWrittenAfterwardsIsCheckedAgainstTheLinesOfToday) {
  const LineConfig config = routing_config();
  make(config);
  boot();
  routing::Config wanted = config.routing;
  wanted.interfaces.push_back({99, 99, 1, "hall"});
  const auto write_route = [&] {
    std::vector<std::byte> data(8);
    store_le(std::span(data), routing::encode(routing::Route{99, 99, 99, 0, 0}));
    return line_->dictionary().write({0x1F2C, 1}, data);
  };
  EXPECT_NE(write_route(), AbortCode::none) << "there is no interface 99";
  line_->set_routes(wanted, now_);
  EXPECT_EQ(write_route(), AbortCode::none);
}

TEST_F(SetRoutesTest, ALineThatDoesNotRouteStaysSo) {
  make(config_with_axis());
  boot();
  line_->set_routes(routing_config().routing, now_);
  EXPECT_FALSE(line_->dictionary().has_object(0x1F2C));
}

}  // namespace
}  // namespace linegate::line

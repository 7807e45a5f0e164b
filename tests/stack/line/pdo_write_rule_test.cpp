// SPDX-License-Identifier: Apache-2.0
#include "stack/line/pdo_write_rule.h"

#include <gtest/gtest.h>

#include "stack/base/byte_order.h"

#include "tests/stack/line/service_fixture.h"

namespace linegate::line {
namespace {

struct PdoWriteRuleTest : testing::Test {
  AbortCode write(std::uint8_t node, std::uint16_t index, std::uint32_t value,
                  std::size_t size = 4) {
    std::vector<std::byte> data(size);
    store_le(std::span(data), value);
    return rule.may_write(node, {index, 0}, data);
  }

  ManagerParts parts;
  manager::Configurator configurator{parts.dictionary, node_plans(parts.config), parts.sdo,
                                     parts.events, milliseconds(500)};
  NodeParts own{parts.config};
  PdoWriteRule rule{parts.config, *own.node, parts.manager, configurator};
};

// Its EMCYs would be taken as the PDO, or the PDO as its SYNC.
TEST_F(PdoWriteRuleTest, NoEmcyOrSyncGetsTheCobIdOfAPdoOfTheImage) {
  constexpr std::uint32_t kOfPdo = 0x185;  // TPDO 1 of node 5
  for (const std::uint16_t index : {std::uint16_t{0x1014}, std::uint16_t{0x1005}}) {
    for (const std::uint8_t node : {std::uint8_t{5}, std::uint8_t{9}}) {
      EXPECT_EQ(write(node, index, kOfPdo), AbortCode::invalid_value);
    }
    EXPECT_EQ(write(5, index, 0x2000'0185), AbortCode::none) << "a 29-bit identifier";
    EXPECT_EQ(write(5, index, 0x85), AbortCode::none);
    EXPECT_EQ(write(5, index, kOfPdo, 2), AbortCode::none) << "the node refuses it";
  }
  EXPECT_EQ(write(5, 0x1014, 0x8000'0000 | kOfPdo), AbortCode::none) << "no EMCYs";
  EXPECT_EQ(write(5, 0x1005, 0x4000'0000 | kOfPdo), AbortCode::invalid_value);
  EXPECT_EQ(write(5, 0x2000, kOfPdo), AbortCode::none);
  parts.manager.stop(parts.now);
  EXPECT_EQ(write(5, 0x1014, kOfPdo), AbortCode::none);
}

}  // namespace
}  // namespace linegate::line

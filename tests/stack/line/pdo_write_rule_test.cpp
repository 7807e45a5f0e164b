// SPDX-License-Identifier: Apache-2.0
#include "stack/line/pdo_write_rule.h"

#include <array>

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
    return rule.may_write(node, {index, 0}, data, parts.now);
  }
  // The transmission type of TPDO 1 of node 5.
  AbortCode write_type(std::uint8_t type, Duration later = {}) {
    const std::byte value{type};
    return rule.may_write(5, {0x1800, 2}, std::span(&value, 1), parts.now + later);
  }
  void set_own(std::uint16_t index, std::uint32_t value) {
    std::array<std::byte, 4> data;
    store_le(data.data(), value);
    ASSERT_EQ(own.node->dictionary().write({index, 0}, data), AbortCode::none);
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

// With a synchronous type the device sends its PDO with SYNC alone.
TEST_F(PdoWriteRuleTest, ThereIsSyncOnlyWhileItIsReceived) {
  constexpr std::uint8_t kEverySync = 1;
  EXPECT_EQ(write_type(254), AbortCode::none);
  EXPECT_EQ(write_type(kEverySync), AbortCode::device_state);
  rule.synced(parts.now);
  EXPECT_EQ(write_type(kEverySync), AbortCode::none);
  EXPECT_EQ(write_type(kEverySync, seconds(10)), AbortCode::none);
  EXPECT_EQ(write_type(kEverySync, seconds(11)), AbortCode::device_state) << "it has ended";
}

TEST_F(PdoWriteRuleTest, TheCommunicationCyclePeriodSaysWhenSyncHasEnded) {
  constexpr std::uint8_t kEverySync = 1;
  set_own(0x1006, 20'000);
  EXPECT_EQ(write_type(kEverySync), AbortCode::device_state);
  rule.synced(parts.now);
  EXPECT_EQ(write_type(kEverySync, milliseconds(30)), AbortCode::none);
  EXPECT_EQ(write_type(kEverySync, milliseconds(31)), AbortCode::device_state);
  set_own(0x1005, 0x4000'0080);
  EXPECT_EQ(write_type(kEverySync, milliseconds(31)), AbortCode::none) << "the own node sends it";
  set_own(0x1006, 0);
  EXPECT_EQ(write_type(kEverySync, seconds(11)), AbortCode::device_state) << "without a period";
}

}  // namespace
}  // namespace linegate::line

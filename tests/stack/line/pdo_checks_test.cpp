// SPDX-License-Identifier: Apache-2.0
// Reports of PDOs that conflict with the other services of their line.
#include "stack/line/pdo_checks.h"

#include <algorithm>

#include "stack/base/byte_order.h"

#include "tests/stack/line/line_fixture.h"

namespace linegate::line {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

void set(NodeConfig& node, od::Address address, std::uint32_t number) {
  for (od::ObjectDescription& object : node.device.objects) {
    for (od::VariableDescription& variable : object.variables) {
      if (object.index == address.index && variable.sub == address.sub) {
        store_le(std::span(variable.value), number);
      }
    }
  }
}

std::vector<std::string> emitted(const LineConfig& config) {
  std::vector<std::string> out;
  for (const Diagnostic& each : Line::make(config).diagnostics) {
    out.push_back((each.severity == Severity::error ? "error: " : "warning: ") + each.text);
  }
  return out;
}

TEST(PdoChecks, APdoIsNotOnTheIdentifierOfAnotherService) {
  LineConfig config = config_with_axis();
  EXPECT_THAT(emitted(config), IsEmpty());
  config.nodes[0].objects.push_back({{0x1014, 0}, {std::byte{0x85}, {}, {}, {}}});
  set(config.nodes[0], {0x1800, 1}, 0x80);
  set(config.nodes[0], {0x1400, 1}, 0x85);
  EXPECT_THAT(emitted(config),
              ElementsAre("error: TPDO 1 of axis has the COB-ID of SYNC",
                          "error: RPDO 1 of axis has the COB-ID of the EMCY of axis"));
  set(config.nodes[0], {0x1800, 1}, 0xFF);
  set(config.nodes[0], {0x1400, 1}, 0x100);
  EXPECT_THAT(emitted(config),
              ElementsAre("error: TPDO 1 of axis has the COB-ID of the EMCY of the "
                          "own node"))
      << "100h is free: the line sends no TIME";
  config.time_period = seconds(1);
  EXPECT_EQ(emitted(config).size(), 2U);
}

ObjectValue own_value(std::uint16_t index, std::uint32_t number) {
  ObjectValue out{{index, 0}, std::vector<std::byte>(sizeof number)};
  store_le(std::span(out.data), number);
  return out;
}

TEST(PdoChecks, TheServicesOfTheOwnNodeAreWhereItsOwnValuesPutThem) {
  LineConfig config = config_with_axis();
  config.time_period = seconds(1);
  config.own_values = {own_value(0x1014, 0x8000'00FF), own_value(0x1014, 0xF1),
                       own_value(0x1005, 0x4000'00F2), own_value(0x1012, 0x4000'00F3)};
  const auto told_of = [&](std::uint32_t tpdo, std::uint32_t rpdo) {
    set(config.nodes[0], {0x1800, 1}, tpdo);
    set(config.nodes[0], {0x1400, 1}, rpdo);
    return emitted(config);
  };
  EXPECT_THAT(told_of(0xF1, 0xF2),
              ElementsAre("error: TPDO 1 of axis has the COB-ID of the EMCY of the own node",
                          "error: RPDO 1 of axis has the COB-ID of SYNC"));
  EXPECT_THAT(told_of(0xF3, 0x205), ElementsAre("error: TPDO 1 of axis has the COB-ID of TIME"));
  EXPECT_THAT(told_of(0xFF, 0x80), IsEmpty()) << "the default identifiers are free";
  config.own_values = {own_value(0x1014, 0x8000'00F1)};
  EXPECT_THAT(told_of(0xF1, 0xFF), IsEmpty()) << "the own node sends no EMCY";
}

TEST(PdoChecks, ANodeThatIsTakenAsItWasFoundRunsNevertheless) {
  LineConfig config = config_with_axis();
  config.nodes[0].as_found = true;
  set(config.nodes[0], {0x1800, 1}, 0x80);
  EXPECT_THAT(emitted(config), ElementsAre("warning: TPDO 1 of axis has the COB-ID of SYNC"));
  EXPECT_TRUE(Line::make(config).ok());
}

TEST(PdoChecks, AnObserverListensToWhatThereIs) {
  LineConfig config = config_with_axis();
  config.role = Role::observer;
  set(config.nodes[0], {0x1800, 1}, 0x80);
  EXPECT_THAT(emitted(config), ElementsAre("warning: TPDO 1 of axis has the COB-ID of SYNC"));
}

// A device that sends no EMCY need not have 1014h; the identifier 85h may then be used for a PDO.
TEST(PdoChecks, TheEmcyOfADeviceWhoseFileHasNoneIsAWarning) {
  LineConfig config = config_with_axis();
  set(config.nodes[0], {0x1400, 1}, 0x85);
  EXPECT_THAT(emitted(config), ElementsAre("warning: RPDO 1 of axis has the COB-ID of the EMCY of "
                                           "axis, if it sends any"));
  EXPECT_TRUE(Line::make(config).ok());
}

TEST(PdoChecks, PdosThatWaitForASyncOfNobodyAreNamed) {
  LineConfig config = config_with_axis();
  EXPECT_FALSE(unsynchronised_pdos(config));
  set(config.nodes[0], {0x1800, 2}, 1);
  set(config.nodes[0], {0x1400, 2}, 0);
  ASSERT_TRUE(unsynchronised_pdos(config));
  EXPECT_EQ(
      to_string(*unsynchronised_pdos(config)),
      "press: warning: TPDO 1 of axis, RPDO 1 of axis: on SYNC, but no node produces SYNC (sync "
      "of the line)");
  LineConfig with_sync = config;
  with_sync.sync_period = milliseconds(10);
  EXPECT_FALSE(unsynchronised_pdos(with_sync));
  LineConfig producer = config;
  producer.nodes[0].objects.push_back({{0x1005, 0}, {std::byte{0x80}, {}, {}, std::byte{0x40}}});
  EXPECT_FALSE(unsynchronised_pdos(producer));
  LineConfig own = config;
  own.own_values.push_back({{0x1006, 0}, {std::byte{1}, {}, {}, {}}});
  EXPECT_FALSE(unsynchronised_pdos(own));
  config.role = Role::observer;
  EXPECT_FALSE(unsynchronised_pdos(config)) << "an observer is not the master";
}

}  // namespace
}  // namespace linegate::line

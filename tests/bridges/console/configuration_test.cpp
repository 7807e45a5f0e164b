// SPDX-License-Identifier: Apache-2.0
// `linegate config` against a simulated gateway.
#include "bridges/console/configuration.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "stack/manager/boot_event.h"

#include "tests/bridges/console/command_test.h"

namespace linegate::console {
namespace {

using manager::BootFinding;
using testing::HasSubstr;

const LineId kForge{"plant", "forge"};

BootFinding wrong_product(std::uint32_t found) {
  return {.kind = BootFinding::Kind::value,
          .object = {0x1018, 2},
          .abort = AbortCode::none,
          .expected = 0x4711,
          .found = found};
}

// Node 6 is not the configured device. An older event reports yet another device.
class ConfiguringGateway : public Client {
 public:
  void poll(Duration /*timeout*/, Listener& listener) override {
    LineView view{.interface_uri = "virtual:forge", .access = "all"};
    view.state.counters.events = 5;
    listener.on_line(kForge, view);
  }
  Answer call(const LineId& /*id*/, const line::Command& /*command*/, Duration /*timeout*/,
              std::uint64_t /*layout_id*/, Listener& listener) override {
    tell(listener, kForge, 7, wrong_product(0x4712));
    tell(listener, kForge, 5, wrong_product(3));
    tell(listener, {"plant", "other"}, 8, wrong_product(4));
    Answer answer;
    answer.reply.data = nodes;
    return answer;
  }

  std::vector<manager::NodeReport> nodes{
      {.node = 6, .boot = 'M', .end = AbortCode::none, .differences = {}}};

 private:
  static void tell(Listener& listener, const LineId& id, std::uint64_t number,
                   const BootFinding& finding) {
    listener.on_event(id, {.number = number,
                           .kind = EventKind::boot_result,
                           .node = 6,
                           .data = manager::boot_result(6, 'M', finding, {}).data,
                           .text = "node 6"});
  }
};

using Configuration = test::CommandTest<ConfiguringGateway>;

TEST_F(Configuration, ADeviceOfWrongIdentityIsToldWithWhatWasExpectedAndFound) {
  EXPECT_EQ(configure(context_, ConfigAction::apply, "forge:6"), kFailed);
  EXPECT_THAT(out_.str(), HasSubstr("1018:02 is 00004712h, not 00004711h (M)"));
  context_.json = true;
  out_.str("");
  EXPECT_EQ(configure(context_, ConfigAction::apply, "forge:6"), kFailed);
  const auto node = nlohmann::json::parse(out_.str())["nodes"][0];
  EXPECT_EQ(node["boot"], "M");
  EXPECT_THAT(node["boot_text"], HasSubstr("not 00004711h"));
  EXPECT_EQ(node["boot_object"], "1018:02");
  EXPECT_EQ(node["boot_expected"], 0x4711);
  EXPECT_EQ(node["boot_found"], 0x4712);
}

TEST_F(Configuration, ADeviceThatIsConfiguredHasNothingOfThat) {
  gateway_.nodes[0].boot = manager::kBooted;
  context_.json = true;
  EXPECT_EQ(configure(context_, ConfigAction::apply, "forge:6"), kDone);
  EXPECT_FALSE(nlohmann::json::parse(out_.str())["nodes"][0].contains("boot_text"));
}

}  // namespace
}  // namespace linegate::console

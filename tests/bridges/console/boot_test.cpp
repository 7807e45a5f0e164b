// SPDX-License-Identifier: Apache-2.0
// `linegate boot` against a simulated gateway.
#include "bridges/console/boot.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "bridges/console/lookup.h"

#include "tests/bridges/console/command_test.h"

namespace linegate::console {
namespace {

using test::as;

using manager::BootFinding;
using manager::BootOutcome;
using testing::HasSubstr;
using testing::Not;

const LineId kBootLine{"plant", "hall"};

class BootingGateway : public Client {
 public:
  void poll(Duration /*timeout*/, Listener& listener) override {
    LineView view{.interface_uri = "virtual:hall", .access = "all"};
    view.state.network_id = 3;
    listener.on_line(kBootLine, view);
  }
  Answer call(const LineId& /*id*/, const line::Command& command, Duration /*timeout*/,
              std::uint64_t /*layout_id*/, Listener& listener) override {
    last = command;
    const Instant now = utc_now() + std::chrono::seconds(1);
    listener.on_event(kBootLine,
                      {.time = now, .kind = EventKind::boot_result, .text = "node 5: booted"});
    listener.on_event(kBootLine,
                      {.time = now, .kind = EventKind::boot_up, .text = "node 6: boot-up"});
    Answer answer;
    answer.reply.data = outcomes;
    return answer;
  }

  std::vector<BootOutcome> outcomes;
  line::Command last;
};

BootOutcome wrong_vendor() {
  return {.node = 6,
          .letter = 'D',
          .finding = {.kind = BootFinding::Kind::value,
                      .object = {0x1018, 1},
                      .abort = AbortCode::none,
                      .expected = 7,
                      .found = 8}};
}

using Boot = test::CommandTest<BootingGateway>;

TEST_F(Boot, OfAWholeLineSaysHowEachNodeEnded) {
  gateway_.outcomes = {{.node = 5, .letter = manager::kBooted, .finding = {}}};
  EXPECT_EQ(boot(context_, "hall"), kDone) << err_.str();
  EXPECT_EQ(as<line::Boot>(gateway_.last).node, 0);
  EXPECT_THAT(out_.str(), HasSubstr("booted"));
}

TEST_F(Boot, AProgressIsToldOfResultsAlone) {
  EXPECT_EQ(boot(context_, "hall"), kDone);
  EXPECT_THAT(err_.str(), HasSubstr("node 5: booted"));
  EXPECT_THAT(err_.str(), Not(HasSubstr("boot-up")));
}

TEST_F(Boot, ANodeThatIsNotBootedIsTheExitCode) {
  gateway_.outcomes = {{.node = 5, .letter = manager::kBooted, .finding = {}}, wrong_vendor()};
  EXPECT_EQ(boot(context_, "hall"), kFailed);
  EXPECT_THAT(out_.str(), HasSubstr("1018:01 is 00000008h, not 00000007h"));
}

TEST_F(Boot, ANodeThatRunsAlreadyIsNoFailure) {
  gateway_.outcomes = {{.node = 5, .letter = 'L', .finding = {}}};
  EXPECT_EQ(boot(context_, "hall:5"), kDone);
  EXPECT_EQ(as<line::Boot>(gateway_.last).node, 5);
}

TEST_F(Boot, IsJsonToo) {
  gateway_.outcomes = {wrong_vendor()};
  context_.json = true;
  EXPECT_EQ(boot(context_, "hall:all"), kFailed);
  EXPECT_EQ(as<line::Boot>(gateway_.last).node, 0);
  const auto json = nlohmann::json::parse(out_.str());
  const auto& node = json["nodes"][0];
  EXPECT_EQ(node["node"], 6);
  EXPECT_EQ(node["booted"], false);
  EXPECT_EQ(node["letter"], "D");
  EXPECT_EQ(node["object"], "1018:01");
  EXPECT_EQ(node["expected"], 7);
  EXPECT_EQ(node["found"], 8);
}

TEST_F(Boot, ItsOwnNodeIsNone) {
  EXPECT_EQ(boot(context_, "hall:own"), kUsage);
  EXPECT_EQ(boot(context_, "hall:200"), kUsage);
}

}  // namespace
}  // namespace linegate::console

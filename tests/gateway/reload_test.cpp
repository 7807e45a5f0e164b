// SPDX-License-Identifier: Apache-2.0
// What a new configuration changes, and how a line that is made anew keeps its numbers.
#include <memory>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "gateway/line_history.h"
#include "gateway/plan_difference.h"

#include "tests/gateway/plans.h"

namespace linegate::gateway {
namespace {

using Names = std::vector<std::string>;

config::Plant plant(const std::string& lines, const std::string& rest = "") {
  return make_plant("schema: 1\n" + rest + "lines:\n" + lines);
}

const std::string kA = "  - {name: a, interface: 'virtual:a', network_id: 1}\n";
const std::string kB = "  - {name: b, interface: 'virtual:b', network_id: 2}\n";
const std::string kC = "  - {name: c, interface: 'virtual:c', network_id: 3}\n";

TEST(PlanDifference, TellsLinesApartByTheirNames) {
  const auto running = identity_of(plant(kA + kB));
  const auto same = difference(running, plant(kB + kA));
  EXPECT_TRUE(same.empty()) << "the order of lines says nothing where network-IDs are given";
  EXPECT_EQ(same.unchanged, (Names{"b", "a"}));
  EXPECT_TRUE(same.refusals.empty());

  const std::string other_b = "  - {name: b, interface: 'virtual:b', network_id: 2, sync: 10ms}\n";
  const auto differs = difference(running, plant(other_b + kC));
  EXPECT_EQ(differs.changed, Names{"b"});
  EXPECT_EQ(differs.started, Names{"c"});
  EXPECT_EQ(differs.stopped, Names{"a"});
  EXPECT_TRUE(differs.unchanged.empty());
  EXPECT_EQ(describe(differs), "lines changed: b; started: c; stopped: a; unchanged: 0");

  const auto renamed =
      difference(running, plant("  - {name: x, interface: 'virtual:a', network_id: 1}\n" + kB));
  EXPECT_EQ(renamed.started, Names{"x"});
  EXPECT_EQ(renamed.stopped, Names{"a"});
}

TEST(PlanDifference, RefusesWhatSubscribersKnowTheGatewayBy) {
  const auto running = identity_of(plant(kA));
  EXPECT_TRUE(difference(running, plant(kA, "gateway: {log: debug}\n")).refusals.empty());
  const auto refused = difference(running, plant(kA, "gateway: {name: other}\ndds: {domain: 7}\n"));
  ASSERT_EQ(refused.refusals.size(), 2U);
  EXPECT_TRUE(has_errors(refused.refusals));
  EXPECT_NE(refused.refusals[0].text.find("the name of the gateway changes from \"linegate\" to "
                                          "\"other\", which needs a new start"),
            std::string::npos);
}

TEST(LineHistory, NumbersAndCountersGoOnAfterARestart) {
  LineHistory history;
  history.restart();  // the first life
  Event event;
  for (event.number = 1; event.number <= 3; ++event.number) {
    Event told = event;
    history.correct(told);
    EXPECT_EQ(told.number, event.number);
  }
  line::LineState state;
  state.counters.frames_received = 10;
  state.counters.events_lost = 1;
  state.routing.opened = 3;
  state.routing.open = 1;
  history.correct(state);
  EXPECT_EQ(state.counters.frames_received, 10U);

  history.restart();
  event = {};
  event.number = 1;
  history.correct(event);
  EXPECT_EQ(event.number, 4U);
  Event lost;
  lost.number = 4;
  lost.kind = EventKind::events_lost;
  lost.data[0] = std::byte{2};
  lost.data[8] = std::byte{3};
  history.correct(lost);
  EXPECT_EQ(lost.number, 7U);
  EXPECT_EQ(lost.data[0], std::byte{5});
  EXPECT_EQ(lost.data[8], std::byte{6});
  for (const std::uint64_t frames : {2U, 5U}) {
    line::LineState again;
    again.counters.frames_received = frames;
    again.routing.opened = 1;
    history.correct(again);
    EXPECT_EQ(again.counters.frames_received, 10U + frames);
    EXPECT_EQ(again.counters.events_lost, 1U);
    EXPECT_EQ(again.routing.opened, 4U);
    EXPECT_EQ(again.routing.open, 0U) << "what was open has ended with its line";
  }

  history.restart();
  state = {};
  history.correct(state);
  EXPECT_EQ(state.counters.frames_received, 15U);
  event = {};
  event.number = 1;
  history.correct(event);
  EXPECT_EQ(event.number, 8U);
}

}  // namespace
}  // namespace linegate::gateway

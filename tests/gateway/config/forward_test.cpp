// `forward:`, the rules of PDO forwarding between lines.
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "gateway/config/plant.h"

namespace linegate::config {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

const std::string kForwardRoot = LINEGATE_SOURCE_DIR "/";

Loaded<Plant> read_forwarding(const std::string& rules, const std::string& press = "",
                              const std::string& hall = "") {
  return read(
      R"(schema: 1
executors: [{name: fast}, {name: slow}]
lines:
  - name: press
    interface: virtual:press
    nodes: [{id: 5, name: axis, eds: bridges/sim/eds/drive.eds}]
)" + press +
          R"(  - name: hall
    interface: virtual:hall
    nodes:
      - {id: 5, name: axis, eds: bridges/sim/eds/drive.eds}
      - {id: 7, name: io, eds: bridges/sim/eds/digital-io.eds}
)" + hall +
          R"(  - {name: ear, interface: virtual:press, role: observer, nodes: [{id: 5, name: axis, eds: bridges/sim/eds/drive.eds}]}
  - {name: alone, interface: virtual:alone}
forward:
)" + rules,
      kForwardRoot + "plant.yaml");
}

std::vector<std::string> forward_messages(const Loaded<Plant>& loaded) {
  std::vector<std::string> out;
  for (const auto& diagnostic : loaded.diagnostics) {
    const std::string text = to_string(diagnostic);
    out.push_back(text.starts_with(kForwardRoot) ? text.substr(kForwardRoot.size()) : text);
  }
  return out;
}

TEST(Forward, RulesNameTheirEndsAsBindingsDo) {
  const auto loaded =
      read_forwarding(R"(  - press.axis.Position actual value -> hall.axis.Target position
  - {from: "press/axis.606C:0", to: hall.axis.60FF:0, when_lost: stop}
)");
  ASSERT_THAT(forward_messages(loaded), IsEmpty());
  ASSERT_EQ(loaded.value->bindings.size(), 2U);
  const Binding& position = loaded.value->bindings[0];
  EXPECT_TRUE(position.forwarded);
  EXPECT_EQ(position.from + "/" + position.input_name, "press/axis.Position actual value");
  EXPECT_EQ(position.to + "/" + position.output_name, "hall/axis.Target position");
  EXPECT_EQ(position.when_lost, WhenLost::hold);
  const Binding& velocity = loaded.value->bindings[1];
  EXPECT_EQ(velocity.input_name, "axis.Velocity actual value");
  EXPECT_EQ(velocity.when_lost, WhenLost::stop);
  EXPECT_THAT(loaded.value->lines.at(1).config.bound,
              ElementsAre(position.output_entry, velocity.output_entry));
}

TEST(Forward, LinesThatAreJoinedShareAnExecutorUnlessTheyNameOthers) {
  const std::string rule = "  - press.axis.6064:0 -> hall.axis.607A:0\n";
  const auto executors = [](const Loaded<Plant>& loaded) {
    std::vector<std::string> out;
    for (const LinePlan& line : loaded.value->lines) {
      out.push_back(line.executor);
    }
    return out;
  };
  EXPECT_THAT(executors(read_forwarding(rule)), ElementsAre("press+hall", "press+hall", "", ""));
  EXPECT_THAT(executors(read_forwarding(rule, "", "    executor: fast\n")),
              ElementsAre("fast", "fast", "", ""));
  EXPECT_THAT(executors(read_forwarding(rule, "    executor: slow\n", "    executor: fast\n")),
              ElementsAre("slow", "fast", "", ""));
}

TEST(Forward, JoinedLinesChangeTogetherAndWithTheirRules) {
  const auto one = read_forwarding("  - press.axis.6064:0 -> hall.axis.607A:0\n");
  const auto other =
      read_forwarding("  - {from: press.axis.6064:0, to: hall.axis.607A:0, when_lost: zero}\n");
  EXPECT_EQ(one.value->lines[0].source, one.value->lines[1].source);
  EXPECT_NE(one.value->lines[0].source, other.value->lines[0].source);
  EXPECT_EQ(one.value->lines[3].source, other.value->lines[3].source);
}

TEST(Forward, AnObserverMayBeASource) {
  EXPECT_THAT(forward_messages(read_forwarding("  - ear.axis.6064:0 -> hall.axis.607A:0\n")),
              IsEmpty());
}

TEST(Forward, WhatCannotBeForwardedIsToldWithItsPlace) {
  EXPECT_THAT(
      forward_messages(read_forwarding(
          R"(  - pres.axis.6064:0 -> hall.axis.607A:0
  - press.axis.Position actual valeu -> hall.axis.607A:0
  - "press.axis.6064:0 -> hall.axis.Target positoin"
  - press.axis.60FF:0 -> hall.axis.607A:0
  - press.axis.6064:0 -> hall.axis.6064:0
  - press.axis.6041:0 -> hall.axis.607A:0
  - press.axis.6064:0 -> press.axis.607A:0
  - press.axis.6064:0 -> ear.axis.607A:0
)")),
      ElementsAre(
          "plant.yaml:15:5: error: there is no line \"pres\"; did you mean \"press\"?",
          "plant.yaml:16:5: error: line \"press\" has no input \"axis.Position actual valeu\"; "
          "did you mean \"axis.Position actual value\"?",
          "plant.yaml:17:27: error: line \"hall\" has no output \"axis.Target positoin\"; did "
          "you mean \"axis.Target position\"?",
          "plant.yaml:18:5: error: \"axis.60FF:0\" is an output; what is forwarded is an input",
          "plant.yaml:19:26: error: \"axis.6064:0\" is an input; the target of a rule is an "
          "output",
          "plant.yaml:20:26: error: \"axis.Statusword\" is UNSIGNED16, \"axis.Target position\" "
          "is INTEGER32",
          "plant.yaml:21:26: error: source and target are on the same line \"press\": "
          "forwarding is between lines",
          "plant.yaml:22:26: error: line \"ear\" is an observer, which writes no outputs"));
}

TEST(Forward, ATargetHasOneSource) {
  EXPECT_THAT(forward_messages(read_forwarding(
                  R"(  - press.axis.6064:0 -> hall.axis.607A:0
  - ear.axis.6064:0 -> hall.axis.607A:0
  - press.axis.6061:0 -> hall.axis.6060:0
)",
                  "", "    outputs: {groups: [{name: mode, entries: [axis.6060:0]}]}\n")),
              ElementsAre("plant.yaml:17:24: error: \"axis.Target position\" follows another input "
                          "already",
                          "plant.yaml:18:26: error: \"axis.Modes of operation\" is in the output "
                          "group \"mode\""));
}

TEST(Forward, OneReceivedPdoFeedsOnePdoOfAnotherLine) {
  EXPECT_THAT(forward_messages(read_forwarding(
                  R"(  - press.axis.6041:0 -> hall.axis.6040:0
  - press.axis.6061:0 -> hall.axis.6060:0
)")),
              IsEmpty());
  EXPECT_THAT(forward_messages(read_forwarding(
                  R"(  - hall.io.6000:1 -> press.axis.6040:0
  - press.axis.6064:0 -> hall.axis.607A:0
  - press.axis.606C:0 -> hall.axis.60FF:0
  - press.axis.6041:0 -> hall.axis.6040:0
  - press.axis.6061:0 -> hall.axis.60FF:0
)")),
              ElementsAre("plant.yaml:15:23: error: \"io.Read input 8-bit.Inputs 1 to 8\" is "
                          "UNSIGNED8, \"axis.Controlword\" is UNSIGNED16",
                          "plant.yaml:19:26: error: the PDO that brings \"axis.Modes of operation "
                          "display\" feeds the one with \"axis.Controlword\" already: one "
                          "received PDO feeds at most one PDO of another line"));
}

TEST(Forward, WhatWasForwardedIsNotForwardedAgainAndRulesMakeNoCircle) {
  EXPECT_THAT(
      forward_messages(read_forwarding(
          R"(  - press.axis.6064:0 -> hall.axis.607A:0
  - hall.axis.607A:0 -> press.axis.607A:0
)")),
      ElementsAre("plant.yaml:16:5: error: \"axis.607A:0\" is what another rule writes: forwarded "
                  "values are not forwarded again"));
  EXPECT_THAT(
      forward_messages(read_forwarding(
          R"(  - press.axis.607A:0 -> hall.axis.607A:0
  - hall.axis.607A:0 -> press.axis.607A:0
)")),
      ElementsAre("plant.yaml:15:5: error: \"axis.607A:0\" is what another rule writes, and the "
                  "rules make a circle: forwarded values are not forwarded again",
                  "plant.yaml:16:5: error: \"axis.607A:0\" is what another rule writes, and the "
                  "rules make a circle: forwarded values are not forwarded again"));
}

TEST(Forward, WhatIsNoRuleIsToldWithItsPlace) {
  EXPECT_THAT(forward_messages(read_forwarding(
                  R"(  - press.axis.6064:0
  - press -> hall.axis.607A:0
  - press.axis.6064:0 -> hall
  - {from: press.axis.6064:0, when_lost: hide}
  - "-> hall.axis.607A:0"
)")),
              ElementsAre("plant.yaml:15:5: error: expected LINE.NODE.OBJECT -> LINE.NODE.OBJECT",
                          "plant.yaml:16:5: error: expected LINE.NODE.OBJECT, such as "
                          "press.axis.Position",
                          "plant.yaml:17:26: error: expected LINE.NODE.OBJECT, such as "
                          "press.axis.Position",
                          "plant.yaml:18:5: error: a forwarding rule needs the key \"to\"",
                          "plant.yaml:18:42: error: expected hold, zero or stop, got \"hide\"",
                          "plant.yaml:19:5: error: expected LINE.NODE.OBJECT -> LINE.NODE.OBJECT"));
}

}  // namespace
}  // namespace linegate::config

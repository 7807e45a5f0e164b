// SPDX-License-Identifier: Apache-2.0
// `forward:`, the rules of PDO forwarding between lines.
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "gateway/config/plant.h"
#include "stack/line/line.h"

#include "tests/paths.h"

namespace linegate::config {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

const std::string kForwardRoot = paths::in_repository("");

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
  EXPECT_THAT(executors(read_forwarding(rule)), ElementsAre("hall+press", "hall+press", "", ""));
  EXPECT_THAT(executors(read_forwarding(rule, "", "    executor: fast\n")),
              ElementsAre("fast", "fast", "", ""));
  EXPECT_THAT(executors(read_forwarding(rule, "    executor: slow\n", "    executor: fast\n")),
              ElementsAre("slow", "fast", "", ""));
}

TEST(Forward, LinesChangeWithTheRulesThatJoinThem) {
  const auto one = read_forwarding("  - press.axis.6064:0 -> hall.axis.607A:0\n");
  const auto other =
      read_forwarding("  - {from: press.axis.6064:0, to: hall.axis.607A:0, when_lost: zero}\n");
  EXPECT_NE(one.value->lines[0].source, other.value->lines[0].source);
  EXPECT_NE(one.value->lines[1].source, other.value->lines[1].source);
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
          "plant.yaml:18:5: error: \"axis.60FF:0\" is an output; only inputs can be forwarded",
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
  EXPECT_THAT(
      forward_messages(read_forwarding(
          R"(  - press.axis.6064:0
  - press -> hall.axis.607A:0
  - press.axis.6064:0 -> hall
  - {from: press.axis.6064:0, when_lost: hide}
  - "-> hall.axis.607A:0"
)")),
      ElementsAre(
          "plant.yaml:15:5: error: expected LINE.NODE.OBJECT -> LINE.NODE.OBJECT",
          "plant.yaml:16:5: error: expected LINE.NODE.OBJECT, such as "
          "press.axis.Position",
          "plant.yaml:17:26: error: expected LINE.NODE.OBJECT, such as "
          "press.axis.Position",
          "plant.yaml:18:5: error: a forwarding rule needs the key \"to\"",
          "plant.yaml:18:42: error: expected hold, stop, zero, nmt_pre_operational, nmt_stop, "
          "nmt_reset_communication, nmt_reset_node, emcy or heartbeat_off, got "
          "\"hide\"",
          "plant.yaml:19:5: error: expected LINE.NODE.OBJECT -> LINE.NODE.OBJECT"));
}

TEST(Forward, ARuleMakesAnObjectThatBothLinesShow) {
  const auto loaded = read_forwarding(R"(  - press.axis.6041:0 -> hall.axis.6040:0
  - press.axis.6061:0 -> hall.axis.6060:0
  - ear.axis.6064:0 -> hall.axis.607A:0
)");
  ASSERT_THAT(forward_messages(loaded), IsEmpty());
  EXPECT_EQ(loaded.value->bindings[0].object, (od::Address{0xB100, 1}));
  EXPECT_EQ(loaded.value->bindings[1].object, (od::Address{0xB000, 1}));
  EXPECT_EQ(loaded.value->bindings[2].object, (od::Address{0xB1C0, 1}));
  const auto& press = loaded.value->lines[0].config.forwarding.objects;
  const auto& hall = loaded.value->lines[1].config.forwarding.objects;
  ASSERT_EQ(press.size(), 2U);
  ASSERT_EQ(hall.size(), 3U);
  EXPECT_EQ(press[0].address, hall[1].address)
      << "ordered by source, not by the order of the rules";
  EXPECT_EQ(press[0].name, "press.axis.Statusword");
  EXPECT_EQ(press[0].entry->direction, image::Direction::inputs);
  EXPECT_EQ(hall[1].entry->direction, image::Direction::outputs);
}

Loaded<Plant> read_shared(const std::string& objects, const std::string& press,
                          const std::string& hall) {
  return read("schema: 1\nshared_objects: " + objects + R"(
lines:
  - name: press
    interface: virtual:press
    nodes: [{id: 5, name: axis, eds: bridges/sim/eds/drive.eds}]
    own_pdos: )" + press +
                  R"(
  - name: hall
    interface: virtual:hall
    own_pdos: )" + hall +
                  "\n",
              kForwardRoot + "plant.yaml");
}

TEST(SharedObjects, APdoOfAnotherLineMayFeedEveryPdoThatMapsIt) {
  const std::string tpdos = R"({tpdo1: {cob_id: 0x1C2, map: ["B100:1"]}})";
  const std::string rpdos = R"({rpdo10: {cob_id: 0x1C1, map: ["B100:1"]}})";
  const auto loaded = read_shared(R"({"B100:1": level})", rpdos,
                                  tpdos +
                                      "\n    feeds_every_tpdo: true\n    enter: "
                                      "[{from: press, services: [pdo]}]");
  ASSERT_TRUE(loaded.ok());
  EXPECT_FALSE(loaded.value->lines[0].config.forwarding.feeds_every_tpdo);
  EXPECT_TRUE(loaded.value->lines[1].config.forwarding.feeds_every_tpdo);
  EXPECT_THAT(forward_messages(read_shared("{}", "{}", "{}\n    feeds_every_tpdo: true")),
              ElementsAre("plant.yaml:11:23: error: feeds_every_tpdo is about own_pdos, of which "
                          "there are none"));
}

TEST(SharedObjects, AreForEveryLineThatHasPdosOfItsOwn) {
  const auto loaded = read_shared(
      R"({"B100:1": level, "B040:1": mode})",
      R"({rpdo10: {cob_id: 0x1C1, event_timer: 50ms, map: ["B100:1", "B040:1"]}})",
      R"({tpdo1: {cob_id: 0x1C2, type: sync, inhibit: 5ms, map: ["B580:1"]}, tpdo2: {cob_id: 0x1C3, enabled: false}})");
  EXPECT_THAT(forward_messages(loaded),
              ElementsAre("plant.yaml:10:16: warning: PDOs of line \"press\" may not enter line "
                          "\"hall\": nothing is forwarded to its own PDOs"))
      << "access is closed unless it is opened";
  ASSERT_TRUE(loaded.ok());
  EXPECT_THAT(loaded.value->bindings, IsEmpty());
  const routing::Forwarding& press = loaded.value->lines[0].config.forwarding;
  ASSERT_EQ(press.objects.size(), 2U);
  EXPECT_EQ(press.objects[0].name, "level");
  ASSERT_EQ(press.rpdos.size(), 1U);
  EXPECT_EQ(press.rpdos[0].number, 10);
  EXPECT_EQ(press.rpdos[0].event_timer, std::chrono::milliseconds(50));
  EXPECT_EQ(press.rpdos[0].mapping[0].raw(), 0xB100'0110U);
  EXPECT_EQ(press.rpdos[0].mapping[1].raw(), 0xB040'0108U);
  const routing::Forwarding& hall = loaded.value->lines[1].config.forwarding;
  ASSERT_EQ(hall.tpdos.size(), 2U);
  EXPECT_EQ(hall.tpdos[0].type, 1);
  EXPECT_EQ(hall.tpdos[0].mapping[0].raw(), 0xB580'0110U);
  EXPECT_TRUE(hall.tpdos[0].cob_id.valid());
  EXPECT_FALSE(hall.tpdos[1].cob_id.valid());
}

TEST(SharedObjects, GoWhereAccessLetsPdosIn) {
  const auto loaded = read_shared(R"({"B100:1": level, "B040:1": mode})",
                                  R"({rpdo10: {cob_id: 0x1C1, map: ["B100:1"]}})",
                                  R"({tpdo1: {cob_id: 0x1C2, map: ["B100:1"]}}
    enter: [{from: press, services: [pdo]}])");
  ASSERT_THAT(forward_messages(loaded), IsEmpty());
  ASSERT_EQ(loaded.value->bindings.size(), 2U)
      << "one binding for each object: mappings may change";
  const Binding& level = loaded.value->bindings[0];
  EXPECT_EQ(level.from, "press");
  EXPECT_EQ(level.to, "hall");
  EXPECT_TRUE(level.forwarded);
  EXPECT_EQ(level.object, (od::Address{0xB100, 1}));
  EXPECT_EQ(level.output_entry, line::Line::kForwarded | 0U);
  EXPECT_EQ(loaded.value->lines[0].executor, "hall+press");
}

TEST(SharedObjects, WhatIsWrongIsToldWithItsPlace) {
  EXPECT_THAT(
      forward_messages(read_shared(R"({"B480:1": a, "A100:1": b, "B100:1": c, "B100:01": d})",
                                   "{rpdo2: {cob_id: 0x1C1}}", "{tpdo0: {cob_id: 0x601}}")),
      ElementsAre("plant.yaml:2:18: error: expected an object B000h..B47Fh such as B100:1, got "
                  "\"B480:1\"",
                  "plant.yaml:2:31: error: expected an object B000h..B47Fh such as B100:1, got "
                  "\"A100:1\"",
                  "plant.yaml:2:57: error: B100:01 is there twice",
                  "plant.yaml:10:16: error: expected tpdo1 to tpdo512 or rpdo1 to rpdo512, got "
                  "\"tpdo0\""));
  EXPECT_THAT(
      forward_messages(read_shared(
          R"({"B100:1": a, "B440:1": b})", R"({rpdo2: {cob_id: 0x1C1, map: ["B580:1"]}})",
          R"({tpdo1: {cob_id: 0x1C2, map: ["B100:2"]}, tpdo2: {cob_id: 0x1C2, map: ["B440:1", "B100:1"]}})")),
      ElementsAre("plant.yaml:7:16: error: 1 to 2 are linked to devices of the line: take a higher "
                  "number",
                  "plant.yaml:7:45: error: there is no B580:01 in shared_objects that an RPDO may "
                  "write",
                  "plant.yaml:10:16: warning: PDOs of line \"press\" may not enter line "
                  "\"hall\": nothing is forwarded to its own PDOs",
                  "plant.yaml:10:45: error: there is no B100:02 in shared_objects",
                  "plant.yaml:10:57: error: the objects have 80 bits; a PDO has room for 64"));
}

// --- sources in other gateways ----------------------------------------------------------------

TEST(Forward, ASourceInAnotherGatewayHasAGroupOfItsOwn) {
  const auto loaded = read_forwarding(
      R"(  - hall-b/pack.belt.Position actual value -> hall.axis.Target position
  - {from: "hall-b/pack.belt.6061:0", to: hall.axis.6060:0, timeout: 500ms, when_lost: [zero, emcy]}
)",
      "", "    outputs: {groups: [{name: top, number: 65535, entries: [axis.6040:0]}]}\n");
  ASSERT_THAT(forward_messages(loaded), IsEmpty());
  EXPECT_THAT(loaded.value->bindings, IsEmpty());
  const LinePlan& hall = loaded.value->lines.at(1);
  ASSERT_EQ(hall.remote_inputs.size(), 2U);
  const RemoteInput& mode = hall.remote_inputs[0].output_name == "axis.Modes of operation"
                                ? hall.remote_inputs[0]
                                : hall.remote_inputs[1];
  const RemoteInput& position =
      &mode == hall.remote_inputs.data() ? hall.remote_inputs[1] : hall.remote_inputs[0];
  EXPECT_EQ(position.source(), "hall-b/pack.belt.Position actual value");
  EXPECT_EQ(position.from, (RemoteLine{"hall-b", "pack"}));
  EXPECT_EQ(position.type, od::DataType::integer32);
  EXPECT_EQ(position.bit_length, 32U);
  EXPECT_EQ(position.timeout, std::chrono::seconds(5));
  EXPECT_EQ(position.reactions, line::kHoldOutputs);
  EXPECT_EQ(mode.entry, "belt.6061:0");
  EXPECT_EQ(mode.timeout, std::chrono::milliseconds(500));
  EXPECT_EQ(mode.reactions, line::kZeroOutputs | line::kSendEmcy);
  ASSERT_EQ(hall.config.groups.size(), 3U);
  for (std::size_t i = 0; i < 2; ++i) {
    const line::OutputGroup& group = hall.config.groups[i + 1];
    EXPECT_TRUE(group.forwarded);
    EXPECT_EQ(group.number, 65534 - i) << "65535 is configured";
    EXPECT_EQ(group.number, hall.remote_inputs[i].group);
    EXPECT_EQ(group.name, hall.remote_inputs[i].source());
    EXPECT_THAT(group.entries, ElementsAre(hall.remote_inputs[i].output));
  }
}

TEST(Forward, OutputsWithoutASourceRemainInTheGroupOfAll) {
  const auto loaded = read_forwarding("  - hall-b/pack.belt.6064:0 -> hall.axis.607A:0\n");
  ASSERT_THAT(forward_messages(loaded), IsEmpty());
  const LinePlan& hall = loaded.value->lines.at(1);
  const auto made = line::Line::make(hall.config);
  ASSERT_TRUE(made.value);
  const image::Layout& outputs = (*made.value)->layout(image::Direction::outputs);
  for (std::uint32_t i = 0; i < outputs.entries.size(); ++i) {
    EXPECT_EQ(outputs.entries[i].group, i == hall.remote_inputs[0].output ? 65535 : 0) << i;
  }
}

TEST(Forward, ALineChangesWithItsSourcesInOtherGateways) {
  const auto source = [](const std::string& rule) {
    return read_forwarding("  - " + rule + "\n").value->lines.at(1).source;
  };
  const std::string one = source("hall-b/pack.belt.6064:0 -> hall.axis.607A:0");
  EXPECT_EQ(one, source("{from: hall-b/pack.belt.6064:0, to: hall.axis.607A:0, timeout: 5s}"));
  EXPECT_NE(one, source("{from: hall-b/pack.belt.6064:0, to: hall.axis.607A:0, timeout: 4s}"));
  EXPECT_NE(one, source("{from: hall-b/pack.belt.6064:0, to: hall.axis.607A:0, when_lost: zero}"));
  EXPECT_NE(one, source("hall-c/pack.belt.6064:0 -> hall.axis.607A:0"));
}

TEST(Forward, WhatASourceInAnotherGatewayCannotHaveIsToldWithItsPlace) {
  EXPECT_THAT(
      forward_messages(read_forwarding(
          R"(  - linegate/pack.belt.6064:0 -> hall.axis.607A:0
  - ha%ll/pack.belt.6064:0 -> hall.axis.607A:0
  - hall-b/pa ck.belt.6064:0 -> hall.axis.607A:0
  - hall-b/belt.6064:0 -> hall.axis.607A:0
  - hall-b/pack.belt.6064:0 -> ear.axis.607A:0
  - {from: hall-b/pack.belt.6064:0, to: hall.axis.607A:0, when_lost: stop}
  - {from: hall-b/pack.belt.6064:0, to: hall.axis.607A:0, when_lost: [nmt_stop, nmt_reset_node]}
  - {from: hall-b/pack.belt.6064:0, to: hall.axis.607A:0, when_lost: [hold, zero]}
  - {from: press.axis.6064:0, to: hall.axis.607A:0, timeout: 1s, when_lost: emcy}
  - hall-b/pack.belt.6064:0 -> hall.axis.6040:0
  - hall-b/pack.belt.6064:0 -> hall.axis.6040:0
  - hall.axis.6040:0 -> press.axis.6040:0
  - hall-b/pack.belt.6064:0 -> hall-c/pack.axis.6040:0
)")),
      ElementsAre(
          "plant.yaml:15:5: error: \"linegate\" is this gateway: name the source as "
          "\"pack.belt.6064:0\"",
          "plant.yaml:16:5: error: a name of a gateway has 1 to 64 letters, digits, '-' and '_', "
          "not \"ha%ll\"",
          "plant.yaml:17:5: error: a name of a line has 1 to 64 letters, digits, '-' and '_', not "
          "\"pa ck\"",
          "plant.yaml:18:5: error: there is no line \"hall-b\"; did you mean \"hall\"?",
          "plant.yaml:19:32: error: line \"ear\" is an observer, which writes no outputs",
          "plant.yaml:20:70: error: when_lost: stop is for a source in this gateway: with one in "
          "another gateway, its PDO continues; use hold or zero, and emcy or an NMT reaction",
          "plant.yaml:21:70: error: when_lost has more than one NMT reaction",
          "plant.yaml:22:70: error: when_lost has both hold and zero",
          "plant.yaml:23:62: error: timeout is for a source in another gateway, "
          "GATEWAY/LINE.NODE.OBJECT; in this one a late PDO is detected by pdo_deadline of the "
          "node",
          "plant.yaml:23:77: error: when_lost is hold, zero or stop for a source in this gateway",
          "plant.yaml:25:32: error: \"axis.Controlword\" follows another input already",
          "plant.yaml:26:5: error: \"axis.6040:0\" is what another rule writes: forwarded values "
          "are not forwarded again",
          "plant.yaml:27:32: error: there is no line \"hall-c\"; did you mean \"hall\"?"));
}

TEST(Forward, TheTimeOfASourceInAnotherGatewayIsBounded) {
  const std::string rule = "  - {from: hall-b/pack.belt.6064:0, to: hall.axis.607A:0, timeout: ";
  EXPECT_THAT(forward_messages(read_forwarding(rule + "100ms}\n")), IsEmpty());
  EXPECT_THAT(
      forward_messages(read_forwarding(rule + "99ms}\n")),
      ElementsAre("plant.yaml:15:68: error: expected a time from 100ms to 3600s, got \"99ms\""));
  EXPECT_THAT(
      forward_messages(read_forwarding(rule + "2h}\n")),
      ElementsAre("plant.yaml:15:68: error: expected a time from 100ms to 3600s, got \"2h\""));
}

TEST(Forward, ASourceInAnotherGatewayIsPossibleWithDdsSecurity) {
  const auto messages = [](const std::string& dds) {
    return forward_messages(read(R"(schema: 1
dds: )" + dds + R"(
lines:
  - {name: hall, interface: virtual:hall, nodes: [{id: 5, name: axis, eds: bridges/sim/eds/drive.eds}]}
forward: [hall-b/pack.belt.6064:0 -> hall.axis.607A:0]
)",
                                 kForwardRoot + "plant.yaml"));
  };
  EXPECT_THAT(messages("{process: own}"), IsEmpty());
  EXPECT_THAT(messages("{security: bridges}"), IsEmpty());
}

}  // namespace
}  // namespace linegate::config

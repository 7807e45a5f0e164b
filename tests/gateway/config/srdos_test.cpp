// SPDX-License-Identifier: Apache-2.0
// `srdo:` of a node, objects 1300h to 13FFh in `objects:`, and what `linegate check` says of them.
#include <algorithm>
#include <string>

#include <gtest/gtest.h>

#include "gateway/config/entry_names.h"
#include "gateway/config/plant.h"
#include "stack/base/byte_order.h"
#include "stack/line/build.h"
#include "stack/line/line.h"
#include "stack/srdo/parameters.h"

#include "tests/paths.h"

namespace linegate::config {
namespace {

using namespace std::chrono_literals;

// A line with a node of tests/gateway/config/gate.eds that has these keys.
Loaded<Plant> read_srdo_plant(const std::string& keys, const std::string& of_line = "") {
  return read("schema: 1\nlines:\n  - name: a\n    interface: \"simulated:\"\n" + of_line +
                  "    nodes:\n      - {id: 5, name: gate, eds: tests/gateway/config/gate.eds" +
                  keys + "}\n",
              paths::in_repository("plant.yaml"));
}

std::string srdo_findings(const Loaded<Plant>& loaded) {
  std::string out;
  for (const auto& diagnostic : loaded.diagnostics) {
    out += to_string(diagnostic) + '\n';
  }
  return out;
}

void expect_finding(const Loaded<Plant>& loaded, const std::string& text) {
  EXPECT_NE(srdo_findings(loaded).find(text), std::string::npos) << srdo_findings(loaded);
}

// "index:sub=value" of the writes to 1300h to 13FFh, in their order.
std::string srdo_writes(const Loaded<Plant>& loaded) {
  std::string out;
  const auto plans = line::node_plans(loaded.value->lines.at(0).config);
  for (const manager::ObjectWrite& write : plans.at(0).writes) {
    if (srdo::is_srdo_object(write.address.index)) {
      out += od::to_text(write.address) + "=" +
             std::to_string(load_le(std::span<const std::byte>(write.data))) + " ";
    }
  }
  return out;
}

TEST(PlantSrdo, WithoutTheKeyNothingIsWritten) {
  const auto loaded = read_srdo_plant("");
  ASSERT_TRUE(loaded.ok()) << srdo_findings(loaded);
  EXPECT_EQ(srdo_writes(loaded), "");
  EXPECT_TRUE(loaded.value->lines.at(0).config.nodes.at(0).srdo_cycle.empty());
}

TEST(PlantSrdo, WritesItsParametersAndTheirSignature) {
  const auto loaded = read_srdo_plant(
      ", srdo: {srdo1: {direction: transmit, cob_id: 0x111, refresh: 30ms, srvt: 10ms, sct: 90ms, "
      "map: [\"2000:1\", \"2000:2\"]}}");
  ASSERT_TRUE(loaded.ok()) << srdo_findings(loaded);
  const srdo::Parameters expected{.number = 1,
                                  .direction = srdo::Direction::transmit,
                                  .cycle_ms = 30,
                                  .validation_ms = 20,
                                  .cob_id = 0x111,
                                  .inverted_cob_id = 0x112,
                                  .mapping = {{{0x2000, 1}, 8}, {{0x2000, 2}, 8}}};
  EXPECT_EQ(srdo_writes(loaded),
            "13FE:00=0 1301:01=0 1381:00=0 1381:01=536871176 1381:02=536871432 1381:00=2 "
            "1301:02=30 1301:05=273 1301:06=274 1301:01=1 13FF:01=" +
                std::to_string(srdo::signature(expected)) + " 13FE:00=165 ");
  const line::NodeConfig& node = loaded.value->lines.at(0).config.nodes.at(0);
  EXPECT_EQ(node.srdo_cycle.at(1), 90ms);
  EXPECT_EQ(node.srdo_validation.at(1), 10ms);
  const auto made = line::Line::make(loaded.value->lines.at(0).config);
  ASSERT_TRUE(made.ok());
  const auto& entries = (*made.value)->layout(image::Direction::inputs).entries;
  ASSERT_EQ(entries.size(), 1U);
  EXPECT_EQ(entries[0].remote_pdo, image::kFirstSrdo);
  EXPECT_EQ(entries[0].name, "gate.Door state");
}

TEST(PlantSrdo, AnSctAndAnSrvtAreThoseOfTheLine) {
  const auto loaded = read_srdo_plant(", srdo: {srdo1: {sct: 70ms, srvt: 5ms}}");
  ASSERT_TRUE(loaded.ok()) << srdo_findings(loaded);
  EXPECT_EQ(srdo_writes(loaded), "");
  EXPECT_EQ(loaded.value->lines.at(0).config.nodes.at(0).srdo_cycle.at(1), 70ms);
  EXPECT_EQ(loaded.value->lines.at(0).config.nodes.at(0).srdo_validation.at(1), 5ms);
}

TEST(PlantSrdo, OfOneThatTheDeviceReceivesTheSctIsThatOfTheDevice) {
  const auto loaded = read_srdo_plant(", srdo: {srdo2: {sct: 70ms, srvt: 30ms}}");
  ASSERT_TRUE(loaded.ok()) << srdo_findings(loaded);
  EXPECT_NE(srdo_writes(loaded).find("1302:02=70 1302:03=30 1302:01=2 13FF:02="), std::string::npos)
      << srdo_writes(loaded);
}

TEST(PlantSrdo, WhatADeviceReceivesIsNoOutput) {
  for (const std::string name : {"gate.2100:1", "gate.Lock command"}) {
    expect_finding(
        read_srdo_plant("", "    outputs: {groups: [{name: g, entries: [\"" + name + "\"]}]}\n"),
        "there is no output \"" + name +
            "\": the node receives it by SRDO 2, and Linegate produces no SRDOs");
  }
  expect_finding(read_srdo_plant(""), "SRDO 2 of gate is received from no node of this line");
}

// An SRDO of the same object makes it no ambiguous one.
TEST(PlantSrdo, ABareAddressIsThatOfThePdo) {
  line::LineConfig config;
  config.nodes.emplace_back();
  config.nodes[0].id = 5;
  config.nodes[0].name = "gate";
  image::Layout layout;
  for (const auto& [pdo, name] : {std::pair(std::uint16_t{1}, "gate.Door"),
                                  std::pair(image::kFirstSrdo, "gate.Door in SRDO 1")}) {
    image::Entry entry;
    entry.node = 5;
    entry.index = 0x2000;
    entry.sub = 1;
    entry.remote_pdo = pdo;
    entry.name = name;
    layout.entries.push_back(std::move(entry));
  }
  const EntryNames names(config, layout);
  EXPECT_EQ(names.find("gate.2000:1", true), std::vector<std::uint32_t>{0});
  EXPECT_EQ(names.ambiguity("gate.2000:1"), "");
  EXPECT_EQ(names.find("gate.Door in SRDO 1", false), std::vector<std::uint32_t>{1});
  EXPECT_EQ(names.find("gate.*", true).size(), 2U);
  layout.entries.erase(layout.entries.begin());
  EXPECT_EQ(names.find("gate.2000:1", true), std::vector<std::uint32_t>{0}) << "the SRDO alone";
}

// Two SRDOs carry the object: a rule follows the entry that it names.
TEST(PlantSrdo, ARuleFollowsTheSrdoThatItNames) {
  const auto loaded = read(
      R"(schema: 1
lines:
  - name: a
    interface: "simulated:"
    nodes:
      - {id: 5, name: gate, eds: tests/gateway/config/gate.eds, srdo: {srdo2: {direction: transmit, map: ["2000:1", "2000:2"]}}}
  - name: b
    interface: "virtual:b"
    nodes: [{id: 7, name: io, eds: bridges/sim/eds/digital-io.eds}]
forward:
  - {from: a.gate.Door state in SRDO 2, to: "b.io.6200:1", when_lost: zero}
)",
      paths::in_repository("plant.yaml"));
  ASSERT_TRUE(loaded.ok()) << srdo_findings(loaded);
  ASSERT_EQ(loaded.value->bindings.size(), 1U);
  EXPECT_EQ(loaded.value->bindings[0].input.pdo, image::kFirstSrdo + 1);
}

// The signature is that of both, or the one in `objects`.
TEST(PlantSrdo, IsSignedAfterObjects) {
  const auto loaded =
      read_srdo_plant(", srdo: {srdo1: {refresh: 30ms}}, objects: {\"1301:3\": 30}");
  ASSERT_TRUE(loaded.ok()) << srdo_findings(loaded);
  EXPECT_EQ(loaded.diagnostics.size(), read_srdo_plant("").diagnostics.size());
  const srdo::Parameters expected{.number = 1,
                                  .direction = srdo::Direction::transmit,
                                  .cycle_ms = 30,
                                  .validation_ms = 30,
                                  .cob_id = 0x109,
                                  .inverted_cob_id = 0x10A,
                                  .mapping = {{{0x2000, 1}, 8}, {{0x2000, 2}, 8}}};
  const std::string signature = std::to_string(srdo::signature(expected));
  EXPECT_NE(srdo_writes(loaded).find("13FF:01=" + signature + " 13FE:00=165 "), std::string::npos)
      << srdo_writes(loaded);
  const auto same = read_srdo_plant(
      ", srdo: {srdo1: {refresh: 30ms}}, objects: {\"1301:3\": 30, \"13FF:1\": " + signature + "}");
  ASSERT_TRUE(same.ok()) << srdo_findings(same);
  EXPECT_EQ(srdo_writes(same), srdo_writes(loaded));
}

TEST(PlantSrdo, ASignatureThatDoesNotMatchIsRefused) {
  expect_finding(read_srdo_plant(", objects: {\"1301:3\": 30, \"13FF:1\": 0x1234}"),
                 "SRDO 1 (13FF:01) signature is 1234h, but that of its parameters is ");
  const auto loaded = read_srdo_plant(", objects: {\"1301:3\": 30}");
  ASSERT_TRUE(loaded.ok()) << srdo_findings(loaded);
  EXPECT_NE(srdo_writes(loaded).find("13FF:01="), std::string::npos) << "it is computed";
}

TEST(PlantSrdo, EachMistakeIsReported) {
  const auto with = [](const std::string& keys) {
    return read_srdo_plant(", srdo: {" + keys + "}");
  };
  expect_finding(with("srdo65: {}"), "expected srdo1 to srdo64, got \"srdo65\"");
  expect_finding(with("tpdo1: {}"), "expected srdo1 to srdo64, got \"tpdo1\"");
  expect_finding(with("srdo3: {srvt: 5ms}"), "has no object 1303:01");
  expect_finding(with("srdo1: {cob_id: 0x10A}"), "COB-ID 1 10Ah is not an odd one");
  expect_finding(with("srdo1: {cob_id: 0x180}"), "257");
  expect_finding(with("srdo1: {srvt: 300ms}"), "255ms");
  expect_finding(with("srdo1: {srvt: 0ms}"), "srvt is 0: give 1ms to 255ms");
  expect_finding(with("srdo1: {sct: 0ms}"), "sct is 0: give 1ms to ");
  expect_finding(with("srdo2: {srvt: 0ms}"), "srvt is 0: give 1ms to 255ms");
  expect_finding(with("srdo2: {refresh: 5ms}"), "refresh is for an SRDO that the device transmits");
  expect_finding(with("srdo1: {map: [\"2000:1\"]}"), "each is followed by its inverted object");
  expect_finding(with("srdo1: {map: [\"2000:1\", \"2000:9\"]}"), "has no object 2000:09");
  expect_finding(with("srdo1: {map: [x, \"2000:2\"]}"), "expected an object such as 6000:1");
  expect_finding(with("srdo1: {direction: both}"), "expected off, transmit or receive");
  expect_finding(with("srdo1: {every: true}"), "unknown key \"every\"");
}

}  // namespace
}  // namespace linegate::config

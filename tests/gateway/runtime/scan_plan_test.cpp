// SPDX-License-Identifier: Apache-2.0
// The application of a scan, and the line that results.
#include "gateway/runtime/scan_plan.h"

#include <algorithm>

#include <gtest/gtest.h>

#include "gateway/runtime/scan_applier.h"
#include "stack/base/byte_order.h"
#include "stack/line/line.h"
#include "stack/od/objects.h"
#include "stack/scan/scanned_node.h"

#include "tests/gateway/plans.h"

namespace linegate::gateway {
namespace {

using namespace std::chrono_literals;

const std::string kBare = "  - {name: press, interface: 'virtual:p', network_id: 1}\n";
const std::string kAuto = "  - {name: press, interface: 'virtual:p', network_id: 1, auto: true}\n";

config::LinePlan line_of(const std::string& text) {
  return make_plant("schema: 1\nlines:\n" + text).lines.front();
}

// An analogue module with a TPDO, in the form in which a scan reads it.
scan::ScannedNode node_of(std::uint8_t id, AbortCode end = AbortCode::none) {
  scan::ScannedNode node{.id = id, .end = end, .values = {}};
  const auto set = [&](std::uint16_t index, std::uint8_t sub, std::uint64_t value,
                       std::size_t size) {
    std::vector<std::byte> data(size);
    store_le(std::span(data), value);
    node.values.push_back({{index, sub}, data});
  };
  set(0x1000, 0, 0x0004'0191, 4);
  set(0x1017, 0, 200, 2);
  set(0x1800, 0, 2, 1);
  set(0x1800, 1, 0x4000'0180U + id, 4);
  set(0x1800, 2, 255, 1);
  set(0x1A00, 0, 1, 1);
  set(0x1A00, 1, 0x6401'0110, 4);
  set(0x6423, 0, 1, 1);
  return node;
}

AppliedScan taken(const std::vector<scan::ScannedNode>& nodes, line::ScanApply request) {
  return {request, nodes};
}

std::vector<std::uint8_t> ids(const config::LinePlan& plan) {
  std::vector<std::uint8_t> out;
  for (const auto& node : plan.config.nodes) {
    out.push_back(node.id);
  }
  return out;
}

using Ids = std::vector<std::uint8_t>;

TEST(ScanPlan, TheLineHasTheNodesThatWereFound) {
  const auto plan = plan_of(line_of(kBare), taken({node_of(5), node_of(8)}, {.set_up = true}));
  ASSERT_TRUE(plan.ok());
  EXPECT_EQ(ids(*plan.value), (Ids{5, 8}));
  const line::NodeConfig& node = plan.value->config.nodes[0];
  EXPECT_EQ(node.name, "node5");
  EXPECT_FALSE(node.as_found);
  EXPECT_EQ(node.heartbeat, 200ms);
  ASSERT_EQ(node.objects.size(), 1U);
  EXPECT_EQ(node.objects[0].address, (od::Address{0x6423, 0}));
  const auto line = line::Line::make(plan.value->config);
  ASSERT_TRUE(line.ok());
  EXPECT_EQ((*line.value)->layout(image::Direction::inputs).entries.size(), 2U);
}

// The network list of the manager, as in the IXXAT manual for modules that were found.
TEST(ScanPlan, NodesAreOptionalSlavesOfTheirIdentityThatAreConfiguredAtEachBoot) {
  scan::ScannedNode found = node_of(5);
  const std::uint32_t identity[] = {0x4C47, 0x401, 0x0001'0002, 501};
  for (std::uint8_t sub = 1; sub <= 4; ++sub) {
    std::vector<std::byte> data(4);
    store_le(std::span(data), identity[sub - 1]);
    found.values.push_back({{0x1018, sub}, data});
  }
  std::ranges::sort(found.values, {}, &manager::ObjectWrite::address);
  const auto plan = plan_of(line_of(kBare), taken({found}, {.set_up = true}));
  ASSERT_TRUE(plan.ok());
  const auto line = line::Line::make(plan.value->config);
  ASSERT_TRUE(line.ok());
  const auto own = [&](std::uint16_t index, std::uint8_t sub) {
    return (*line.value)->dictionary().number({index, sub}).value_or(0xDEAD);
  };
  EXPECT_EQ(own(0x1F81, 5), 0x05U) << "an NMT slave that is booted, not mandatory";
  EXPECT_EQ(own(0x1F84, 5), 0x0004'0191U);
  EXPECT_EQ(own(0x1F85, 5), identity[0]);
  EXPECT_EQ(own(0x1F86, 5), identity[1]);
  EXPECT_EQ(own(0x1F87, 5), identity[2]);
  EXPECT_EQ(own(0x1F88, 5), 0U) << "a device may be exchanged";
  EXPECT_EQ(own(0x1F26, 5), 0U) << "the expected configuration is unknown: configured at each boot";
  EXPECT_EQ(own(0x1F27, 5), 0U);
}

// 1017h of the device and 1016h of the manager.
TEST(ScanPlan, TheManagerListensToTheHeartbeatThatADeviceHas) {
  const auto plan = plan_of(line_of(kBare), taken({node_of(5)}, {.set_up = true}));
  ASSERT_TRUE(plan.ok());
  const auto line = line::Line::make(plan.value->config);
  ASSERT_TRUE(line.ok());
  Instant now{10s};
  (*line.value)->start(now);
  const auto hear = [&](std::initializer_list<std::uint8_t> data) {
    can::Frame frame = can::make_frame(0x705, data);
    frame.time = now;
    (*line.value)->receive({&frame, 1}, now);
  };
  hear({0x00});
  std::vector<std::uint16_t> heartbeats;
  can::Frame out;
  for (int i = 0; i < 100; ++i) {
    now += 10ms;
    (*line.value)->advance(now);
    while ((*line.value)->next_frame(out, now)) {
      if (out.id != 0x605) {
        continue;
      }
      const auto index = load_le<std::uint16_t>(out.bytes().data() + 1);
      const bool read = (std::to_integer<unsigned>(out.bytes()[0]) & 0xE0U) == 0x40U;
      can::Frame answer = can::make_frame(0x585, {0x60, 0, 0, 0, 0, 0, 0, 0});
      std::copy_n(out.bytes().data() + 1, 3, answer.data.data() + 1);
      if (read && od::objects::is_pdo_record(index)) {
        answer.data[0] = std::byte{0x80};
        store_le(answer.data.data() + 4, static_cast<std::uint32_t>(AbortCode::no_object));
      } else if (read) {
        answer.data[0] = std::byte{0x43};
        store_le(answer.data.data() + 4, index == 0x1000 ? 0x0004'0191U : 0U);
      } else if (index == 0x1017) {
        heartbeats.push_back(load_le<std::uint16_t>(out.bytes().data() + 4));
      }
      answer.time = now;
      (*line.value)->receive({&answer, 1}, now);
    }
  }
  EXPECT_EQ(heartbeats, (std::vector<std::uint16_t>{200})) << "a time that a device has is kept";
  hear({0x05});
  const auto entry = (*line.value)->dictionary().read({0x1016, 1});
  ASSERT_TRUE(entry.ok());
  EXPECT_EQ(load_le(*entry), 0x0005'01F4U) << "2.5 heartbeat times";
}

TEST(ScanPlan, WhatIsNotSetUpIsLeftAlone) {
  const auto plan = plan_of(line_of(kBare), taken({node_of(5)}, {}));
  ASSERT_TRUE(plan.ok());
  const line::NodeConfig& node = plan.value->config.nodes[0];
  EXPECT_TRUE(node.as_found);
  EXPECT_EQ(node.heartbeat, 0ms) << "1017h is not written";
  EXPECT_EQ(node.heartbeat_consumer, 500ms) << "the heartbeat is monitored";
  EXPECT_TRUE(node.objects.empty());
}

TEST(ScanPlan, AScanOfOneNodeLeavesTheOthersAsTheyAre) {
  const auto first = plan_of(line_of(kBare), taken({node_of(5), node_of(8)}, {.set_up = true}));
  const auto second = plan_of(*first.value, taken({node_of(9)}, {.node = 9}));
  ASSERT_TRUE(second.ok());
  EXPECT_EQ(ids(*second.value), (Ids{5, 8, 9}));
  EXPECT_FALSE(second.value->config.nodes[0].as_found);
  EXPECT_TRUE(second.value->config.nodes[2].as_found);
  const auto all = plan_of(*second.value, taken({node_of(8)}, {.set_up = true}));
  EXPECT_EQ(ids(*all.value), Ids{8}) << "who does not answer any more is gone";
}

TEST(ScanPlan, ANodeThatFellSilentStaysWhatItWas) {
  const auto first = plan_of(line_of(kBare), taken({node_of(5)}, {.set_up = true}));
  scan::ScannedNode silent = node_of(5, AbortCode::timeout);
  silent.values.resize(1);
  const auto again =
      plan_of(*first.value, taken({silent, node_of(6, AbortCode::timeout)}, {.set_up = true}));
  ASSERT_TRUE(again.ok());
  EXPECT_EQ(ids(*again.value), Ids{5});
  EXPECT_EQ(again.value->config.nodes[0].heartbeat, 200ms);
}

TEST(ScanPlan, NobodyFoundChangesNothing) {
  const auto plan = plan_of(line_of(kBare), taken({}, {.set_up = true}));
  EXPECT_FALSE(plan.value.has_value());
  ASSERT_EQ(plan.diagnostics.size(), 1U);
  EXPECT_EQ(plan.diagnostics[0].file, "press");
}

TEST(ScanPlan, ConflictsDoNotKeepTheLineFromRunning) {
  scan::ScannedNode other = node_of(6);
  store_le(std::span(other.values[3].data), 0x185);
  const auto plan = plan_of(line_of(kBare), taken({node_of(5), other}, {.set_up = true}));
  ASSERT_TRUE(plan.ok());
  EXPECT_TRUE(std::ranges::any_of(plan.diagnostics, [](const Diagnostic& note) {
    return note.text == "node 5: TPDO 1 is left out: on its identifier 185h node 6 sends (1800:01)";
  }));
  EXPECT_TRUE(line::Line::make(plan.value->config).ok());
}

TEST(ScanPlan, PdosOnASyncThatNobodyProducesAreNamed) {
  scan::ScannedNode node = node_of(5);
  const auto before = plan_of(line_of(kBare), taken({node}, {.set_up = true}));
  EXPECT_TRUE(std::ranges::none_of(before.diagnostics, [](const Diagnostic& each) {
    return each.severity == Severity::warning;
  }));
  const auto type =
      std::ranges::find(node.values, od::Address{0x1800, 2}, &manager::ObjectWrite::address);
  ASSERT_NE(type, node.values.end());
  type->data = {std::byte{1}};
  const auto plan = plan_of(line_of(kBare), taken({node}, {.set_up = true}));
  EXPECT_TRUE(std::ranges::any_of(plan.diagnostics, [](const Diagnostic& each) {
    return each.severity == Severity::warning &&
           each.text == "TPDO 1 of node5: on SYNC, but no node produces SYNC (sync of the line)";
  }));
}

struct Taker {
  explicit Taker(const std::string& text) : scans(line_of(text), results) {}

  line::Reply reply(std::uint64_t tag, bool found) {
    line::Reply out;
    out.tag = tag;
    out.data = found ? std::vector{node_of(5)} : std::vector<scan::ScannedNode>{};
    return out;
  }

  exchange::Ring<AppliedScan> results{4};
  ScanApplier scans;
};

TEST(ScanApplier, ALineThatIsToScansUntilItFindsSomething) {
  Taker taker(kAuto);
  taker.scans.started(Instant{1s});
  EXPECT_FALSE(taker.scans.due(Instant{2900ms}));
  const auto first = taker.scans.due(Instant{3s});
  ASSERT_TRUE(first);
  ASSERT_EQ(line::kind(*first), line::CommandKind::scan_apply);
  EXPECT_FALSE(std::get<line::ScanApply>(first->request).set_up);
  EXPECT_TRUE(taker.scans.answered(taker.reply(first->tag, false))) << "nobody else asked";
  AppliedScan result;
  EXPECT_FALSE(taker.results.pop(result)) << "a failed scan has no result";
  const auto second = taker.scans.due(Instant{13s});
  ASSERT_TRUE(second);
  EXPECT_TRUE(taker.scans.answered(taker.reply(second->tag, true)));
  ASSERT_TRUE(taker.results.pop(result));
  EXPECT_FALSE(result.nodes.empty());
  EXPECT_EQ(taker.scans.next_wake(), kNever);
}

TEST(ScanApplier, AReplyThatIsNoListOfNodesChangesNothing) {
  Taker taker(kBare);
  taker.scans.asked({.tag = 7, .request = line::ScanApply{.node = 5}});
  line::Reply reply = taker.reply(7, true);
  reply.data = std::vector{std::byte{1}};
  EXPECT_FALSE(taker.scans.answered(reply));
  AppliedScan result;
  EXPECT_FALSE(taker.results.pop(result));
}

TEST(ScanApplier, OthersDoSoOnlyWhenAsked) {
  Taker taker(kBare);
  taker.scans.started(Instant{1s});
  EXPECT_EQ(taker.scans.next_wake(), kNever);
  line::Command command{.tag = 7, .request = line::Scan{}};
  taker.scans.asked(command);
  EXPECT_FALSE(taker.scans.answered(taker.reply(7, true)));
  AppliedScan result;
  EXPECT_FALSE(taker.results.pop(result)) << "a scan that only looks";
  command.request = line::ScanApply{.node = 5, .set_up = true};
  taker.scans.asked(command);
  EXPECT_FALSE(taker.scans.answered(taker.reply(7, true)))
      << "the reply belongs to the client that sent the command";
  ASSERT_TRUE(taker.results.pop(result));
  EXPECT_EQ(result.request.node, 5);
  EXPECT_TRUE(result.request.set_up);
}

TEST(ScanApplier, CommandsWaitFromAResultThatIsToBeAppliedUntilSomebodyHasTakenIt) {
  Taker taker(kBare);
  taker.scans.started(Instant{1s});
  line::Command command{.tag = 7, .request = line::ScanApply{}};
  taker.scans.asked(command);
  EXPECT_FALSE(taker.scans.holds(Instant{2s})) << "the scan is in progress";
  taker.scans.answered(taker.reply(7, true));
  EXPECT_TRUE(taker.scans.holds(Instant{2s}));
  EXPECT_TRUE(taker.scans.holds(Instant{1h})) << "commands are held until the line is replaced";
  EXPECT_EQ(taker.scans.next_wake(), kNever);
  taker.scans.kept();
  EXPECT_FALSE(taker.scans.holds(Instant{2s}));
}

TEST(ScanApplier, CommandsForALineThatWasMadeOfAScanWaitForItsDevices) {
  exchange::Ring<AppliedScan> results{4};
  const auto plan = plan_of(line_of(kBare), taken({node_of(5)}, {}));
  ASSERT_TRUE(plan.value);
  ScanApplier scans(*plan.value, results);
  EXPECT_FALSE(scans.holds(Instant{1s})) << "a line without its interface refuses commands";
  scans.started(Instant{1s});
  EXPECT_TRUE(scans.holds(Instant{2900ms}));
  EXPECT_EQ(scans.next_wake(), Instant{3s});
  EXPECT_FALSE(scans.holds(Instant{3s}));
  EXPECT_EQ(scans.next_wake(), kNever);
}

// A device that was switched on after the scan.
TEST(ScanApplier, ALateComerIsScannedToo) {
  exchange::Ring<AppliedScan> results{4};
  const auto plan = plan_of(line_of(kAuto), taken({node_of(5)}, {}));
  ASSERT_TRUE(plan.value);
  ScanApplier scans(*plan.value, results);
  scans.started(Instant{1s});
  (void)scans.holds(Instant{3s});
  scans.booted_up(5, Instant{10s});
  EXPECT_EQ(scans.next_wake(), kNever) << "the node is known already";
  scans.booted_up(6, Instant{10s});
  EXPECT_FALSE(scans.due(Instant{11900ms})) << "the device may not be ready yet";
  const auto scan = scans.due(Instant{12s});
  ASSERT_TRUE(scan);
  EXPECT_EQ(line::node_of(*scan), 6);
  EXPECT_EQ(line::kind(*scan), line::CommandKind::scan_apply);
  EXPECT_EQ(scans.next_wake(), kNever) << "once for each boot-up message";
  line::Reply reply;
  reply.tag = scan->tag;
  reply.data = std::vector{node_of(6)};
  EXPECT_TRUE(scans.answered(reply));
  AppliedScan result;
  ASSERT_TRUE(results.pop(result));
  const auto after = plan_of(*plan.value, result);
  ASSERT_TRUE(after.value);
  EXPECT_EQ(ids(*after.value), (std::vector<std::uint8_t>{5, 6}));

  scans.booted_up(7, Instant{20s});
  scans.booted_up(8, Instant{21s});
  const auto all = scans.due(Instant{22s});
  ASSERT_TRUE(all);
  EXPECT_EQ(line::node_of(*all), 0) << "of several, all nodes";
}

TEST(ScanApplier, OfALineThatIsConfiguredOtherwiseNobodyIsALateComer) {
  for (const std::string& text : {kBare, kAuto}) {
    Taker taker(text);
    taker.scans.started(Instant{1s});
    const Instant before = taker.scans.next_wake();
    taker.scans.booted_up(6, Instant{1s});
    EXPECT_EQ(taker.scans.next_wake(), before);
  }
}

}  // namespace
}  // namespace linegate::gateway

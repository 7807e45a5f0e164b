// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "stack/pdo/link.h"
#include "stack/scan/conflicts.h"
#include "stack/scan/describe.h"

#include "tests/stack/scan/answers.h"

namespace linegate::scan {
namespace {

using test::Answers;

Answers device() {
  Answers answers;
  answers.set(0x1000, 0, 0x0002'0192, 4);
  return answers;
}

// The identifiers that a manager with all these nodes in its configuration sends and receives.
struct Links {
  std::vector<std::uint32_t> sent;
  std::vector<std::uint32_t> received;
  std::vector<std::string> notes;
};
Links links(const std::vector<ScannedNode>& nodes) {
  const std::vector<LeftOut> pdos = left_out(nodes);
  std::vector<od::DeviceDescription> devices;
  Links out;
  for (const ScannedNode& node : nodes) {
    devices.push_back(describe(node));
    for (std::string& note : leave_out(devices.back(), node.id, pdos)) {
      out.notes.push_back(std::move(note));
    }
  }
  std::vector<pdo::RemoteNode> remotes;
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    auto pdos_of = pdo::describe_pdos(devices[i]);
    EXPECT_TRUE(pdos_of.ok());
    remotes.push_back({.id = nodes[i].id, .pdos = *pdos_of.value, .device = &devices[i]});
  }
  const auto plan = pdo::plan_links(remotes);
  EXPECT_TRUE(plan.ok()) << "the remaining PDOs can be linked";
  for (const pdo::LinkedPdo& pdo : plan.value->tpdos) {
    out.sent.push_back(pdo.parameters.cob_id.id());
  }
  for (const pdo::LinkedPdo& pdo : plan.value->rpdos) {
    out.received.push_back(pdo.parameters.cob_id.id());
  }
  return out;
}

TEST(LeftOut, NobodyCanTellTwoSendersOfOneIdentifierApart) {
  Answers one = device();
  one.set_pdo(0x1800, 0x4000'0185, 255, {0x6041'0010});
  one.set_pdo(0x1801, 0x285, 255, {0x6064'0020});
  Answers other = device();
  other.set_pdo(0x1800, 0x185, 255, {0x6041'0010});
  const Links found = links({one.survey(5), other.survey(6)});
  EXPECT_EQ(found.received, std::vector<std::uint32_t>{0x285});
  ASSERT_EQ(found.notes.size(), 2U);
  EXPECT_EQ(found.notes[0], "TPDO 1 is left out: on its identifier 185h node 6 sends (1800:01)");
}

TEST(LeftOut, WhatAnotherNodeProducesIsNeverTransmitted) {
  Answers sender = device();
  sender.set(0x1005, 0, 0x4000'0080, 4);
  sender.set(0x1014, 0, 0x85, 4);
  sender.set_pdo(0x1800, 0x185, 255, {0x6041'0010});
  Answers receiver = device();
  receiver.set_pdo(0x1400, 0x185, 255, {0x6040'0010});
  receiver.set_pdo(0x1401, 0x85, 255, {0x6040'0010});
  receiver.set_pdo(0x1402, 0x80, 255, {0x6040'0010});
  receiver.set_pdo(0x1403, 0x306, 255, {0x6040'0010});
  const Links found = links({sender.survey(5), receiver.survey(6)});
  EXPECT_EQ(found.sent, std::vector<std::uint32_t>{0x306});
  EXPECT_EQ(found.received, std::vector<std::uint32_t>{0x185}) << "a link between devices";
  EXPECT_EQ(found.notes.size(), 2U);
}

TEST(LeftOut, NeitherIsWhatTwoProduce) {
  Answers one = device();
  one.set_pdo(0x1800, 0x185, 255, {0x6041'0010});
  Answers other = device();
  other.set_pdo(0x1800, 0x185, 255, {0x6041'0010});
  other.set_pdo(0x1400, 0x185, 255, {0x6040'0010});
  const Links found = links({one.survey(5), other.survey(6)});
  EXPECT_TRUE(found.sent.empty());
  EXPECT_TRUE(found.received.empty());
}

TEST(LeftOut, APdoThatCannotBeLinkedDoesNotKeepTheOthersOut) {
  Answers answers = device();
  answers.set_pdo(0x1800, 0x601, 255, {0x6041'0010});  // the identifier of an SDO
  answers.set_pdo(0x1801, 0x285, 255, {0x6064'0020});
  answers.set_pdo(0x1802, 0x385, 255, {0x2000'0140, 0x2000'0240});  // 128 bits
  const Links found = links({answers.survey(5)});
  EXPECT_EQ(found.received, std::vector<std::uint32_t>{0x285});
  EXPECT_EQ(found.notes.size(), 2U);
}

TEST(LeftOut, NothingOfItIsWrittenToTheDevice) {
  Answers one = device();
  one.set_pdo(0x1800, 0x185, 255, {0x6041'0010});
  Answers other = device();
  other.set_pdo(0x1800, 0x185, 255, {0x6041'0010});
  const std::vector<ScannedNode> nodes{one.survey(5), other.survey(6)};
  od::DeviceDescription described = describe(nodes[0]);
  (void)leave_out(described, 5, left_out(nodes));
  EXPECT_TRUE(manager::configuration_writes(described).empty());
}

}  // namespace
}  // namespace linegate::scan

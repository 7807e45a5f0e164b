// SPDX-License-Identifier: Apache-2.0
#include "stack/eds/node_list.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/stack/eds/files.h"

namespace linegate::eds {
namespace {

using test::messages;
using testing::ElementsAre;
using testing::IsEmpty;

TEST(NodeList, NamesTheNodesOfEachNetwork) {
  const auto loaded = read_node_list(
      "[Topology2]\r\nNetName=Pack\r\nNodes=0\r\n"
      "[TOPOLOGY]\r\nNetName=Press\r\nNetRefd=+A1\r\nNodes=0x02\r\nEDSBaseName=devices\r\n"
      "Node7Present=0x01\r\nNode7Name=Ger\xC3\xA4t\r\nNode7DCFName=gear.dcf\r\n"
      "node5present=1\r\nnode5name=ram\r\nnode5refd=+A1-K5\r\nnode5dcfname=ram.dcf\r\n"
      "Node9Present=0x00\r\nNode9Name=spare\r\n",
      "nodelist.cpj");
  EXPECT_THAT(messages(loaded.diagnostics), IsEmpty());
  ASSERT_TRUE(loaded.ok());
  ASSERT_EQ(loaded.value->networks.size(), 2U);
  const ListedNetwork& press = loaded.value->networks[0];
  EXPECT_EQ(press.number, 1);
  EXPECT_EQ(press.name, "Press");
  EXPECT_EQ(press.reference, "+A1");
  EXPECT_EQ(press.folder, "devices");
  EXPECT_EQ(press.line, 4U);
  ASSERT_EQ(press.nodes.size(), 2U);
  EXPECT_EQ(press.nodes[0].id, 5);
  EXPECT_EQ(press.nodes[0].name, "ram");
  EXPECT_EQ(press.nodes[0].reference, "+A1-K5");
  EXPECT_EQ(press.nodes[0].dcf, "ram.dcf");
  EXPECT_EQ(press.nodes[0].line, 12U);
  EXPECT_EQ(press.nodes[1].id, 7);
  EXPECT_EQ(press.nodes[1].name, "Ger\xC3\xA4t");
  EXPECT_EQ(loaded.value->networks[1].number, 2);
  EXPECT_EQ(loaded.value->networks[1].name, "Pack");
  EXPECT_THAT(loaded.value->networks[1].nodes, IsEmpty());
}

TEST(NodeList, SloppyOnesLoadWithAWarningThatNamesFileAndLine) {
  const auto loaded = read_node_list(
      "[Topology]\nNodes=3\nNode5Present=001\nNode5Colour=red\nBase=x\nEDSBaseName=\n[Other]\n",
      "n.cpj");
  EXPECT_TRUE(loaded.ok());
  EXPECT_THAT(messages(loaded.diagnostics),
              ElementsAre("n.cpj:2:7: warning: Nodes is 3, but 1 are present",
                          "n.cpj:3:14: warning: Node5Present: '001' begins with 0, which means "
                          "octal; read as 1",
                          "n.cpj:4:1: warning: key 'Node5Colour' is not known; ignored",
                          "n.cpj:5:1: warning: key 'Base' is not known; ignored",
                          "n.cpj:7:1: note: section 'Other' is not known; ignored"));
}

TEST(NodeList, WhatCannotBeUnderstoodIsAnErrorThatNamesFileAndLine) {
  const auto said = [](std::string_view text) {
    const auto loaded = read_node_list(text, "n.cpj");
    EXPECT_FALSE(loaded.ok()) << text;
    return messages(loaded.diagnostics);
  };
  EXPECT_THAT(said(""), ElementsAre("n.cpj: error: there is no section [Topology]; this is no list "
                                    "of nodes"));
  EXPECT_THAT(said("[Topology]\nNode128Present=1\n"),
              ElementsAre("n.cpj:2:1: error: node-ID 128 is not in 1 to 127"));
  EXPECT_THAT(said("[Topology]\nNode5Present=yes\n"),
              ElementsAre("n.cpj:2:14: error: Node5Present: 'yes' is not a number"));
  EXPECT_THAT(said("[Topology\n"),
              ElementsAre("n.cpj:1:1: error: section name '[Topology' is not closed by ']'"));
}

}  // namespace
}  // namespace linegate::eds

// SPDX-License-Identifier: Apache-2.0
// Multiplexed PDOs and auto-notify of a node, and 29-bit identifiers.
#include "tests/stack/node/node_fixture.h"

namespace linegate::node {
namespace {

using Frames = std::vector<Sent>;

class PdoErrorTest : public NodeTest {};

// RPDO 1 becomes an MPDO in destination address mode; 2000h:1 can be written, 2001h is read-only.
TEST_F(PdoErrorTest, AnMpdoWithoutADestinationIsAnEmcyUntilOneHasIt) {
  boot_and_start();
  EXPECT_EQ(sdo_write({0x1400, 1}, 4, 0x8000'0205), 0U);
  EXPECT_EQ(sdo_write({0x1600, 0}, 1, 255), 0U);
  EXPECT_EQ(sdo_write({0x1400, 1}, 4, 0x205), 0U);
  hear(1ms, 0x205, {0x80 | kNodeId, 0x00, 0x20, 1, 0x34, 0x12, 0, 0});
  EXPECT_EQ(number(0x2000, 1), 0x1234U);
  EXPECT_TRUE(drain(at(1ms)).empty());
  hear(2ms, 0x205, {0x80, 0x00, 0x30, 1, 0x34, 0x12, 0, 0});
  hear(2ms, 0x205, {0x80, 0x01, 0x20, 1, 0x34, 0x12, 0, 0});
  EXPECT_EQ(drain(at(2ms)), (Frames{{at(2ms), 0x085, {0x30, 0x82, 0x11, 1, 0, 0, 0, 0}}}));
  hear(3ms, 0x205, {0x80, 0x00, 0x20, 1, 0x35, 0x12, 0, 0});
  EXPECT_EQ(drain(at(3ms)), (Frames{{at(3ms), 0x085, {0, 0, 0, 0, 0, 0, 0, 0}}}));
  EXPECT_EQ(node->counters().malformed, 0U);
  testing::pop_events(events);
  hear(4ms, 0x205, {kNodeId, 0x00, 0x20, 1, 0, 0, 0, 0});
  hear(5ms, 0x205, {0x80, 0x00, 0x20, 1});
  EXPECT_EQ(node->counters().malformed, 2U);
  EXPECT_EQ(kinds(), (std::vector<EventKind>(2, EventKind::malformed_frame)));
  EXPECT_EQ(number(0x2000, 1), 0x1235U);
  EXPECT_TRUE(drain(at(5ms)).empty());
}

// SYNC, EMCY and PDOs: the same bits in an 11-bit frame are another identifier.
TEST_F(PdoErrorTest, IdentifiersOfTwentyNineBits) {
  boot_and_start();
  EXPECT_EQ(sdo_write({0x1005, 0}, 4, 0x2000'0080), 0U);
  EXPECT_EQ(sdo_write({0x1014, 0}, 4, 0x8000'0085), 0U);
  EXPECT_EQ(sdo_write({0x1014, 0}, 4, 0x2ABC'DEF0), 0U);
  for (const std::uint16_t index : {std::uint16_t{0x1400}, std::uint16_t{0x1801}}) {
    EXPECT_EQ(sdo_write({index, 1}, 4, 0x8000'0000), 0U);
    EXPECT_EQ(sdo_write({index, 1}, 4, 0x2001'0000U + index), 0U);
  }
  drain(at(0ms));
  const auto hear_extended = [this](std::uint32_t id, std::initializer_list<std::uint8_t> data) {
    can::Frame frame = frame_at(at(1ms), id & 0x7FFU, data);
    node->receive({&frame, 1});
    const std::uint64_t unused = node->counters().unused;
    frame.id = id;
    frame.flags = can::Frame::kExtended;
    node->receive({&frame, 1});
    EXPECT_EQ(node->counters().unused, unused);
  };
  hear_extended(0x080, {});
  EXPECT_EQ(node->counters().syncs, 1U);
  hear_extended(0x1'1400, {0x34, 0x12});
  EXPECT_EQ(number(0x2000, 1), 0x1234U);
  EXPECT_TRUE(node->pdos().trigger(2, at(2ms)));
  can::Frame sent;
  while (node->next_frame(sent, at(2ms)) && sent.id != 0x1'1801) {
  }
  EXPECT_EQ(sent.id, 0x1'1801U);
  EXPECT_TRUE(sent.extended());
  hear_extended(0x1'1400, {0x34});
  ASSERT_TRUE(node->next_frame(sent, at(3ms)));
  EXPECT_EQ(sent.id, 0x0ABC'DEF0U);
  EXPECT_TRUE(sent.extended());
}

class AutoNotifyNodeTest : public NodeTest {
 protected:
  AutoNotifyNodeTest() : NodeTest({.node_id = kNodeId, .auto_notify = true}) {}
};

// TPDO 2 sends 2001h:2.
TEST_F(AutoNotifyNodeTest, AnSdoDownloadSendsTheTpdo) {
  boot_and_start();
  others.clear();
  EXPECT_EQ(sdo_write({0x2001, 2}, 2, 0x1234, 1ms), 0U);
  EXPECT_EQ(others, (Frames{{at(1ms), 0x285, {0x34, 0x12}}}));
  others.clear();
  EXPECT_EQ(sdo_write({0x2001, 2}, 2, 0x1234, 2ms), 0U);
  EXPECT_EQ(others, Frames{}) << "the value did not change";
  EXPECT_TRUE(node->dictionary().set({0x2001, 2}, 7));
  EXPECT_TRUE(node->wants_to_send(at(3ms)));
  EXPECT_EQ(drain(at(3ms)), (Frames{{at(3ms), 0x285, {7, 0}}}));
  nmt(0x82, kNodeId, 4ms);
  nmt(0x01, kNodeId, 4ms);
  drain(at(4ms));
  EXPECT_TRUE(node->dictionary().set({0x2001, 2}, 8));
  EXPECT_EQ(drain(at(5ms)), (Frames{{at(5ms), 0x285, {8, 0}}})) << "still on after the reset";
}

}  // namespace
}  // namespace linegate::node

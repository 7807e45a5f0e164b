// SPDX-License-Identifier: Apache-2.0
#include "stack/can/frame.h"

#include <gtest/gtest.h>

#include "stack/can/cob_id.h"

namespace linegate::can {
namespace {

TEST(Frame, FdLengthsAreThoseOfTheDataLengthCode) {
  EXPECT_EQ(fd_length(0), 0);
  EXPECT_EQ(fd_length(8), 8);
  EXPECT_EQ(fd_length(9), 12);
  EXPECT_EQ(fd_length(20), 20);
  EXPECT_EQ(fd_length(25), 32);
  EXPECT_EQ(fd_length(33), 48);
  EXPECT_EQ(fd_length(49), 64);
}

TEST(Frame, LowerIdentifierWinsArbitration) {
  EXPECT_TRUE(wins_arbitration(make_frame(0x000), make_frame(0x001)));
  EXPECT_FALSE(wins_arbitration(make_frame(0x700), make_frame(0x080)));
}

TEST(Frame, DataFrameWinsOverRemoteFrameAndStandardOverExtended) {
  Frame data = make_frame(0x181);
  Frame remote = data;
  remote.flags = Frame::kRemote;
  EXPECT_TRUE(wins_arbitration(data, remote));
  Frame extended;
  extended.flags = Frame::kExtended;
  extended.id = 0x181U << 18U;
  EXPECT_TRUE(wins_arbitration(data, extended));
  EXPECT_TRUE(wins_arbitration(remote, extended));
  extended.id = 0x180U << 18U;
  EXPECT_TRUE(wins_arbitration(extended, data));
}

// CiA 301, 7.3.3: the generic pre-defined connection set.
TEST(CobId, PredefinedConnectionSetOfCia301) {
  EXPECT_EQ(kNmtId, 0x000U);
  EXPECT_EQ(kSyncId, 0x080U);
  EXPECT_EQ(kTimeId, 0x100U);
  struct Row {
    std::uint32_t id;
    std::uint32_t first, last;
  };
  for (const std::uint8_t node : {kMinNodeId, std::uint8_t{5}, kMaxNodeId}) {
    const Row table[] = {
        {kEmcyBase + node, 0x081, 0x0FF},         {default_tpdo_id(1, node), 0x181, 0x1FF},
        {default_rpdo_id(1, node), 0x201, 0x27F}, {default_tpdo_id(2, node), 0x281, 0x2FF},
        {default_rpdo_id(2, node), 0x301, 0x37F}, {default_tpdo_id(3, node), 0x381, 0x3FF},
        {default_rpdo_id(3, node), 0x401, 0x47F}, {default_tpdo_id(4, node), 0x481, 0x4FF},
        {default_rpdo_id(4, node), 0x501, 0x57F}, {kSdoResponseBase + node, 0x581, 0x5FF},
        {kSdoRequestBase + node, 0x601, 0x67F},   {kErrorControlBase + node, 0x701, 0x77F}};
    for (const Row& row : table) {
      EXPECT_EQ(row.id, row.first + node - kMinNodeId) << std::hex << row.first;
      EXPECT_LE(row.id, row.last);
    }
  }
}

TEST(CobId, RestrictedIdentifiersOfCia301) {
  for (std::uint32_t id = 0; id < 0x800; ++id) {
    const bool expected = id <= 0x07F || (id >= 0x101 && id <= 0x180) ||
                          (id >= 0x581 && id <= 0x5FF) || (id >= 0x601 && id <= 0x67F) ||
                          (id >= 0x6E0 && id <= 0x6FF) || (id >= 0x701 && id <= 0x77F) ||
                          id >= 0x780;
    // 700h itself lies between the ranges of the table.
    EXPECT_EQ(is_restricted(id), expected) << std::hex << id;
  }
}

TEST(CobId, BitsOfTheObjectValue) {
  constexpr CobId kPdo{0x4000'0181};
  EXPECT_TRUE(kPdo.valid());
  EXPECT_FALSE(kPdo.extended());
  EXPECT_EQ(kPdo.id(), 0x181U);
  constexpr CobId kExtended{0xA123'4567};
  EXPECT_FALSE(kExtended.valid());
  EXPECT_TRUE(kExtended.extended());
  EXPECT_EQ(kExtended.id(), 0x0123'4567U);
}

}  // namespace
}  // namespace linegate::can

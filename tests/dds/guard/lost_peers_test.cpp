// SPDX-License-Identifier: Apache-2.0
// A participant whose TCP connection was lost is discovered again.
#include "bridges/dds/guard/lost_peers.h"

#include <set>

#include <gtest/gtest.h>

namespace linegate::dds::guard {
namespace {

class LostPeersTest : public testing::Test {
 protected:
  static constexpr Prefix kOne{1}, kOther{2};

  bool may_pass(const Prefix& sender) const {
    return peers.may_pass(sender, known.contains(sender),
                          [this](LostPeers::Connection which) { return ended.contains(which); });
  }
  void find(const Prefix& sender, LostPeers::Connection on, bool endless = false) {
    known.insert(sender);
    peers.found(sender, on, endless, [this](const Prefix& each) { return known.contains(each); });
  }

  LostPeers peers;
  std::set<Prefix> known;
  std::set<LostPeers::Connection> ended;
};

TEST_F(LostPeersTest, ItsDatagramsPassWhileItsConnectionIsOpen) {
  EXPECT_TRUE(may_pass(kOne)) << "not discovered";
  find(kOne, 7);
  EXPECT_TRUE(may_pass(kOne));
  ended.insert(8);
  EXPECT_TRUE(may_pass(kOne)) << "another connection";
}

TEST_F(LostPeersTest, AfterItsConnectionTheyAreDroppedUntilItsLeaseExpires) {
  find(kOne, 7);
  find(kOther, 8);
  ended.insert(7);
  EXPECT_FALSE(may_pass(kOne));
  EXPECT_TRUE(may_pass(kOther));
  known.erase(kOne);
  EXPECT_TRUE(may_pass(kOne)) << "it is discovered again";
  find(kOne, 9);
  EXPECT_TRUE(may_pass(kOne));
  ended.insert(9);
  EXPECT_FALSE(may_pass(kOne));
}

TEST_F(LostPeersTest, OneThatWasDiscoveredOtherwiseIsUnaffected) {
  ended.insert(0);
  find(kOne, 0);
  EXPECT_TRUE(may_pass(kOne)) << "this process opened the connection, and opens it again";
  find(kOther, 7);
  known.erase(kOther);
  find(kOther, 0);
  ended.insert(7);
  EXPECT_TRUE(may_pass(kOther));
}

// Its lease never expires: it would be kept away for ever, and its end would free no place.
TEST_F(LostPeersTest, OneWithAnInfiniteLeaseIsNotKeptAway) {
  find(kOne, 7, true);
  ended.insert(7);
  EXPECT_TRUE(may_pass(kOne));
  known.erase(kOne);
  find(kOne, 8);
  ended.insert(8);
  EXPECT_FALSE(may_pass(kOne)) << "it was discovered again, with another lease";
}

TEST_F(LostPeersTest, OneThatLeftIsForgotten) {
  find(kOne, 7);
  known.erase(kOne);
  find(kOther, 8);
  known.insert(kOne);
  ended.insert(7);
  EXPECT_TRUE(may_pass(kOne));
}

}  // namespace
}  // namespace linegate::dds::guard

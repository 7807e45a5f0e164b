// SPDX-License-Identifier: Apache-2.0
#include "bridges/dds/participant_change.h"

#include <algorithm>

#include <gtest/gtest.h>

namespace linegate::dds {
namespace {

constexpr Instant kBegin{std::chrono::hours(1)};
constexpr Duration kOneSecond = std::chrono::seconds(1);

TEST(ParticipantChange, LooksAtTheAddressesOnceASecond) {
  ParticipantChange change;
  EXPECT_TRUE(change.looks(kBegin));
  EXPECT_FALSE(change.looks(kBegin + kOneSecond / 2));
  EXPECT_EQ(change.next_wake(), kBegin + kOneSecond);
  EXPECT_TRUE(change.looks(kBegin + kOneSecond));
  EXPECT_FALSE(change.begins(kBegin + kOneSecond)) << "no address is new";
}

TEST(ParticipantChange, GivesUpOneThatDoesNotMatchAndTriesAnother) {
  ParticipantChange change;
  change.want();
  EXPECT_TRUE(change.begins(kBegin));
  change.began(kBegin);
  EXPECT_FALSE(change.begins(kBegin + ParticipantChange::kPause)) << "it is not wanted any more";
  EXPECT_FALSE(change.gives_up(kBegin));
  EXPECT_LE(change.next_wake(), kBegin + ParticipantChange::kStep);
  Instant now = kBegin + ParticipantChange::kOverlap;
  Duration pause = ParticipantChange::kPause;
  for (int i = 0; i < 6; ++i) {
    EXPECT_TRUE(change.gives_up(now));
    change.failed(now);
    pause = std::min(2 * pause, ParticipantChange::kLongestPause);
    EXPECT_FALSE(change.begins(now + pause - kOneSecond));
    now += pause;
    EXPECT_TRUE(change.begins(now));
    change.began(now);
    now += ParticipantChange::kOverlap;
  }
}

TEST(ParticipantChange, PausesBetweenTwo) {
  ParticipantChange change;
  change.want();
  change.began(kBegin);
  change.ended();
  change.want();
  EXPECT_FALSE(change.begins(kBegin + ParticipantChange::kPause - kOneSecond));
  EXPECT_TRUE(change.begins(kBegin + ParticipantChange::kPause));
}

TEST(ParticipantChange, TriesAgainAfterAFailure) {
  ParticipantChange change;
  change.want();
  change.failed(kBegin);
  EXPECT_FALSE(change.begins(kBegin + ParticipantChange::kPause));
  EXPECT_TRUE(change.begins(kBegin + 2 * ParticipantChange::kPause));
}

}  // namespace
}  // namespace linegate::dds

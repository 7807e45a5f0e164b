// SPDX-License-Identifier: Apache-2.0
// Judges whole datagrams: GAPs whose numbers the library would keep.
#include <algorithm>
#include <vector>

#include "tests/dds/guard/guard_fixture.h"

namespace linegate::test {
namespace {

using dds::guard::Reason;

constexpr std::int64_t kKeptFew = dds::guard::KeptNumbers::kFew;
constexpr std::int64_t kKept = dds::guard::KeptNumbers::kMost;
constexpr std::int64_t kKeptOfAll = dds::guard::KeptNumbers::kMostOfAll;
constexpr std::int64_t kFar = std::int64_t{1} << 24;

class KeptNumbersTest : public GuardTest {
 protected:
  void find(Sender from) {
    guard.participant_found(prefix_of(from));
    guard.endpoint_found(dds::guard::make_guid(prefix_of(from), kWriter));
    EXPECT_EQ(beat(kFar, from), Reason::none);  // so that the rate limit does not apply
  }
  Reason pass(Datagram datagram) { return guard.judge(datagram.get(), now, {}, &written).reason; }
  // Whether a GAP of that sender from `start` to `base` - 1 is passed to the library.
  bool passes(std::int64_t start, std::int64_t base, Sender from = 1, std::uint32_t bits = 0) {
    auto datagram = Datagram(from).add(0x08, gap(start, base, bits)).add(0x07, heartbeat(1, 1));
    EXPECT_EQ(pass(datagram), Reason::none);
    Datagram rest = Datagram(from).add(0x07, heartbeat(1, 1));
    return !std::equal(rest.get().begin(), rest.get().end(), written.octets().begin(),
                       written.octets().end());
  }
  // A local reader acknowledges all numbers below `base`.
  void acknowledge(std::int64_t base, Sender to = 1, bool little = true) {
    Fields info;
    for (const std::uint8_t octet : prefix_of(to))
      info.u8(octet);
    guard.sent(Datagram(99)
                   .add(0x09, Fields(little).zeros(8))
                   .add(0x0E, info)
                   .add(0x06, acknack(base, base == 0 ? 0 : 32, kReader, kWriter, little))
                   .get());
  }
};

TEST_F(KeptNumbersTest, AGapAboveAMissingNumberIsLeftOut) {
  find(1);
  EXPECT_FALSE(passes(2, kFar));
  EXPECT_TRUE(passes(1, kFar));
  EXPECT_FALSE(passes(2, kFar)) << "the reader may not have received the first GAP";
  EXPECT_EQ(guard.counters().of(Reason::gap), 2U);
}

TEST_F(KeptNumbersTest, AGapFromTheFirstMissingNumberOnCostsNothing) {
  find(1);
  for (const bool little : {true, false}) {
    for (const std::int64_t base : {1'000, 5'000'000}) {
      acknowledge(base, 1, little);
      EXPECT_FALSE(passes(base + 1, base + 5'000'000));
      EXPECT_TRUE(passes(base, base + 5'000'000));
      EXPECT_TRUE(passes(5, base + 5'000'000));
      now += 100 * kSecond;
    }
  }
  acknowledge(0);  // from a reader that has just started
  EXPECT_FALSE(passes(2, 5'000'000));
}

TEST_F(KeptNumbersTest, NumbersAreCountedUntilNoneBelowThemIsMissing) {
  find(1);
  EXPECT_TRUE(passes(10, 10 + kKept / 2));
  EXPECT_TRUE(passes(10 + kKept / 2, 10 + kKept));
  EXPECT_FALSE(passes(2'000'000, 2'000'001));
  acknowledge(9);
  EXPECT_FALSE(passes(2'000'000, 2'000'001));
  acknowledge(10 + kKept - 100);  // 99 numbers above it are left
  EXPECT_TRUE(passes(2'000'000, 2'000'000 + kKept - 99));
  EXPECT_FALSE(passes(2'000'000, 2'000'001));
}

TEST_F(KeptNumbersTest, TheSetOfAGapCountsToo) {
  find(1);
  EXPECT_TRUE(passes(3, 4, 1, 256));
  EXPECT_FALSE(passes(10, 10 + kKept - 256));
  EXPECT_TRUE(passes(10, 10 + kKept - 257));
}

TEST_F(KeptNumbersTest, AWriterThatDiscoveryDidNotFindHasFew) {
  EXPECT_EQ(beat(kFar), Reason::none);
  EXPECT_FALSE(passes(2, 3 + kKeptFew));
  EXPECT_TRUE(passes(2, 2 + kKeptFew));
  EXPECT_FALSE(passes(2, 3));
  find(1);
  EXPECT_TRUE(passes(2, 3));
}

TEST_F(KeptNumbersTest, AllWritersShareWhatExceedsFew) {
  constexpr Sender kWriters = kKeptOfAll / kKept;
  for (Sender from = 1; from <= kWriters; ++from) {
    find(from);
    EXPECT_TRUE(passes(2, 2 + kKept, from));
  }
  find(100);
  EXPECT_FALSE(passes(2, 3 + kKeptFew + kWriters * kKeptFew, 100));
  EXPECT_TRUE(passes(2, 2 + kKeptFew + kWriters * kKeptFew, 100));
  find(101);
  EXPECT_FALSE(passes(2, 3 + kKeptFew, 101));
  EXPECT_TRUE(passes(2, 2 + kKeptFew, 101));
  EXPECT_TRUE(passes(1, 1'000'000, 101));
  acknowledge(2 + kKept, 1);
  EXPECT_TRUE(passes(300, 300 + kKept - kKeptFew, 101));
  guard.participant_lost(prefix_of(2));
  find(102);
  EXPECT_TRUE(passes(2, 2 + kKept, 102));
  guard.endpoint_lost(dds::guard::make_guid(prefix_of(102), kWriter));
  find(103);
  EXPECT_TRUE(passes(2, 2 + kKept, 103));
}

TEST_F(KeptNumbersTest, OtherSubmessagesOfItsDatagramPass) {
  find(1);
  const auto octets = [&] {
    return std::vector<std::uint8_t>(written.octets().begin(), written.octets().end());
  };
  Datagram several;
  several.add(0x08, gap(2, kFar)).add(0x08, gap(1, 5)).add(0x07, heartbeat(5, 9));
  EXPECT_EQ(pass(several.add(0x08, gap(2, kFar))), Reason::none);
  EXPECT_EQ(octets(), Datagram().add(0x08, gap(1, 5)).add(0x07, heartbeat(5, 9)).get());
  // A submessage of length 0 extends to the end of the datagram.
  EXPECT_EQ(pass(Datagram().add(0x07, heartbeat(5, 9)).add(0x08, gap(2, kFar), 0, 0)),
            Reason::none);
  EXPECT_EQ(octets(), Datagram().add(0x07, heartbeat(5, 9)).get());
  EXPECT_EQ(guard.counters().of(Reason::gap), 3U);
  Datagram many;
  for (int i = 0; i < 9; ++i)
    many.add(0x08, gap(2, kFar));
  EXPECT_EQ(pass(many), Reason::none);
  EXPECT_EQ(octets(), Datagram().get());
  EXPECT_EQ(guard.counters().of(Reason::gap), 12U);
}

// A writer keeps samples 2 and 1,000,000, and is matched with a reader that shall receive neither.
TEST_F(KeptNumbersTest, AVolatileReaderGetsBehindAHistoryWithHoles) {
  find(1);
  EXPECT_FALSE(passes(2, 1'000'001));
  acknowledge(2);  // the answer to the HEARTBEAT that follows the GAP
  EXPECT_TRUE(passes(2, 258));
  EXPECT_TRUE(passes(2, 1'000'000));
  acknowledge(1'000'000);
  EXPECT_TRUE(passes(1'000'000, 1'000'001));
}

TEST_F(KeptNumbersTest, WhatIsSentNeedNotBeAskedFor) {
  find(1);
  guard.sent(Datagram().get());
  guard.sent({});
  guard.sent(Datagram().add(0x06, acknack(-5, 3)).get());
  guard.sent(Datagram().add(0x06, Fields().zeros(4)).get());
  acknowledge(50, 7);  // to an unknown writer
  EXPECT_FALSE(passes(2, kFar));
}

}  // namespace
}  // namespace linegate::test

// SPDX-License-Identifier: Apache-2.0
// Judges whole datagrams: the state that the guard keeps of writers and readers.
#include <random>

#include "tests/dds/guard/guard_fixture.h"

namespace linegate::test {
namespace {

using dds::guard::Guard;
using dds::guard::Reason;
namespace entity = dds::guard::entity;

constexpr std::int64_t kFirst = std::int64_t{1} << 24;
constexpr std::int64_t kFirstOfSedp = std::int64_t{1} << 17;
constexpr std::int64_t kBurst = std::int64_t{1} << 20;

TEST_F(GuardTest, ADatagramIsJudgedAsAWholeAndCounted) {
  const Fields good = heartbeat(1, 1);
  const Fields bad = heartbeat(9, 1);
  EXPECT_EQ(judge(Datagram().add(0x09, Fields().zeros(8)).add(0x07, good)), Reason::none);
  EXPECT_EQ(passed, 20U + 12 + 32);
  EXPECT_EQ(judge(Datagram().add(0x07, good).add(0x07, bad)), Reason::sequence_number);
  EXPECT_EQ(judge(Datagram()), Reason::none);
  Datagram other;
  other.get()[0] = 'X';
  EXPECT_EQ(judge(other), Reason::header);
  EXPECT_EQ(guard.counters().received, 4U);
  EXPECT_EQ(guard.counters().of(Reason::sequence_number), 1U);
  EXPECT_EQ(guard.counters().of(Reason::header), 1U);
}

TEST_F(GuardTest, SubmessagesOfUnknownKindPass) {
  EXPECT_EQ(judge(Datagram().add(0x21, Fields().zeros(4)).add(0x81, Fields().zeros(4))),
            Reason::none);
}

// --- fragments -----------------------------------------------------------------------------------

class FragmentsTest : public GuardTest {
 protected:
  // One fragment of that sample.
  Reason fragment(std::int64_t number, std::uint32_t sample, std::uint32_t which = 1,
                  Sender from = 1, unsigned size = 64) {
    return judge(Datagram(from).add(0x16, fragment_of(kWriter, number, sample, which, size)));
  }
  // Sends first fragments of small samples, from that number on, until one is dropped, at most
  // 2,000. Returns how many passed.
  std::uint64_t begin_all(std::int64_t number) {
    std::uint64_t begun = 0;
    while (begun < 2'000 &&
           fragment(number + static_cast<std::int64_t>(begun), 128) == Reason::none)
      ++begun;
    return begun;
  }
  static constexpr std::uint32_t kMiB = 1U << 20U;
};

// A writer with KEEP_LAST 1 replaces a sample that lost a fragment before the fragment is repeated.
TEST_F(FragmentsTest, AWriterOnALinkWithLossesLosesNoWholeSample) {
  std::mt19937 random(1);
  for (std::int64_t number = 1; number <= 30'000; ++number, now += kSecond / 100) {
    for (std::uint32_t which = 1; which <= 3; ++which) {
      if (random() % 10 != 0) {
        ASSERT_EQ(fragment(number, 3 * 1344, which, 1, 1344), Reason::none) << number;
      }
    }
  }
}

TEST_F(FragmentsTest, AWriterThatRepeatsWhatWasLostLosesNothing) {
  std::mt19937 random(1);
  for (std::int64_t number = 1; number <= 30'000; ++number, now += kSecond / 1'000) {
    if (random() % 10 != 0) {
      ASSERT_EQ(fragment(number, 2 * 1344, 1, 1, 1344), Reason::none) << number;
    }
    ASSERT_EQ(fragment(number, 2 * 1344, 2, 1, 1344), Reason::none) << number;
    ASSERT_EQ(fragment(std::max(number - 10, std::int64_t{1}), 2 * 1344, 1, 1, 1344), Reason::none)
        << number;
  }
}

// HEARTBEAT and GAP free nothing in the guard's count: the library may still hold the samples,
// since the guard cannot see whether it accepts these submessages.
TEST_F(FragmentsTest, IncompleteSamplesOfAWriterAreBounded) {
  std::uint64_t begun = begin_all(1);
  EXPECT_EQ(begun, 512U);                           // 4 MiB at 8192 octets each
  EXPECT_EQ(fragment(1, 128, 1, 2), Reason::none);  // another writer
  constexpr std::int64_t kNext = 1'000;
  EXPECT_EQ(judge(Datagram().add(0x07, heartbeat(kNext, kNext))), Reason::none);
  EXPECT_EQ(judge(Datagram().add(0x08, gap(1, 200))), Reason::none);
  EXPECT_EQ(fragment(kNext, 128), Reason::fragment);
  for (int second = 0; second < 100; ++second, now += kSecond)
    begun += begin_all(kNext * (second + 1));
  EXPECT_LE(begun, 512U + 512U * 10);
  EXPECT_GE(begun, 512U * 10);  // in 100 s
}

TEST_F(FragmentsTest, TheirOctetsAreBounded) {
  EXPECT_EQ(fragment(1, 4 * kMiB), Reason::none);
  EXPECT_EQ(fragment(2, 128), Reason::fragment);
  EXPECT_EQ(fragment(1, 4 * kMiB, 2), Reason::none);
  EXPECT_EQ(fragment(1, 2 * kMiB, 1, 2), Reason::none);
  EXPECT_EQ(fragment(2, 2 * kMiB, 1, 2), Reason::none);
  EXPECT_EQ(fragment(3, 128, 1, 2), Reason::fragment);
  now += 11 * kSecond;
  EXPECT_EQ(fragment(2, 4 * kMiB), Reason::none);
  EXPECT_EQ(fragment(3, 128), Reason::fragment);
}

TEST_F(FragmentsTest, ASampleThatIsCompleteCountsNoLonger) {
  for (std::int64_t number = 1; number <= 2'000; ++number) {
    EXPECT_EQ(fragment(number, 128, 1), Reason::none);
    EXPECT_EQ(fragment(number, 128, 2), Reason::none);
    EXPECT_EQ(fragment(number, 128, 2), Reason::none);
  }
  EXPECT_EQ(fragment(2'001, 4 * kMiB), Reason::none);
}

TEST_F(FragmentsTest, ALargeSampleThatIsCompleteCountsNoLonger) {
  for (std::int64_t number = 1; number <= 4; ++number) {
    for (std::uint32_t which = 1; which <= 4 * kMiB / 32'768; ++which)
      EXPECT_EQ(fragment(number, 4 * kMiB, which, 1, 32'768), Reason::none) << number;
  }
}

// The same fragment twice does not complete a sample of two fragments, nor do fragments of another
// size.
TEST_F(FragmentsTest, AFragmentThatIsRepeatedCompletesNoSample) {
  std::uint64_t begun = 0;
  while (begun < 2'000 && fragment(static_cast<std::int64_t>(begun) + 1, 128) == Reason::none) {
    ++begun;
    EXPECT_EQ(fragment(static_cast<std::int64_t>(begun), 128), Reason::none);
  }
  EXPECT_EQ(begun, 512U);
  begun = 0;
  while (begun < 2'000 &&
         fragment(static_cast<std::int64_t>(begun) + 1, 128, 1, 2) == Reason::none) {
    ++begun;
    fragment(static_cast<std::int64_t>(begun), 128, 2, 2, 100);
  }
  EXPECT_LE(begun, 512U);
}

// A sample that is so small costs the library more than its octets. Only the octets of its
// fragments are counted as received.
TEST_F(FragmentsTest, ASmallSampleOfManyFragmentsIsPaidFor) {
  std::uint64_t begun = 0;
  while (begun < 2'000 &&
         fragment(static_cast<std::int64_t>(begun) + 1, 4 * 65, 1, 1, 4) == Reason::none) {
    ++begun;
    for (std::uint32_t which = 1; which <= 64; ++which)
      fragment(static_cast<std::int64_t>(begun), 4 * 65, 1, 1, 4);
  }
  EXPECT_EQ(begun, 512U);
}

// The library may not have seen that number complete.
TEST_F(FragmentsTest, ANumberThatIsCompleteIsNoPassForAnotherSize) {
  for (std::int64_t number = 1; number <= 3; ++number) {
    EXPECT_EQ(fragment(number, 128, 1), Reason::none);
    EXPECT_EQ(fragment(number, 128, 2), Reason::none);
  }
  EXPECT_EQ(fragment(1, 4 * kMiB), Reason::none);
  EXPECT_EQ(fragment(2, 4 * kMiB), Reason::fragment);
  EXPECT_EQ(fragment(3, 4 * kMiB), Reason::fragment);
}

TEST_F(FragmentsTest, AnnouncementsHaveNoFragments) {
  for (const std::uint32_t writer :
       {entity::kParticipants, entity::kPublications, entity::kSubscriptions, entity::kTopics,
        entity::kPublications | entity::kSecure})
    EXPECT_EQ(judge(Datagram().add(0x16, fragment_of(writer, 1, 128))), Reason::discovery);
  EXPECT_EQ(judge(Datagram().add(0x16, fragment_of(entity::kStateless, 1, 128))), Reason::none);
}

TEST_F(FragmentsTest, AWriterThatIsLostIsForgotten) {
  guard.participant_found(prefix_of(1));
  EXPECT_EQ(fragment(1, 4 * kMiB), Reason::none);
  EXPECT_EQ(fragment(2, 128), Reason::fragment);
  guard.endpoint_lost(dds::guard::make_guid(prefix_of(1), kWriter));
  EXPECT_EQ(fragment(2, 128), Reason::none);
}

// --- statistics ----------------------------------------------------------------------------------

TEST_F(GuardTest, AStatisticsSubmessageAtTheEndIsCutOff) {
  const Fields statistics = Fields().zeros(56);
  EXPECT_EQ(judge(Datagram().add(0x07, heartbeat(1, 1)).add(0x80, statistics)), Reason::none);
  EXPECT_EQ(passed, 20U + 32);
  EXPECT_EQ(judge(Datagram().add(0x80, statistics)), Reason::none);
  EXPECT_EQ(passed, 20U);
}

TEST_F(GuardTest, AStatisticsSubmessageElsewhereOrOfAnotherLengthIsDropped) {
  const Fields statistics = Fields().zeros(56);
  Datagram known = Datagram().add(0x80, statistics).add(0x01, Fields());
  EXPECT_EQ(known.get().size(), 84U);
  EXPECT_EQ(judge(known), Reason::statistics);
  EXPECT_EQ(judge(Datagram().add(0x80, Fields().zeros(52))), Reason::statistics);
  EXPECT_EQ(judge(Datagram().add(0x80, Fields().zeros(60))), Reason::statistics);
  Datagram of_another_vendor = known;
  of_another_vendor.get()[7] = 0x10;
  EXPECT_EQ(judge(of_another_vendor), Reason::none);
  EXPECT_EQ(passed, 84U);
}

// --- sequence numbers ----------------------------------------------------------------------------

TEST_F(GuardTest, TheFirstNumberOfAWriterMayPositionALateJoiner) {
  EXPECT_EQ(skip(2'000'000, 1), Reason::none);
  EXPECT_EQ(beat(2'000'000, 1), Reason::none);
  EXPECT_EQ(skip(kFirst, 2), Reason::none);
  EXPECT_EQ(skip(kFirst + 1, 3), Reason::rate);
  EXPECT_EQ(skip(5, 3), Reason::none);
}

TEST_F(GuardTest, NumbersAdvanceBy100000ASecond) {
  EXPECT_EQ(beat(1), Reason::none);
  EXPECT_EQ(beat(1 + 4'096), Reason::none);
  EXPECT_EQ(beat(2 + 4'096), Reason::rate);
  now += kSecond;
  EXPECT_EQ(beat(1 + 4'096 + 100'001), Reason::rate);
  EXPECT_EQ(beat(1 + 4'096 + 100'000), Reason::none);
  EXPECT_EQ(beat(3), Reason::none);  // a HEARTBEAT with an old number
}

TEST_F(GuardTest, ShortPausesAddUp) {
  std::int64_t number = 1;
  EXPECT_EQ(beat(number), Reason::none);
  for (int i = 0; i < 20'000; ++i) {
    now += 10'500;
    EXPECT_EQ(beat(++number), Reason::none) << i;
  }
  EXPECT_EQ(beat(number + 4'096 + 900), Reason::none);  // nothing was lost to rounding
}

TEST_F(GuardTest, AtMost2To20NumbersAreSaved) {
  EXPECT_EQ(beat(kFirst), Reason::none);
  for (int i = 0; i < 100; ++i) {
    now += kSecond;
    EXPECT_EQ(beat(kFirst), Reason::none);
  }
  EXPECT_EQ(beat(kFirst + kBurst + 1), Reason::rate);
  EXPECT_EQ(beat(kFirst + kBurst), Reason::none);
}

TEST_F(GuardTest, AfterSilenceAWriterIsPositionedAgain) {
  EXPECT_EQ(beat(1), Reason::none);
  now += 9 * kSecond;
  EXPECT_EQ(beat(5'000'000), Reason::rate);
  now += 10 * kSecond;
  EXPECT_EQ(beat(5'000'000), Reason::none);
  now += 10 * kSecond;
  EXPECT_EQ(beat(kFirst + kBurst), Reason::rate);
}

TEST_F(GuardTest, TheKnownAttacksAreDropped) {
  for (const std::uint32_t writer :
       {kWriter, entity::kPublications, entity::kSubscriptions, entity::kLiveliness}) {
    for (std::int64_t i = 1; i < 50; ++i)
      EXPECT_EQ(beat(i, 1, writer), Reason::none);
    EXPECT_EQ(beat(std::int64_t{1} << 40, 1, writer), Reason::rate);
    EXPECT_EQ(judge(Datagram().add(0x08, gap(1, std::int64_t{1} << 40, 0, true, writer))),
              Reason::rate);
    EXPECT_EQ(judge(Datagram().add(0x08, gap(1, std::int64_t{1} << 62, 0, true, writer))),
              Reason::sequence_number);
  }
  // Far ahead, in steps.
  Reason reason = Reason::none;
  std::int64_t at = 50;
  for (int i = 0; i < 1'000 && reason == Reason::none; ++i)
    reason = skip(at += 60'000);
  EXPECT_EQ(reason, Reason::rate);
  EXPECT_LT(at, 200'000);
}

// The library processes all numbers of a GAP, even those that it has already.
TEST_F(GuardTest, AGapIsPaidForEachTime) {
  EXPECT_EQ(skip(kFirst), Reason::none);
  EXPECT_EQ(skip(kFirst), Reason::none);  // permitted a second time: it may be for another reader
  EXPECT_EQ(skip(kFirst), Reason::rate);
  EXPECT_EQ(skip(256), Reason::none);
  now += 30 * kSecond;
  EXPECT_EQ(skip(kFirst), Reason::rate);
  now += 10 * kSecond;
  EXPECT_EQ(skip(kFirst), Reason::none);
}

TEST_F(GuardTest, GapsOfAllWritersAreBoundedTogether) {
  for (Sender from = 50; from < 70; ++from)
    // Of writers that discovery did not find: not counted.
    EXPECT_EQ(skip(kFirst, from), Reason::none);
  int passed_on = 0;
  for (Sender from = 1; from <= 20; ++from) {
    guard.endpoint_found(dds::guard::make_guid(prefix_of(from), kWriter));
    passed_on += skip(kFirst, from) == Reason::none ? 1 : 0;
  }
  EXPECT_EQ(passed_on, 4);
  now += 20 * kSecond;
  EXPECT_EQ(skip(kFirst, 30), Reason::none);
}

constexpr std::uint32_t kSedpWriters[] = {entity::kPublications, entity::kSubscriptions,
                                          entity::kTopics, entity::kSecure | entity::kPublications,
                                          entity::kSecure | entity::kSubscriptions};

TEST_F(GuardTest, TheFirstNumberOfSedpIsLower) {
  for (const std::uint32_t writer : kSedpWriters) {
    EXPECT_EQ(beat(kFirstOfSedp, 1, writer), Reason::none);
    EXPECT_EQ(beat(kFirstOfSedp + 1, 2, writer), Reason::rate);
  }
  EXPECT_EQ(beat(kFirst, 1, entity::kLiveliness), Reason::none);
}

// The library searches all known endpoints for each number.
TEST_F(GuardTest, GapsOfSedpAreBoundedTogether) {
  int passed_on = 0;
  Sender from = 1;
  for (const std::uint32_t writer : kSedpWriters) {
    guard.participant_found(prefix_of(++from));
    const auto to_most = gap(1, kFirstOfSedp + 1, 0, true, writer);
    passed_on += judge(Datagram(from).add(0x08, to_most)) == Reason::none ? 1 : 0;
    EXPECT_EQ(judge(Datagram(from).add(0x08, gap(1, 33, 0, true, writer))), Reason::none);
  }
  EXPECT_EQ(passed_on, 2);
  now += 5 * kSecond;
  guard.participant_found(prefix_of(30));
  EXPECT_EQ(judge(Datagram(30).add(0x08, gap(1, kFirstOfSedp + 1, 0, true, entity::kPublications))),
            Reason::none);
}

TEST_F(GuardTest, ALongGapOfADiscoveredWriterIsExpectedToTakeItsTime) {
  EXPECT_EQ(skip(1'000'000, 1), Reason::none);
  EXPECT_EQ(guard.calls().overdue(now), now);  // the library ignores it
  guard.endpoint_found(dds::guard::make_guid(prefix_of(2), kWriter));
  EXPECT_EQ(skip(1'000'000, 2), Reason::none);
  EXPECT_EQ(guard.calls().overdue(now + kSecond), 0);
  EXPECT_EQ(guard.calls().overdue(now + 2 * kSecond), kSecond);
}

TEST_F(GuardTest, DataAndFragmentsAdvanceTheirWriterToo) {
  EXPECT_EQ(judge(Datagram().add(0x15, data(1))), Reason::none);
  EXPECT_EQ(judge(Datagram().add(0x15, data(10'000))), Reason::rate);
  const Fields fragment = Fields()
                              .u16(0)
                              .u16(28)
                              .entity(0)
                              .entity(kWriter)
                              .number(10'000)
                              .u32(1)
                              .u16(1)
                              .u16(4)
                              .u32(8)
                              .zeros(4);
  EXPECT_EQ(judge(Datagram().add(0x16, fragment)), Reason::rate);
}

TEST_F(GuardTest, InfoSourceNamesTheParticipantOfWhatFollows) {
  EXPECT_EQ(beat(1, 1), Reason::none);
  Fields source = Fields().zeros(8);
  for (const std::uint8_t octet : prefix_of(1))
    source.u8(octet);
  EXPECT_EQ(judge(Datagram(2).add(0x0C, source).add(0x07, heartbeat(9'000, 9'000))), Reason::rate);
  EXPECT_EQ(judge(Datagram(2).add(0x07, heartbeat(9'000, 9'000))), Reason::none);
}

TEST_F(GuardTest, NumbersOfStatelessWritersHaveNoEffect) {
  EXPECT_EQ(beat(1, 1, entity::kParticipants), Reason::none);
  EXPECT_EQ(beat(1'000'000'000, 1, entity::kParticipants), Reason::none);
  EXPECT_EQ(beat(1'000'000'000, 1, entity::kStateless), Reason::none);
}

// --- the tables ----------------------------------------------------------------------------------

TEST_F(GuardTest, InventedWritersDoNotDisplaceThoseThatDiscoveryFound) {
  const auto live = dds::guard::make_guid(prefix_of(1), kWriter);
  EXPECT_EQ(beat(1), Reason::none);
  EXPECT_EQ(beat(1, 1, entity::kPublications), Reason::none);
  guard.participant_found(prefix_of(1));
  guard.endpoint_found(live);
  now += kSecond;
  for (std::uint32_t i = 0; i < 60'000; ++i) {
    ++now;
    EXPECT_EQ(beat(1, 2, i << 8U | 3U), Reason::none);
  }
  // A writer without a place would count as new, and a new writer may start at any number.
  EXPECT_EQ(beat(1'000'000), Reason::rate);
  EXPECT_EQ(beat(1'000'000, 1, entity::kPublications), Reason::rate);
}

TEST_F(GuardTest, AWriterThatDiscoveryFoundHasAPlaceAmongInventedOnes) {
  for (std::uint32_t i = 0; i < 60'000; ++i)
    EXPECT_EQ(beat(1, 2, i << 8U | 3U), Reason::none);
  guard.endpoint_found(dds::guard::make_guid(prefix_of(1), kWriter));
  EXPECT_EQ(beat(1), Reason::none);
  for (std::uint32_t i = 0; i < 60'000; ++i)
    EXPECT_EQ(beat(1, 3, i << 8U | 3U), Reason::none);
  EXPECT_EQ(beat(1'000'000), Reason::rate);
}

TEST_F(GuardTest, TheWritersOfARemovedParticipantAreForgotten) {
  guard.participant_found(prefix_of(1));
  guard.endpoint_found(dds::guard::make_guid(prefix_of(1), kWriter));
  EXPECT_EQ(beat(1), Reason::none);
  EXPECT_EQ(beat(5'000'000), Reason::rate);
  guard.participant_lost(prefix_of(1));
  EXPECT_EQ(beat(5'000'000), Reason::none);
}

TEST_F(GuardTest, MoreWritersThanPlacesAreDroppedIfAllWereFound) {
  Reason last = Reason::none;
  for (std::uint32_t i = 0; i < 20'000; ++i) {
    const std::uint32_t writer = i << 8U | 3U;
    guard.endpoint_found(dds::guard::make_guid(prefix_of(1), writer));
    last = beat(1, 1, writer);
    if (last != Reason::none)
      break;
  }
  EXPECT_EQ(last, Reason::writers);
}

// --- reliability ---------------------------------------------------------------------------------

Fields guid_fields(Sender whose, std::uint32_t id) {
  Fields out;
  for (const std::uint8_t octet : dds::guard::make_guid(prefix_of(whose), id))
    out.u8(octet);
  return out;
}

Datagram announce(Sender from, unsigned reliability, bool reader = true) {
  const Fields guid = guid_fields(from, kReader);
  const Fields list = Fields()
                          .u8(0)
                          .u8(3)
                          .u16(0)
                          .parameter(0x5A, guid)
                          .parameter(0x1A, Fields().u32(reliability).zeros(8))
                          .sentinel();
  const std::uint32_t writer = reader ? entity::kSubscriptions : entity::kPublications;
  return Datagram(from).add(0x15, data(1, writer).octets(list.get()), kHasData);
}

TEST_F(GuardTest, AReaderKeepsTheReliabilityThatItAnnouncedFirst) {
  EXPECT_EQ(judge(announce(1, 1)), Reason::none);
  EXPECT_EQ(judge(announce(1, 1)), Reason::none);
  EXPECT_EQ(judge(announce(1, 2)), Reason::reliability);
  EXPECT_EQ(judge(announce(2, 2)), Reason::none);
  EXPECT_EQ(judge(announce(2, 1)), Reason::reliability);
  EXPECT_EQ(judge(announce(1, 2, false)), Reason::none);  // a writer
}

TEST_F(GuardTest, ABestEffortReaderAcknowledgesNothing) {
  EXPECT_EQ(judge(Datagram(1).add(0x06, acknack(1, 0))), Reason::none);
  EXPECT_EQ(judge(announce(1, 1)), Reason::none);
  EXPECT_EQ(judge(announce(2, 2)), Reason::none);
  EXPECT_EQ(judge(Datagram(1).add(0x06, acknack(1, 0))), Reason::reliability);
  EXPECT_EQ(judge(Datagram(2).add(0x06, acknack(1, 0))), Reason::none);
}

TEST_F(GuardTest, AReaderThatDiscoveryLostMayComeAgainOtherwise) {
  EXPECT_EQ(judge(announce(1, 1)), Reason::none);
  guard.endpoint_lost(dds::guard::make_guid(prefix_of(1), kReader));
  EXPECT_EQ(judge(announce(1, 2)), Reason::none);
}

// --- discovery -----------------------------------------------------------------------------------

TEST_F(GuardTest, ASampleOfDiscoveryIsAListOfParameters) {
  const Fields good =
      Fields().u8(0).u8(3).u16(0).parameter(0x50, guid_fields(1, 0x000001C1)).sentinel();
  const Fields bad = Fields().u8(0).u8(3).u16(0).u16(5).u16(8).u32(900).zeros(4).sentinel();
  for (const std::uint32_t writer : {entity::kParticipants, entity::kPublications, entity::kTopics,
                                     entity::kSubscriptions, 0xFF0003C2U, 0xFF0101C2U}) {
    EXPECT_EQ(judge(Datagram().add(0x15, data(1, writer).octets(good.get()), kHasData)),
              Reason::none);
    EXPECT_EQ(judge(Datagram().add(0x15, data(1, writer).octets(bad.get()), kHasData)),
              Reason::discovery);
  }
  EXPECT_EQ(judge(Datagram().add(0x15, data(1).octets(bad.get()), kHasData)), Reason::none);
  EXPECT_EQ(judge(Datagram().add(0x15, data(1, entity::kLiveliness).zeros(12), kHasData)),
            Reason::discovery);
}

}  // namespace
}  // namespace linegate::test

// SPDX-License-Identifier: Apache-2.0
// Whole datagrams: the source timestamps of the datagrams that are passed on, octet by octet.
#include <algorithm>
#include <map>
#include <random>
#include <utility>
#include <vector>

#include "tests/dds/guard/guard_fixture.h"

namespace linegate::test {
namespace {

using dds::guard::kHeader;
using dds::guard::Kind;
using dds::guard::Octets;
using dds::guard::Reason;
using dds::guard::SampleTime;
using dds::guard::SampleTimes;

constexpr std::size_t kInfoTsSize = 12;

Fields time(std::uint32_t seconds, std::uint32_t fraction, bool little = true) {
  return Fields(little).u32(seconds).u32(fraction);
}

class SampleTimesTest : public GuardTest {
 protected:
  // The datagram that the guard passes on.
  std::vector<std::uint8_t> pass(Datagram datagram) {
    EXPECT_EQ(guard.judge(datagram.get(), now, {}, &written).reason, Reason::none);
    return {written.octets().begin(), written.octets().end()};
  }
  // The timestamps of its samples as Fast DDS reads them: from the preceding INFO_TS, signed, or 0.
  std::vector<SampleTime> times(const Datagram& datagram) {
    const std::vector<std::uint8_t> octets = pass(datagram);
    std::vector<SampleTime> found;
    SampleTime current = 0;
    dds::guard::Submessage it;
    for (std::size_t at = kHeader; at < octets.size(); at += 4 + it.body.size()) {
      EXPECT_EQ(dds::guard::split(octets, at, it), Reason::none);
      if (it.kind == Kind::info_ts)
        current = (it.flags & 2) != 0 ? 0 : it.body.number(0);
      else if (it.kind == Kind::data || it.kind == Kind::data_frag)
        found.push_back(current);
    }
    return found;
  }
  // The timestamp of a datagram with one sample.
  SampleTime time_of(std::int64_t number, SampleTime sent, Sender from = 1) {
    const auto bits = static_cast<std::uint64_t>(sent);
    const Fields info =
        time(static_cast<std::uint32_t>(bits >> 32U), static_cast<std::uint32_t>(bits));
    return times(Datagram(from).add(0x09, info).add(0x15, data(number))).at(0);
  }
};

TEST_F(SampleTimesTest, TheFirstSampleKeepsItsTimestamp) {
  for (const bool little : {true, false}) {
    const Sender from = little ? 1 : 2;
    auto first = Datagram(from)
                     .add(0x09, time(0x01020304, 0x05060708, little))
                     .add(0x15, data(7, kWriter, little));
    EXPECT_EQ(pass(first), first.get());
    // The next number gets the next timestamp, whatever timestamp the sender sent.
    for (const std::uint32_t seconds : {0U, 0x01020305U, 0xFFFFFFFFU}) {
      auto next = Datagram(from)
                      .add(0x09, time(seconds, 0, little))
                      .add(0x15, data(8, kWriter, little))
                      .add(0x07, heartbeat(1, 8, little));
      auto wanted = Datagram(from)
                        .add(0x09, time(0x01020304, 0x05060709, little))
                        .add(0x15, data(8, kWriter, little))
                        .add(0x07, heartbeat(1, 8, little));
      EXPECT_EQ(pass(next), wanted.get());
    }
    auto late =
        Datagram(from).add(0x09, time(0x7FFFFFFF, 0, little)).add(0x15, data(1, kWriter, little));
    auto wanted = Datagram(from)
                      .add(0x09, time(0x01020304, 0x05060702, little))
                      .add(0x15, data(1, kWriter, little));
    EXPECT_EQ(pass(late), wanted.get());
  }
}

// Otherwise a writer that claims a time in the future would displace the samples of every other one
// from a full history.
TEST_F(SampleTimesTest, AFirstTimestampInTheFutureIsThatOfTheReception) {
  static constexpr SampleTime kNow = SampleTime{1'800'000'000} << 32;
  guard.set_utc([] { return kNow; });
  EXPECT_EQ(time_of(7, kNow + 1, 1), kNow);
  EXPECT_EQ(time_of(8, kNow + 1, 1), kNow + 1) << "the next number, whatever its timestamp";
  EXPECT_EQ(time_of(7, INT64_MAX, 2), kNow);
  EXPECT_EQ(time_of(7, kNow - 5, 3), kNow - 5) << "a time in the past stays";
}

TEST_F(SampleTimesTest, ASampleWithoutATimestampGetsOne) {
  EXPECT_EQ(pass(Datagram().add(0x15, data(1))),
            Datagram().add(0x09, time(0, 0)).add(0x15, data(1)).get());
  EXPECT_EQ(pass(Datagram().add(0x15, data(3, kWriter, false))),
            Datagram().add(0x09, time(0, 2)).add(0x15, data(3, kWriter, false)).get());
  const Fields none;
  const auto wanted = Datagram().add(0x09, none, 2).add(0x09, time(0, 3)).add(0x15, data(4)).get();
  EXPECT_EQ(pass(Datagram().add(0x09, none, 2).add(0x15, data(4))), wanted);
  // The second INFO_TS invalidates the first.
  EXPECT_EQ(times(Datagram(2).add(0x09, time(5, 0)).add(0x09, none, 2).add(0x15, data(4))),
            std::vector<SampleTime>{0});
}

TEST_F(SampleTimesTest, EachSampleOfADatagramHasItsOwn) {
  constexpr SampleTime kSent = SampleTime{9} << 32;
  const std::uint32_t other = 0x00000303;
  EXPECT_EQ(times(Datagram()
                      .add(0x09, time(9, 0))
                      .add(0x15, data(5))
                      .add(0x15, data(6))
                      .add(0x15, data(1, other))
                      .add(0x15, data(3))
                      .add(0x15, data(2, other))),
            (std::vector<SampleTime>{kSent, kSent + 1, kSent, kSent - 2, kSent + 1}));
  EXPECT_EQ(written.octets().size(), kHeader + 5 * (kInfoTsSize + 24));
  // A submessage between INFO_TS and sample: INFO_DST, or one of another writer.
  EXPECT_EQ(
      times(Datagram().add(0x09, time(10, 0)).add(0x0E, Fields().zeros(12)).add(0x15, data(7))),
      std::vector<SampleTime>{kSent + 2});
  EXPECT_EQ(written.octets().size(), kHeader + kInfoTsSize + 16 + 24);
  EXPECT_EQ(times(Datagram().add(0x09, time(10, 0)).add(0x07, heartbeat(1, 1)).add(0x15, data(8))),
            std::vector<SampleTime>{kSent + 3});
  EXPECT_EQ(written.octets().size(), kHeader + 2 * kInfoTsSize + 32 + 24);
}

TEST_F(SampleTimesTest, AllFragmentsOfASampleHaveTheSame) {
  constexpr SampleTime kSent = SampleTime{9} << 32;
  const auto fragment = [](std::int64_t number, std::uint32_t which) {
    return fragment_of(kWriter, number, 192, which);
  };
  EXPECT_EQ(times(Datagram()
                      .add(0x09, time(9, 0))
                      .add(0x16, fragment(4, 1))
                      .add(0x16, fragment(4, 2))
                      .add(0x15, data(5))),
            (std::vector<SampleTime>{kSent, kSent, kSent + 1}));
  EXPECT_EQ(times(Datagram().add(0x09, time(77, 0)).add(0x16, fragment(4, 3))),
            std::vector<SampleTime>{kSent});
}

TEST_F(SampleTimesTest, SubmessagesWithoutASampleAreLeftAsTheyAre) {
  Datagram datagram;
  datagram.add(0x09, time(1, 2, false))
      .add(0x15, data(3, dds::guard::entity::kStateless, false).zeros(8))
      .add(0x06, acknack(1, 32))
      .add(0x21, Fields().zeros(3));
  EXPECT_EQ(pass(datagram), datagram.get());
}

// The timestamps of a writer rise up to the largest value, wherever they begin.
TEST_F(SampleTimesTest, TimestampsDoNotWrap) {
  constexpr SampleTime kMost = INT64_MAX;
  Sender from = 1;
  for (const SampleTime sent : {kMost, -kMost - 1, SampleTime{-1}, SampleTime{0}}) {
    const SampleTime first = time_of(1 << 24, sent, from);
    EXPECT_EQ(time_of(1, sent, from), first - (1 << 24) + 1);
    SampleTimes times;
    EXPECT_LT(times.of(1, sent), times.of(dds::guard::kLastNumber, 0)) << sent;
    SampleTimes back;
    EXPECT_GT(back.of(dds::guard::kLastNumber, sent), back.of(1, 0)) << sent;
    ++from;
  }
}

TEST_F(SampleTimesTest, TimestampsStayWhenAWriterIsFoundAgain) {
  const auto writer = dds::guard::make_guid(prefix_of(1), kWriter);
  guard.participant_found(prefix_of(1));
  guard.endpoint_found(writer);
  EXPECT_EQ(time_of(10, 1'000'000), 1'000'000);
  guard.endpoint_lost(writer);
  guard.endpoint_found(writer);
  EXPECT_EQ(time_of(9, 5), 999'999);
  guard.participant_lost(prefix_of(1));
  EXPECT_EQ(time_of(11, 5), 1'000'001);
  EXPECT_EQ(time_of(11, 5, 2), 5);  // another writer
}

TEST_F(SampleTimesTest, ALongDatagramHasRoomForAllTimestamps) {
  written = dds::guard::PassedOn(64);
  Datagram datagram;
  for (std::int64_t number = 1; number <= 3'000; ++number)
    datagram.add(0x15, data(number));
  const std::vector<SampleTime> found = times(datagram);
  ASSERT_EQ(found.size(), 3'000U);
  for (std::size_t i = 0; i < found.size(); ++i)
    EXPECT_EQ(found[i], static_cast<SampleTime>(i));
}

// --- the reader ----------------------------------------------------------------------------------

struct Sample {
  Sender writer = 0;
  std::int64_t number = 0;
  SampleTime time = 0;
};

// Inserts a sample like ReaderHistory::add_change of Fast DDS 2.9.1.
void insert(std::vector<Sample>& history, const Sample& sample) {
  const auto before = [](const Sample& a, const Sample& b) {
    return a.writer == b.writer ? a.number < b.number : a.time < b.time;
  };
  auto at = history.end();
  if (!history.empty() && before(sample, history.back()))
    at = std::lower_bound(history.begin(), history.end(), sample, before);
  history.insert(at, sample);
}

bool is_sorted(const std::vector<Sample>& history) {
  std::map<Sender, std::int64_t> highest;
  return std::all_of(history.begin(), history.end(), [&](const Sample& it) {
    return it.number > std::exchange(highest[it.writer], it.number);
  });
}

// Samples of three writers in any order, with any timestamps; some are taken meanwhile.
TEST_F(SampleTimesTest, AReaderHasTheNumbersOfEachWriterInTheirOrder) {
  std::mt19937 random(1);
  const auto below = [&](unsigned end) { return static_cast<int>(random() % end); };
  int unsorted = 0;
  for (int course = 0; course < 2'000; ++course, now += 20 * kSecond) {
    std::vector<Sample> due;
    for (std::int64_t number = 1; number <= 12; ++number) {
      for (Sender writer = 1; writer <= 3; ++writer)
        due.push_back({writer, 12 * course + number, below(8)});
    }
    std::shuffle(due.begin(), due.end(), random);
    std::vector<Sample> bare;
    std::vector<Sample> guarded;
    for (Sample& sample : due) {
      insert(bare, sample);
      sample.time = time_of(sample.number, sample.time, sample.writer);
      insert(guarded, sample);
      ASSERT_TRUE(is_sorted(guarded));
      if (below(4) == 0)
        guarded.erase(guarded.begin() + below(static_cast<unsigned>(guarded.size())));
    }
    unsorted += is_sorted(bare) ? 0 : 1;
  }
  EXPECT_GT(unsorted, 1'000) << "the order by the timestamps as sent";
}

}  // namespace
}  // namespace linegate::test

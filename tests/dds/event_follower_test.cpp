// SPDX-License-Identifier: Apache-2.0
// A reader that loses samples, is away, or sees gateways and journals come and go has each event
// once, in order.
#include "bridges/dds/event_follower.h"

#include <algorithm>
#include <limits>
#include <optional>
#include <random>
#include <span>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace linegate::dds {
namespace {

using request::EventPosition;
using request::JournalCursor;
using std::chrono::milliseconds;

// A gateway with one line and a journal that stores after some time, a reader that may lose
// samples, and the time.
class Plant {
 public:
  explicit Plant(bool from_oldest = false) : follower(from_oldest) {}

  struct Stored {
    std::uint64_t stream;
    std::uint64_t number;
    bool operator==(const Stored&) const = default;
  };

  void start(std::uint64_t of_stream, std::uint64_t after) {
    ++incarnation;
    stream = of_stream;
    number = after;
    tell_state();
  }
  void tell_state() {
    follower.receive_gateway("g", incarnation, stream, 0, now);
    follower.receive_line("g", "l", number, now);
  }
  // An event is published: the sample reaches the reader or not, the journal stores it or not.
  void publish(bool reaches = true, bool is_stored = true) {
    ++number;
    if (reaches)
      take(stream, number);
    if (is_stored)
      not_stored_yet.push_back({stream, number});
    else
      unstored.push_back({stream, number});
  }
  void take(std::uint64_t of_stream, std::uint64_t of_number) {
    FollowedEvent event;
    event.source = {.gateway = "g", .line = "l"};
    event.event.stream = of_stream;
    event.event.number = of_number;
    follower.take(std::move(event), now);
  }
  void commit() {
    journal.insert(journal.end(), not_stored_yet.begin(), not_stored_yet.end());
    not_stored_yet.clear();
  }
  void lose_journal() {
    journal.clear();
    not_stored_yet.clear();
    ++file;
  }

  // Passes the time in steps, and answers requests.
  void run(Duration time, Duration step = milliseconds(50)) {
    for (const Instant end = now + time; now < end; now += step) {
      while (const auto fetch = follower.due(now)) {
        ++requests;
        follower.receive_answer("g", "l", answer(fetch->read), now);
      }
      drain();
    }
  }
  void drain() {
    for (EventFollower::Item item; follower.pop(item);) {
      if (const auto* const event = std::get_if<FollowedEvent>(&item)) {
        seen.push_back({event->event.stream, event->event.number});
      } else if (const auto* const gap = std::get_if<MissingEvents>(&item)) {
        for (std::uint64_t one = gap->first; one <= gap->last; ++one)
          missing.push_back({gap->stream, one});
      } else {
        streams.push_back(std::get<NewEventStream>(item));
      }
    }
  }
  CommandResult answer(const request::JournalRead& read) {
    CommandResult out;
    if (!has_journal) {
      const std::string why = std::string(request::kNoJournal) + " (journal: in its plant.yaml)";
      const auto bytes = std::as_bytes(std::span(why));
      out.reply = {.error = line::to_error(line::Refusal::wrong_state),
                   .data = std::vector(bytes.begin(), bytes.end())};
      return out;
    }
    if (refusal != line::Refusal::none) {
      out.reply.error = line::to_error(refusal);
      return out;
    }
    std::size_t at = read.cursor.position;
    if (at != 0 && read.cursor.check != file) {
      out.reply.error = line::to_error(line::Refusal::wrong_incarnation);
      return out;
    }
    request::JournalPage page;
    if (at == 0 && read.after) {
      std::optional<std::size_t> found;
      for (std::size_t i = 0; i < journal.size(); ++i) {
        const Stored& one = journal[i];
        if (one.stream == read.after->stream && (one.number <= read.after->number || !found))
          found = one.number <= read.after->number ? i + 1 : i;
      }
      page.unknown_stream = !found;
      at = found.value_or(0);
    }
    for (std::size_t i = 0; i < page_size && at < journal.size(); ++i, ++at) {
      page.records.push_back({.stream = journal[at].stream,
                              .line = "l",
                              .number = journal[at].number,
                              .text = "stored"});
    }
    page.more = at < journal.size();
    page.cursor = {at, file};
    out.reply.data = encode(page);
    return out;
  }

  EventFollower follower;
  Instant now{std::chrono::seconds(10)};
  std::uint64_t incarnation = 0;
  std::uint64_t stream = 0;
  std::uint64_t number = 0;
  std::uint64_t file = 1;
  std::size_t page_size = 10;
  bool has_journal = true;
  line::Refusal refusal = line::Refusal::none;
  unsigned requests = 0;
  std::vector<Stored> journal;
  std::vector<Stored> not_stored_yet;
  std::vector<Stored> unstored;
  std::vector<Stored> seen;
  std::vector<Stored> missing;
  std::vector<NewEventStream> streams;
};

std::vector<Plant::Stored> from_to(std::uint64_t stream, std::uint64_t first, std::uint64_t last) {
  std::vector<Plant::Stored> out;
  for (std::uint64_t number = first; number <= last; ++number)
    out.push_back({stream, number});
  return out;
}

TEST(EventFollower, SamplesInOrderNeedNoRequest) {
  Plant plant;
  plant.start(7, 0);
  for (int i = 0; i < 20; ++i)
    plant.publish();
  plant.take(7, 3);
  plant.run(milliseconds(3000));
  EXPECT_EQ(plant.seen, from_to(7, 1, 20));
  EXPECT_EQ(plant.requests, 0U);
}

TEST(EventFollower, AGapIsFilledWhenTheJournalHasItAndOrderIsKept) {
  Plant plant;
  plant.start(7, 0);
  plant.publish();
  plant.publish(false);
  plant.publish(false);
  plant.publish();
  plant.run(milliseconds(400));
  EXPECT_EQ(plant.seen, from_to(7, 1, 1)) << "the journal has not stored it yet";
  plant.commit();
  plant.run(milliseconds(1000));
  EXPECT_EQ(plant.seen, from_to(7, 1, 4));
  EXPECT_TRUE(plant.missing.empty());
}

TEST(EventFollower, LastEventsThatWereLostAreReadAlthoughNoLaterOneArrives) {
  Plant plant;
  plant.start(7, 0);
  plant.publish();
  plant.publish(false);
  plant.publish(false);
  plant.commit();
  plant.tell_state();
  plant.run(milliseconds(500));
  EXPECT_EQ(plant.seen.size(), 1U) << "the samples may still arrive";
  plant.run(milliseconds(1000));
  EXPECT_EQ(plant.seen, from_to(7, 1, 3));
}

TEST(EventFollower, AReaderThatWasAwayContinuesAfterItsLastEvent) {
  Plant plant;
  plant.page_size = 100;
  plant.follower.begin_after("g", "l", {7, 10});
  for (int i = 0; i < 5000; ++i)
    plant.journal.push_back({7, static_cast<std::uint64_t>(i) + 1});
  plant.start(7, 5000);
  for (std::uint64_t kept = 4001; kept <= 5000; ++kept)
    plant.take(7, kept);  // of the history of DDS
  plant.run(milliseconds(1000));
  EXPECT_EQ(plant.seen, from_to(7, 11, 5000));
  EXPECT_LE(plant.requests, 52U);
}

TEST(EventFollower, AnEventThatNeitherHasIsMissingAndTheOthersAreNotHeldBack) {
  Plant plant;
  plant.start(7, 0);
  plant.publish();
  plant.publish(false, false);
  plant.publish();
  plant.publish(true, false);
  plant.publish(false);
  plant.commit();
  plant.publish();
  plant.run(milliseconds(500));
  EXPECT_EQ(plant.missing, from_to(7, 2, 2));
  plant.commit();
  plant.run(milliseconds(1000));
  EXPECT_EQ(plant.missing, from_to(7, 2, 2));
  std::vector<Plant::Stored> expected{{7, 1}, {7, 3}, {7, 4}, {7, 5}, {7, 6}};
  EXPECT_EQ(plant.seen, expected);
}

TEST(EventFollower, WithoutAJournalNothingIsHeldBack) {
  constexpr Duration kAtOnce = milliseconds(100);
  Plant plant(true);
  plant.has_journal = false;
  plant.start(7, 3);
  plant.run(std::chrono::seconds(20));
  plant.publish();
  plant.run(kAtOnce);
  EXPECT_EQ(plant.seen, from_to(7, 4, 4)) << "from the oldest one";
  plant.publish(false);
  plant.publish();
  plant.run(kAtOnce);
  EXPECT_EQ(plant.seen, (std::vector<Plant::Stored>{{7, 4}, {7, 6}})) << "after a gap";
  EXPECT_EQ(plant.missing, from_to(7, 5, 5));
  plant.start(8, 0);  // each start is a stream, from 1 on
  plant.publish(false);
  plant.publish();
  plant.publish();
  plant.run(kAtOnce);
  EXPECT_EQ(plant.seen, (std::vector<Plant::Stored>{{7, 4}, {7, 6}, {8, 2}, {8, 3}}));
  EXPECT_EQ(plant.missing, (std::vector<Plant::Stored>{{7, 5}, {8, 1}}));
  ASSERT_EQ(plant.streams.size(), 1U);
  EXPECT_TRUE(plant.streams[0].lost);
  plant.run(std::chrono::seconds(100));
  EXPECT_LT(plant.requests, 20U);
}

// States and events have no common order.
TEST(EventFollower, WithoutAJournalAnEventBeforeTheStateOfItsRunWaitsForIt) {
  for (const bool from_oldest : {true, false}) {
    Plant plant(from_oldest);
    plant.has_journal = false;
    plant.start(7, 0);
    if (!from_oldest) {
      plant.publish();
      plant.publish(false);
      plant.publish();
    }
    plant.take(8, 1);
    plant.run(milliseconds(900));
    EXPECT_EQ(plant.missing, from_oldest ? from_to(7, 1, 0) : from_to(7, 2, 2));
    plant.start(8, 1);
    plant.publish();
    plant.run(milliseconds(100));
    auto expected = from_to(8, 1, 2);
    if (!from_oldest)
      expected.insert(expected.begin(), {{7, 1}, {7, 3}});
    EXPECT_EQ(plant.seen, expected);
  }
}

TEST(EventFollower, AnEventAfterAGapWaitsForAJournalThatCannotBeRead) {
  Plant plant;
  plant.refusal = line::Refusal::wrong_state;
  plant.start(7, 0);
  plant.publish();
  plant.publish(false);
  plant.publish();
  plant.run(milliseconds(4000));
  EXPECT_EQ(plant.seen, from_to(7, 1, 1));
  plant.run(milliseconds(5000));
  EXPECT_EQ(plant.seen, (std::vector<Plant::Stored>{{7, 1}, {7, 3}}));
  EXPECT_EQ(plant.missing, from_to(7, 2, 2));
  plant.start(8, 0);
  plant.publish();
  plant.run(milliseconds(9000));
  EXPECT_EQ(plant.seen.back(), (Plant::Stored{8, 1}));
  EXPECT_LT(plant.requests, 20U);
}

TEST(EventFollower, AJournalThatCannotAnswerNowLosesNothing) {
  Plant plant;
  plant.start(7, 0);
  plant.publish();
  for (const auto refusal :
       {line::Refusal::timed_out, line::Refusal::busy, line::Refusal::cancelled}) {
    plant.refusal = refusal;
    for (std::size_t i = 0; i < EventFollower::kMostPending; ++i)
      plant.publish(i != 0);
    plant.commit();
    plant.run(std::chrono::seconds(20));
    EXPECT_TRUE(plant.missing.empty());
  }
  plant.refusal = line::Refusal::none;
  plant.page_size = 600;
  plant.run(std::chrono::seconds(31));
  EXPECT_EQ(plant.seen.size(), 1 + 3 * EventFollower::kMostPending);
  EXPECT_TRUE(plant.seen == from_to(7, 1, 1 + 3 * EventFollower::kMostPending));
}

TEST(EventFollower, AStreamContinuesInTheNextRunAndAfterACrashSkipsNumbers) {
  Plant plant;
  plant.start(7, 0);
  for (int i = 0; i < 3; ++i)
    plant.publish();
  plant.commit();
  plant.publish();  // seen, but lost in the crash
  plant.not_stored_yet.clear();
  plant.run(milliseconds(100));
  plant.start(7, 100);
  plant.publish(false);
  plant.publish();
  plant.commit();
  plant.run(milliseconds(2000));
  auto expected = from_to(7, 1, 4);
  expected.insert(expected.end(), {{7, 101}, {7, 102}});
  EXPECT_EQ(plant.seen, expected);
  EXPECT_EQ(plant.missing, from_to(7, 5, 100));
  EXPECT_TRUE(plant.streams.empty());
}

TEST(EventFollower, ALostJournalIsReportedAndItsNumbersAreNotConfused) {
  Plant plant;
  plant.start(7, 0);
  for (int i = 0; i < 5; ++i)
    plant.publish();
  plant.commit();
  plant.run(milliseconds(100));
  plant.lose_journal();
  plant.start(8, 0);
  plant.publish(false);
  plant.publish();
  plant.publish();
  plant.commit();
  plant.run(milliseconds(2000));
  auto expected = from_to(7, 1, 5);
  const auto later = from_to(8, 1, 3);
  expected.insert(expected.end(), later.begin(), later.end());
  EXPECT_EQ(plant.seen, expected);
  ASSERT_EQ(plant.streams.size(), 1U);
  EXPECT_EQ(plant.streams[0].before, 7U);
  EXPECT_EQ(plant.streams[0].now, 8U);
  EXPECT_TRUE(plant.streams[0].lost);
  plant.take(7, 6);
  plant.run(milliseconds(2000));
  EXPECT_EQ(plant.seen, expected) << "a sample of the stream that ended";
}

TEST(EventFollower, AStreamThatBeganWhileTheReaderWasAwayFollowsTheOneBefore) {
  Plant plant;
  plant.follower.begin_after("g", "l", {7, 2});
  plant.journal = from_to(7, 1, 4);
  const auto second = from_to(8, 5, 6);
  plant.journal.insert(plant.journal.end(), second.begin(), second.end());
  plant.start(8, 6);
  plant.take(8, 6);
  plant.run(milliseconds(1000));
  EXPECT_EQ(plant.seen, (std::vector<Plant::Stored>{{7, 3}, {7, 4}, {8, 5}, {8, 6}}));
  ASSERT_EQ(plant.streams.size(), 1U);
  EXPECT_FALSE(plant.streams[0].lost);
}

TEST(EventFollower, FromTheOldestBeginsInTheJournal) {
  Plant plant(true);
  plant.journal = from_to(7, 5, 30);
  plant.start(7, 30);
  plant.publish();
  plant.run(milliseconds(1000));
  EXPECT_EQ(plant.seen, from_to(7, 5, 31));
  EXPECT_TRUE(plant.missing.empty());
}

TEST(EventFollower, AFileThatIsReplacedBetweenTwoPagesIsReadAfterTheLastEvent) {
  Plant plant;
  plant.follower.begin_after("g", "l", {7, 0});
  plant.journal = from_to(7, 1, 30);
  plant.start(7, 30);
  const auto first = plant.follower.due(plant.now);
  ASSERT_TRUE(first);
  plant.follower.receive_answer("g", "l", plant.answer(first->read), plant.now);
  plant.lose_journal();
  plant.journal = from_to(7, 21, 30);
  plant.run(milliseconds(1000));
  auto expected = from_to(7, 1, 10);
  const auto rest = from_to(7, 21, 30);
  expected.insert(expected.end(), rest.begin(), rest.end());
  EXPECT_EQ(plant.seen, expected);
  EXPECT_EQ(plant.missing, from_to(7, 11, 20));
}

TEST(EventFollower, SamplesWithoutAStreamArePassedOnAsTheyCome) {
  Plant plant;
  plant.start(7, 0);
  plant.take(0, 5);
  plant.take(0, 3);
  plant.run(milliseconds(100));
  EXPECT_EQ(plant.seen, (std::vector<Plant::Stored>{{0, 5}, {0, 3}}));
  EXPECT_EQ(plant.requests, 0U);
}

// Number 0 is not of the contract: such an event is no part of a sequence.
TEST(EventFollower, AnEventWithNumberZeroIsPassedOnAndTheOthersFollow) {
  Plant plant;
  plant.start(7, 0);
  plant.take(7, 0);
  plant.publish();
  plant.publish();
  plant.take(7, 0);
  plant.run(milliseconds(100));
  std::vector<Plant::Stored> expected{{7, 0}, {7, 1}, {7, 2}, {7, 0}};
  EXPECT_EQ(plant.seen, expected);
  plant.take(8, 0);
  plant.run(milliseconds(100));
  expected.push_back({8, 0});
  EXPECT_EQ(plant.seen, expected);
  EXPECT_EQ(plant.requests, 0U);
  EXPECT_TRUE(plant.missing.empty());
}

TEST(EventFollower, AStoredEventWithNumberZeroIsPassedOnOnce) {
  Plant plant(true);
  plant.page_size = 1;
  plant.journal = {{7, 1}, {7, 0}, {7, 2}, {7, 3}};
  plant.start(7, 3);
  plant.run(milliseconds(1000));
  EXPECT_EQ(plant.seen, (std::vector<Plant::Stored>{{7, 1}, {7, 0}, {7, 2}, {7, 3}}));
  plant.lose_journal();
  plant.journal = {{7, 0}, {8, 1}, {8, 0}};
  plant.start(8, 1);
  plant.take(8, 0);
  plant.run(milliseconds(1000));
  const std::vector<Plant::Stored> expected{{7, 1}, {7, 0}, {7, 2}, {7, 3}, {8, 0}, {8, 1}};
  EXPECT_EQ(plant.seen, expected);
  EXPECT_TRUE(plant.missing.empty());
}

// The numbers of streams are random: the lower one is not the older one.
TEST(EventFollower, ASampleOfARecentStreamCostsNoRequestAfterManyStreams) {
  for (const bool ascending : {true, false}) {
    Plant plant;
    plant.start(1000, 0);
    plant.publish();
    for (std::uint64_t i = 1; i <= 70; ++i) {
      plant.start(ascending ? 1000 + i : 1000 - i, 0);
      plant.publish();
      plant.commit();
      plant.run(milliseconds(1000));
    }
    EXPECT_EQ(plant.seen.size(), 71U);
    const unsigned before = plant.requests;
    plant.take(ascending ? 1068 : 932, 1);
    plant.run(milliseconds(10'000));
    EXPECT_EQ(plant.requests, before) << ascending;
    EXPECT_EQ(plant.seen.size(), 71U);
  }
}

// An operator restored an older copy of the journal: its stream is that of earlier events.
TEST(EventFollower, AStreamThatReturnsContinuesAfterItsLastEvent) {
  Plant plant;
  plant.start(7, 0);
  for (int i = 0; i < 5; ++i)
    plant.publish();
  plant.commit();
  plant.run(milliseconds(100));
  const auto copy = plant.journal;
  plant.lose_journal();
  plant.start(8, 0);
  for (int i = 0; i < 3; ++i)
    plant.publish();
  plant.commit();
  plant.run(milliseconds(2000));
  plant.lose_journal();
  plant.journal = copy;
  plant.start(7, 100);
  plant.publish();
  plant.publish(false);
  plant.publish();
  plant.commit();
  plant.run(milliseconds(2000));
  plant.take(8, 2);
  plant.take(7, 101);
  plant.run(milliseconds(2000));
  auto expected = from_to(7, 1, 5);
  for (const auto& more : {from_to(8, 1, 3), from_to(7, 101, 103)})
    expected.insert(expected.end(), more.begin(), more.end());
  EXPECT_EQ(plant.seen, expected);
  EXPECT_EQ(plant.missing, from_to(7, 6, 100));
  EXPECT_EQ(plant.streams.size(), 2U);
}

// The disk failed for so long that streams began of which the journal has nothing.
TEST(EventFollower, SamplesOfAStreamThatTheJournalLeftOutKeepTheirPlace) {
  for (const bool has_journal : {true, false}) {
    for (const bool has_later : {true, false}) {
      Plant plant;
      plant.start(70, 0);
      plant.publish();
      plant.publish();
      plant.commit();
      plant.run(milliseconds(100));
      plant.refusal = has_journal ? line::Refusal::none : line::Refusal::wrong_state;
      auto expected = from_to(70, 1, 2);
      for (const std::uint64_t stream : {90U, 80U}) {
        plant.stream = stream;
        plant.publish(true, false);
        plant.publish(true, false);
        const auto more = from_to(stream, plant.number - 1, plant.number);
        expected.insert(expected.end(), more.begin(), more.end());
      }
      plant.stream = 60;
      plant.publish(has_later);
      plant.publish(has_later);
      plant.commit();
      plant.tell_state();
      plant.run(std::chrono::seconds(20));
      if (has_journal || has_later)
        expected.insert(expected.end(), {{60, 7}, {60, 8}});
      EXPECT_EQ(plant.seen, expected) << has_journal << has_later;
      EXPECT_TRUE(plant.missing.empty());
    }
  }
}

TEST(EventFollower, AStreamThatEndsWithTheHighestNumberIsLeft) {
  constexpr auto kHighest = std::numeric_limits<std::uint64_t>::max();
  Plant plant;
  plant.start(7, 0);
  plant.publish();
  plant.take(8, kHighest);
  plant.stream = 9;
  plant.publish();
  plant.tell_state();
  plant.run(std::chrono::seconds(20));
  EXPECT_EQ(plant.seen, (std::vector<Plant::Stored>{{7, 1}, {8, kHighest}, {9, 2}}));
}

// DDS keeps samples of streams that ended before the last event that the reader handled.
TEST(EventFollower, OlderStreamsInTheHistoryOfDdsAreNotPassedOnAgain) {
  Plant plant;
  plant.follower.begin_after("g", "l", {7, 2});
  plant.journal = from_to(7, 1, 4);
  plant.start(8, 4);
  for (int repetition = 0; repetition < 2; ++repetition) {
    plant.take(6, 9);
    for (std::uint64_t number = 1; number <= 4; ++number)
      plant.take(7, number);
    if (repetition == 0)
      plant.publish();
    plant.commit();
    plant.run(std::chrono::seconds(20));
    EXPECT_EQ(plant.seen, (std::vector<Plant::Stored>{{7, 3}, {7, 4}, {8, 5}}));
  }
  EXPECT_EQ(plant.streams.size(), 1U);
}

TEST(EventFollower, MalformedPagesAreRequestedAgainWithPauses) {
  Plant plant;
  plant.start(7, 0);
  plant.publish();
  plant.publish(false);
  plant.publish();
  CommandResult wrong;
  wrong.reply.data = std::vector<std::byte>(5);
  unsigned asked = 0;
  for (const Instant end = plant.now + std::chrono::seconds(60); plant.now < end;
       plant.now += milliseconds(50)) {
    while (plant.follower.due(plant.now)) {
      ++asked;
      plant.follower.receive_answer("g", "l", wrong, plant.now);
    }
  }
  EXPECT_GE(asked, 5U);
  EXPECT_LE(asked, 15U);
  plant.commit();
  plant.run(std::chrono::seconds(31));
  EXPECT_EQ(plant.seen, from_to(7, 1, 3));
}

// Samples are lost, late and repeated, commits late; gateways stop in order and crash.
TEST(EventFollower, EachEventOnceInOrderWhateverIsLost) {
  for (unsigned seed = 1; seed <= 300; ++seed) {
    std::minstd_rand random(seed);
    const auto chance = [&](unsigned percent) { return random() % 100 < percent; };
    Plant plant;
    plant.page_size = 1 + random() % 20;
    plant.follower.begin_after("g", "l", {7, 0});
    plant.start(7, 0);
    std::vector<Plant::Stored> published;
    for (int step = 0; step < 300; ++step) {
      plant.publish(!chance(30));
      published.push_back({plant.stream, plant.number});
      if (chance(10))
        plant.take(plant.stream, 1 + random() % plant.number);
      if (chance(20))
        plant.commit();
      if (chance(20))
        plant.tell_state();
      plant.run(milliseconds(random() % 200));
      if (chance(2)) {
        plant.commit();
        plant.start(plant.stream, plant.number);
      }
      plant.refusal = chance(5) ? line::Refusal::timed_out : line::Refusal::none;
    }
    plant.refusal = line::Refusal::none;
    plant.commit();
    plant.tell_state();
    plant.run(std::chrono::seconds(70));
    EXPECT_TRUE(plant.missing.empty()) << "seed " << seed;
    EXPECT_TRUE(plant.seen == published)
        << "seed " << seed << ": " << plant.seen.size() << " of " << published.size();
  }
}

// Samples are lost and repeated, and come before the state of their run.
TEST(EventFollower, WithoutAJournalEachSampleOnceInOrder) {
  for (unsigned seed = 1; seed <= 300; ++seed) {
    std::minstd_rand random(seed);
    const auto chance = [&](unsigned percent) { return random() % 100 < percent; };
    Plant plant(chance(50));
    plant.has_journal = false;
    plant.start(7, 0);
    std::vector<Plant::Stored> received;
    std::vector<Plant::Stored> lost;
    std::vector<Plant::Stored> lost_since;  // reported with the next one
    for (int step = 0; step < 300; ++step) {
      const bool reaches = !chance(30);
      plant.publish(reaches);
      lost_since.push_back({plant.stream, plant.number});
      if (reaches) {
        received.push_back(lost_since.back());
        lost_since.pop_back();
        if (received.size() > 1)  // the first one may be the oldest
          lost.insert(lost.end(), lost_since.begin(), lost_since.end());
        lost_since.clear();
      }
      if (chance(10) && !received.empty()) {
        const Plant::Stored& again = received[random() % received.size()];
        plant.take(again.stream, again.number);
      }
      if (chance(20))
        plant.tell_state();
      plant.run(milliseconds(random() % 200));
      if (chance(2)) {
        plant.tell_state();
        plant.run(milliseconds(100));
        lost_since.clear();
        plant.stream = seed + static_cast<unsigned>(step) * 1000;
        plant.number = 0;
        ++plant.incarnation;
        if (chance(50))
          plant.tell_state();
      }
    }
    plant.tell_state();
    plant.run(milliseconds(100));
    EXPECT_TRUE(plant.seen == received)
        << "seed " << seed << ": " << plant.seen.size() << " of " << received.size();
    EXPECT_TRUE(plant.missing == lost)
        << "seed " << seed << ": " << plant.missing.size() << " of " << lost.size();
  }
}

}  // namespace
}  // namespace linegate::dds

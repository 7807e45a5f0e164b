// SPDX-License-Identifier: Apache-2.0
// Processes that are killed at a random moment while they write a journal: nothing that was stored
// is missing, nothing that is older than a second is lost, nothing is corrupt, and no event number
// is used twice.
#include <algorithm>
#include <array>
#include <cstdlib>
#include <functional>
#include <random>
#include <set>
#include <thread>

#include <sys/wait.h>

#include "gateway/journal/journal_thread.h"

#include "tests/gateway/journal/journal_fixture.h"

namespace linegate::gateway {
namespace {

unsigned kills() {
  const char* const text = std::getenv("LINEGATE_JOURNAL_KILLS");
  return text == nullptr ? 50 : static_cast<unsigned>(std::strtoul(text, nullptr, 10));
}

// Runs `body` in a process and kills it some time after its first message. Returns the numbers that
// the process reported before its death.
std::vector<std::uint64_t> run_and_kill(const std::function<void(int out)>& body,
                                        std::chrono::microseconds after) {
  std::array<int, 2> ends{};
  EXPECT_EQ(pipe(ends.data()), 0);
  const pid_t child = fork();
  if (child == 0) {
    ::close(ends[0]);
    body(ends[1]);
    _exit(1);
  }
  ::close(ends[1]);
  std::vector<std::uint64_t> out;
  std::uint64_t number = 0;
  if (read(ends[0], &number, sizeof number) == sizeof number) {
    out.push_back(number);
  }
  // The reader must not be slower than the process, or the pipe stops it.
  std::thread reader([&] {
    while (read(ends[0], &number, sizeof number) == sizeof number) {
      out.push_back(number);
    }
  });
  std::this_thread::sleep_for(after);
  kill(child, SIGKILL);
  int status = 0;
  waitpid(child, &status, 0);
  EXPECT_TRUE(WIFSIGNALED(status)) << "the process ended by itself";
  reader.join();
  ::close(ends[0]);
  return out;
}

class Killed : public JournalTest {
 protected:
  std::chrono::microseconds random_time() { return std::chrono::microseconds(random_() % 20'000); }

  std::mt19937 random_{18};
};

void store_for_ever(const config::Journal& plan, std::uint64_t first, int out) {
  Journal journal(plan);
  if (journal.open() != 0 || journal.set_aside() != 0) {
    _exit(2);
  }
  const auto count =
      std::make_shared<const ValueEntry>(ValueEntry{.line = "press", .name = "last"});
  for (std::uint64_t next = first;; next += 20) {
    const std::uint64_t last = next + 19;
    const std::vector<JournalEntry> some = entries("press", next, last);
    const StoredValue value = value_at(count, static_cast<std::int64_t>(last), last);
    const std::span values(&value, 1);
    if (journal.store({.entries = some, .values = values, .stream = kStream}, value.time) != 0) {
      _exit(3);
    }
    (void)!write(out, &last, sizeof last);
  }
}

TEST_F(Killed, NothingThatWasStoredIsMissing) {
  plan_.max_size = 20'000'000;
  std::uint64_t first = 1;
  for (unsigned i = 0; i < kills(); ++i) {
    const auto reported =
        run_and_kill([&](int out) { store_for_ever(plan_, first, out); }, random_time());
    ASSERT_FALSE(reported.empty()) << i;
    Journal journal(plan_);
    ASSERT_EQ(journal.open(), 0) << i;
    ASSERT_EQ(journal.set_aside(), 0) << i;
    journal.close();
    const std::vector<JournalEntry> kept =
        stored({.since = at(static_cast<std::int64_t>(first)), .most = 1'000'000});
    ASSERT_FALSE(kept.empty()) << i;
    EXPECT_GE(kept.back().number, reported.back()) << i;
    EXPECT_EQ(kept.back().number % 20, 0U) << "a part of a commit";
    if (kept.front().number != first) {
      EXPECT_GT(kept.front().number, first) << "removed, because the journal is full";
    }
    for (std::size_t k = 1; k < kept.size(); ++k) {
      ASSERT_EQ(kept[k].number, kept[k - 1].number + 1) << i;
    }
    ASSERT_EQ(kept.back(), entry("press", kept.back().number));
    first = kept.back().number + 1;
  }
  // Each run but the last one has ended its values at its last transaction
  std::uint64_t last = 0;
  unsigned ends = 0;
  for (const StoredValue& one : stored_values()) {
    if (one.value) {
      ASSERT_EQ(*one.value, last + 20) << "none is missing";
      last = *one.value;
    } else {
      EXPECT_EQ(one.time, at(static_cast<std::int64_t>(last)));
      ++ends;
    }
  }
  EXPECT_EQ(last, first - 1);
  EXPECT_EQ(ends, kills() - 1);
}

// Uses event numbers as the publisher does, and reports each before it is queued for the disk.
void number_for_ever(const config::Journal& plan, int out) {
  JournalThread thread({.plan = plan,
                        .incarnation = kStream,
                        .period = std::chrono::milliseconds(2),
                        .reserved = 1000});
  NumberedLine& line = thread.add_line("press");
  thread.start();
  for (std::uint64_t number = line.before + 1;; ++number) {
    while (number > line.limit.value()) {  // the disk is slow: other tests use it, too
      std::this_thread::sleep_for(std::chrono::microseconds(200));
    }
    thread.use_number(line, number);
    if (thread.stream() != kStream) {
      _exit(4);
    }
    (void)!write(out, &number, sizeof number);
    JournalEntry one = entry("press", number);
    thread.record(one);
    if (number % 8 == 0) {
      std::this_thread::sleep_for(std::chrono::microseconds(200));
    }
  }
}

// Records an event every 5 ms, as the gateway does, and reports each with its time before.
void record_for_ever(const config::Journal& plan, int out) {
  JournalThread thread({.plan = plan, .incarnation = kStream});
  NumberedLine& line = thread.add_line("press");
  thread.start();
  for (std::uint64_t number = line.before + 1;; ++number) {
    thread.use_number(line, number);
    const std::array report{number,
                            static_cast<std::uint64_t>(monotonic_now().time_since_epoch().count())};
    (void)!write(out, report.data(), sizeof report);
    JournalEntry one = entry("press", number);
    thread.record(one);
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
}

// Invariant 3 of gateway/journal: the last second may be lost. The slack is for the disk, which
// other tests use, too.
TEST_F(Killed, OnlyEventsOfTheLastSecondAreLost) {
  constexpr Duration kMostLost = std::chrono::seconds(1);
  constexpr Duration kSlack = std::chrono::seconds(1);
  const unsigned rounds = std::max(kills() / 25, 2U);
  for (unsigned i = 0; i < rounds; ++i) {
    const auto reported = run_and_kill([&](int out) { record_for_ever(plan_, out); },
                                       std::chrono::milliseconds(2'200) + 50 * random_time());
    const Instant killed = monotonic_now();
    const std::vector<std::uint64_t> stored_numbers = numbers("press");
    const std::set<std::uint64_t> kept(stored_numbers.begin(), stored_numbers.end());
    unsigned old = 0;
    for (std::size_t k = 0; k + 1 < reported.size(); k += 2) {
      const Duration age = killed - Instant(Duration(reported[k + 1]));
      if (age > kMostLost + kSlack) {
        ++old;
        ASSERT_TRUE(kept.contains(reported[k]))
            << "round " << i << ": an event of " << age.count() << " ns before";
      }
    }
    EXPECT_GT(old, 10U) << "round " << i;
  }
}

TEST_F(Killed, NoNumberIsUsedTwice) {
  std::uint64_t last = 0;
  std::set<std::uint64_t> used;
  for (unsigned i = 0; i < kills(); ++i) {
    const auto numbers = run_and_kill([&](int out) { number_for_ever(plan_, out); }, random_time());
    ASSERT_FALSE(numbers.empty()) << i;
    ASSERT_GT(numbers.front(), last) << i;
    EXPECT_LE(numbers.front() - last, 2001U) << "the reserved numbers bound the gap";
    last = numbers.back();
    used.insert(numbers.begin(), numbers.end());
  }
  const std::vector<std::uint64_t> kept = numbers("press");
  EXPECT_TRUE(std::ranges::is_sorted(kept));
  EXPECT_GE(kept.size(), kills()) << "how many are stored depends on the disk and the sanitizer";
  // The process is killed before it reports a number, or after.
  EXPECT_LE(std::ranges::count_if(kept, [&](std::uint64_t n) { return !used.contains(n); }), 0);
}

}  // namespace
}  // namespace linegate::gateway

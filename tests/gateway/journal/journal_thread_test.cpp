// SPDX-License-Identifier: Apache-2.0
// The thread beside disks that work, fail and work again: publishers never wait, losses are
// counted, and numbers continue.
#include "gateway/journal/journal_thread.h"

#include <atomic>
#include <fstream>
#include <optional>
#include <thread>

#include <sqlite3.h>

#include "tests/gateway/journal/journal_fixture.h"

namespace linegate::gateway {
namespace {

using event::JournalCondition;
using event::JournalState;

constexpr std::uint64_t kIncarnation = 42;

class JournalThreadTest : public JournalTest {
 protected:
  JournalThread::Options options() const {
    return {.plan = plan_,
            .incarnation = kIncarnation,
            .period = std::chrono::milliseconds(1),
            .retry_period = std::chrono::milliseconds(1),
            .queued = 64,
            .reserved = 1000};
  }
  static void use(JournalThread& thread, NumberedLine& line, std::uint64_t number) {
    thread.use_number(line, number);
    JournalEntry one = entry(line.name, number);
    thread.record(one);
  }
  static JournalState next_news(JournalThread& thread) {
    for (;;) {
      if (const auto news = thread.pop_news()) {
        return *news;
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
  }
};

TEST_F(JournalThreadTest, NumbersContinueWithoutAGapAfterAStop) {
  for (std::uint64_t run = 0; run < 3; ++run) {
    JournalThread::Options again = options();
    again.incarnation += run;
    JournalThread thread(again);
    NumberedLine& press = thread.add_line("press");
    NumberedLine& gateway = thread.add_line("");
    thread.start();
    EXPECT_EQ(thread.stream(), kIncarnation);
    EXPECT_EQ(press.before, 10 * run);
    EXPECT_EQ(gateway.before, run);
    for (std::uint64_t number = press.before + 1; number <= press.before + 10; ++number) {
      use(thread, press, number);
    }
    use(thread, gateway, gateway.before + 1);
    thread.stop();
    EXPECT_EQ(numbers("press").size(), 10 * (run + 1));
    const auto news = thread.pop_news();
    EXPECT_EQ(news.has_value(), run == 0);
    if (news) {
      EXPECT_EQ(*news, (JournalState{JournalCondition::renewed, 0, 0}));
    }
  }
}

TEST_F(JournalThreadTest, ALostJournalBeginsAStreamAndSaysSo) {
  for (std::uint64_t run = 1; run <= 2; ++run) {
    JournalThread::Options again = options();
    again.incarnation = run;
    JournalThread thread(again);
    NumberedLine& press = thread.add_line("press");
    thread.start();
    EXPECT_EQ(press.before, 0U);
    EXPECT_EQ(thread.stream(), run);
    EXPECT_EQ(next_news(thread).condition, JournalCondition::renewed);
    use(thread, press, 1);
    thread.stop();
    std::filesystem::remove(plan_.file);
  }
}

TEST_F(JournalThreadTest, AFileThatReplacesADamagedOneIsCounted) {
  std::ofstream(plan_.file) << "this is no journal";
  for (std::uint64_t run = 1; run <= 2; ++run) {
    JournalThread thread(options());
    thread.add_line("press");
    thread.start();
    EXPECT_TRUE(thread.stop());
    EXPECT_EQ(thread.replaced_files(), run == 1 ? 1U : 0U);
  }
}

TEST_F(JournalThreadTest, ALineThatComesLaterHasNumbersReservedBeforeItsFirstEvent) {
  JournalThread thread(options());
  thread.start();
  NumberedLine& late = thread.add_line("late");
  thread.start();
  EXPECT_GE(late.limit.value(), 1000U);
  use(thread, late, 1);
  EXPECT_EQ(thread.stream(), kIncarnation);
}

TEST_F(JournalThreadTest, ADiskThatFailsIsReportedAndStopsNothing) {
  JournalThread thread(options());
  NumberedLine& press = thread.add_line("press");
  thread.start();
  EXPECT_EQ(next_news(thread).condition, JournalCondition::renewed);
  std::uint64_t number = 0;
  {
    const FileSizeLimit full(8192);
    use(thread, press, ++number);
    const JournalState failing = next_news(thread);
    EXPECT_EQ(failing.condition, JournalCondition::failing);
    EXPECT_NE(failing.error, 0U);
    // The queue has 64 places, and the thread took at most Journal::kMostEntries before it failed
    while (number < 1000) {
      use(thread, press, ++number);
    }
  }
  const JournalState working = next_news(thread);
  EXPECT_EQ(working.condition, JournalCondition::working);
  EXPECT_EQ(working.error, 0U);
  EXPECT_GT(working.lost, 0U);
  use(thread, press, ++number);
  thread.stop();
  std::uint64_t lost = working.lost;
  while (const auto more = thread.pop_news()) {
    lost += more->lost;
  }
  const std::vector<std::uint64_t> kept = numbers("press");
  EXPECT_EQ(kept.front(), 1U);
  EXPECT_EQ(kept.back(), number);
  EXPECT_EQ(kept.size() + lost, number) << "each event is stored, or counted as lost";
}

TEST_F(JournalThreadTest, NumbersBeyondTheReservedOnesBelongToAnotherStream) {
  std::uint64_t other = 0;
  {
    JournalThread thread(options());
    NumberedLine& press = thread.add_line("press");
    thread.start();
    EXPECT_EQ(next_news(thread).condition, JournalCondition::renewed);
    {
      const FileSizeLimit full(8192);
      use(thread, press, 1);
      EXPECT_EQ(next_news(thread).condition, JournalCondition::failing);
      const std::uint64_t limit = press.limit.value();
      use(thread, press, limit);
      EXPECT_EQ(thread.stream(), kIncarnation);
      use(thread, press, limit + 1);
      other = thread.stream();
      EXPECT_NE(other, kIncarnation);
      use(thread, press, limit + 2);
      EXPECT_EQ(thread.stream(), other) << "one stream for as long as the disk fails";
    }
    EXPECT_EQ(next_news(thread).condition, JournalCondition::renewed);
    EXPECT_EQ(next_news(thread).condition, JournalCondition::working);
  }
  JournalThread next(options());
  EXPECT_EQ(next.stream(), other);
  EXPECT_EQ(next.add_line("press").before, 1002U);
}

TEST_F(JournalThreadTest, AJournalThatCannotBeOpenedIsUsedWhenItCan) {
  plan_.file = folder_ + "/later/journal.db";
  JournalThread thread(options());
  NumberedLine& press = thread.add_line("press");
  thread.start();
  const JournalState failing = next_news(thread);
  EXPECT_EQ(failing, (JournalState{JournalCondition::failing, SQLITE_CANTOPEN, 0}));
  use(thread, press, 1);
  std::filesystem::create_directory(folder_ + "/later");
  EXPECT_EQ(next_news(thread).condition, JournalCondition::renewed);
  EXPECT_EQ(next_news(thread).condition, JournalCondition::working);
  thread.stop();
  EXPECT_EQ(numbers("press"), (std::vector<std::uint64_t>{1}));
}

// The line "oven" is in the first and the third configuration only.
TEST_F(JournalThreadTest, AFileThatIsReplacedAtRunTimeContinuesAllNumbers) {
  {
    JournalThread thread(options());
    NumberedLine& oven = thread.add_line("oven");
    thread.start();
    use(thread, oven, 1);
    use(thread, oven, 2);
  }
  {
    JournalThread::Options slowly = options();
    slowly.retry_period = std::chrono::milliseconds(300);  // the file is closed meanwhile
    JournalThread thread(slowly);
    NumberedLine& press = thread.add_line("press");
    thread.start();
    {
      const FileSizeLimit full(8192);
      use(thread, press, 1);
      EXPECT_EQ(next_news(thread).condition, JournalCondition::failing);
      std::filesystem::remove(plan_.file + "-wal");
      std::ofstream(plan_.file, std::ios::trunc) << "no database";
    }
    const JournalState renewed = next_news(thread);
    EXPECT_EQ(renewed.condition, JournalCondition::renewed);
    EXPECT_NE(renewed.error, 0U);
    EXPECT_EQ(next_news(thread).condition, JournalCondition::working);
    use(thread, press, 2);
    EXPECT_EQ(thread.stream(), kIncarnation);
  }
  EXPECT_EQ(numbers("press"), (std::vector<std::uint64_t>{1, 2}));
  JournalThread thread(options());
  EXPECT_EQ(thread.stream(), kIncarnation);
  EXPECT_EQ(thread.add_line("oven").before, 2U);
  EXPECT_EQ(thread.add_line("press").before, 2U);
}

TEST_F(JournalThreadTest, AFileThatIsRemovedAtRunTimeIsReportedAndMadeAgain) {
  JournalThread thread(options());
  NumberedLine& press = thread.add_line("press");
  thread.start();
  EXPECT_EQ(next_news(thread).condition, JournalCondition::renewed);
  use(thread, press, 1);
  for (const char* suffix : {"", "-wal", "-shm", ".lock"})
    std::filesystem::remove(plan_.file + suffix);
  const JournalState news = next_news(thread);
  EXPECT_EQ(news, (JournalState{JournalCondition::renewed, SQLITE_READONLY_DBMOVED, 0}));
  EXPECT_NE(thread.describe(news).find("was removed or replaced"), std::string::npos)
      << thread.describe(news);
  use(thread, press, 2);
  EXPECT_EQ(thread.stream(), kIncarnation);
  EXPECT_EQ(thread.replaced_files(), 1U);
  Journal second(plan_);
  EXPECT_EQ(second.open(), SQLITE_BUSY) << "the new file is locked";
  EXPECT_TRUE(thread.stop());
  EXPECT_FALSE(thread.pop_news().has_value());
  EXPECT_EQ(numbers("press").back(), 2U);
}

// What was stored before is in the log alone, which another process no longer finds.
TEST_F(JournalThreadTest, FilesBesideItThatAreRemovedAtRunTimeAreMadeAgainAndNothingIsLost) {
  JournalThread thread(options());
  NumberedLine& press = thread.add_line("press");
  thread.start();
  EXPECT_EQ(next_news(thread).condition, JournalCondition::renewed);
  std::vector<std::uint64_t> all;
  for (const char* suffix : {"-wal", "-shm", ".lock"}) {
    use(thread, press, all.emplace_back(all.size() + 1));
    while (numbers("press") != all) {
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    std::filesystem::remove(plan_.file + suffix);
    const JournalState news = next_news(thread);
    EXPECT_EQ(news, (JournalState{JournalCondition::working, SQLITE_READONLY_DBMOVED, 0}));
    EXPECT_NE(thread.describe(news).find("beside it were removed"), std::string::npos)
        << thread.describe(news);
    EXPECT_TRUE(std::filesystem::exists(plan_.file + suffix)) << suffix;
    EXPECT_EQ(numbers("press"), all) << suffix;
    Journal second(plan_);
    EXPECT_EQ(second.open(), SQLITE_BUSY) << "the journal is locked without " << suffix;
  }
  use(thread, press, all.emplace_back(all.size() + 1));
  EXPECT_EQ(thread.stream(), kIncarnation);
  EXPECT_EQ(thread.replaced_files(), 0U);
  EXPECT_TRUE(thread.stop());
  EXPECT_FALSE(thread.pop_news().has_value());
  EXPECT_EQ(numbers("press"), all);
}

// The copy has the stream of the run, with numbers and values of the past.
TEST_F(JournalThreadTest, ACopyThatReplacesTheFileAtRunTimeContinuesTheNumbers) {
  const std::string copy = folder_ + "/copy.db";
  const auto entry_of_press = std::make_shared<const ValueEntry>(ValueEntry{.line = "press"});
  {
    JournalThread thread(options());
    thread.add_line("press");
    thread.start();
  }
  {
    Journal writer(plan_);
    ASSERT_EQ(writer.open(), 0);
    const std::vector<StoredValue> values{value_at(entry_of_press, 7, 1)};
    ASSERT_EQ(writer.store({.values = values, .stream = kIncarnation}, at(9)), 0);
  }
  std::filesystem::copy_file(plan_.file, copy);
  {
    JournalThread thread(options());
    NumberedLine& press = thread.add_line("press");
    thread.start();
    for (std::uint64_t number = 1; number <= 20; ++number) {
      use(thread, press, number);
    }
    while (numbers("press").size() < 20) {
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    std::filesystem::rename(plan_.file, folder_ + "/old.db");
    std::filesystem::rename(copy, plan_.file);
    JournalState news = next_news(thread);
    while (news.condition == JournalCondition::working) {
      news = next_news(thread);
    }
    EXPECT_EQ(news, (JournalState{JournalCondition::renewed, SQLITE_READONLY_DBMOVED, 0}));
    Database database;
    ASSERT_EQ(database.open(plan_.file, Database::Use::read), 0);
    int error = 0;
    EXPECT_GE(database.number("SELECT number_limit FROM lines WHERE name = 'press'", error), 21)
        << "a crash now repeats no number";
    use(thread, press, 21);
    EXPECT_TRUE(thread.stop());
  }
  EXPECT_EQ(numbers("press"), std::vector<std::uint64_t>{21});
  const auto values = stored_values();
  ASSERT_EQ(values.size(), 2U);
  EXPECT_EQ(values.back().time, at(9)) << "the values of the copy end with its run";
  EXPECT_FALSE(values.back().value.has_value());
  plan_.file = folder_ + "/old.db";
  EXPECT_EQ(numbers("press").back(), 20U) << "the file that was moved away is complete";
}

TEST_F(JournalThreadTest, AJournalThatAnotherGatewayWritesIsLeftAlone) {
  JournalThread one(options());
  NumberedLine& press = one.add_line("press");
  one.start();
  JournalThread::Options same = options();
  same.incarnation = 43;
  JournalThread other(same);
  NumberedLine& theirs = other.add_line("press");
  other.start();
  EXPECT_EQ(next_news(other).error, static_cast<std::uint32_t>(SQLITE_BUSY));
  use(one, press, 1);
  use(other, theirs, 1);
  one.stop();
  EXPECT_EQ(numbers("press"), (std::vector<std::uint64_t>{1}));
}

// SQLite waits for as long as it exists, when it opens a file.
class HangingDisk {
 public:
  HangingDisk() {
    real_ = sqlite3_vfs_find(nullptr);
    hanging_ = *real_;
    hanging_.zName = "hanging";
    hanging_.xOpen = [](sqlite3_vfs* self, const char* name, sqlite3_file* file, int flags,
                        int* out) {
      hangs_.wait(true);
      return real_->xOpen(self, name, file, flags, out);
    };
    hangs_ = true;
    sqlite3_vfs_register(&hanging_, 1);
  }
  ~HangingDisk() {
    respond();
    sqlite3_vfs_register(real_, 1);
    sqlite3_vfs_unregister(&hanging_);
  }
  HangingDisk(const HangingDisk&) = delete;
  HangingDisk& operator=(const HangingDisk&) = delete;

  static void respond() {
    hangs_ = false;
    hangs_.notify_all();
  }

 private:
  static inline std::atomic<bool> hangs_{false};
  static inline sqlite3_vfs* real_ = nullptr;
  static inline sqlite3_vfs hanging_{};
};

TEST_F(JournalThreadTest, ADiskThatHangsDelaysNeitherTheStartNorTheEnd) {
  {
    JournalThread thread(options());
    NumberedLine& press = thread.add_line("press");
    thread.start();
    use(thread, press, 1);
  }
  HangingDisk disk;
  JournalThread::Options again = options();
  again.incarnation = kIncarnation + 1;
  JournalThread thread(again);
  EXPECT_EQ(thread.stream(), again.incarnation) << "not the stream of a file that nobody has read";
  NumberedLine& press = thread.add_line("press");
  EXPECT_EQ(press.before, 0U);
  thread.start();
  use(thread, press, 1);
  EXPECT_FALSE(thread.stop());
  HangingDisk::respond();
}

TEST_F(JournalThreadTest, ADiskThatRespondsLateGetsTheEventsWithTheirOwnStream) {
  std::uint64_t stream = 0;
  {
    JournalThread thread(options());
    NumberedLine& press = thread.add_line("press");
    thread.start();
    use(thread, press, 1);
  }
  {
    HangingDisk disk;
    JournalThread::Options again = options();
    again.incarnation = kIncarnation + 1;
    JournalThread thread(again);
    NumberedLine& press = thread.add_line("press");
    thread.start();
    use(thread, press, 1);
    stream = thread.stream();
    EXPECT_NE(stream, kIncarnation);
    HangingDisk::respond();
    EXPECT_EQ(next_news(thread), (JournalState{JournalCondition::renewed, 0, 0}));
    EXPECT_TRUE(thread.stop());
  }
  EXPECT_EQ(numbers("press"), (std::vector<std::uint64_t>{1, 1}));
  JournalThread next(options());
  EXPECT_EQ(next.stream(), stream);
  EXPECT_EQ(next.add_line("press").before, 1U);
}

TEST_F(JournalThreadTest, EventsThatCannotBeStoredAtTheEndAreCounted) {
  plan_.file = folder_ + "/missing/journal.db";
  JournalThread thread(options());
  NumberedLine& press = thread.add_line("press");
  thread.start();
  for (std::uint64_t number = 1; number <= 100; ++number) {
    use(thread, press, number);
  }
  EXPECT_TRUE(thread.stop());
  std::uint64_t reported = 0;
  while (const auto news = thread.pop_news()) {
    reported += news->lost;
  }
  EXPECT_EQ(thread.lost_at_stop() + reported, 100U);
}

// The file as a killed gateway leaves it.
TEST_F(JournalThreadTest, ARunThatDidNotEndInOrderIsReportedAtTheNextStart) {
  {
    Journal journal(plan_);
    ASSERT_EQ(journal.open(), 0);
    ASSERT_EQ(store(journal, entries("press", 1, 1), kStream, {}, at(0)), 0);
  }
  const JournalState unended{JournalCondition::working, SQLITE_NOTICE_RECOVER_WAL, 0};
  {
    JournalThread thread(options());
    thread.add_line("press");
    thread.start();
    EXPECT_EQ(next_news(thread), unended);
    EXPECT_NE(thread.describe(unended).find("may be missing"), std::string::npos);
  }
  JournalThread thread(options());
  thread.add_line("press");
  thread.start();
  EXPECT_TRUE(thread.stop());
  EXPECT_EQ(thread.pop_news(), std::nullopt) << "it ended in order";
}

// Nobody reports the news of the last moments as events.
TEST_F(JournalThreadTest, EventsThatWereLostAtTheEndAreReportedAtTheNextStart) {
  std::uint64_t number = 0;
  std::uint64_t reported = 0;
  {
    JournalThread thread(options());
    NumberedLine& press = thread.add_line("press");
    thread.start();
    EXPECT_EQ(next_news(thread).condition, JournalCondition::renewed);
    for (unsigned outage = 0; outage < 2; ++outage) {
      {
        const FileSizeLimit full(8192);
        use(thread, press, ++number);
        EXPECT_EQ(next_news(thread).condition, JournalCondition::failing);
        for (unsigned i = 0; i < 900; ++i) {
          use(thread, press, ++number);
        }
      }
      if (outage == 0) {
        reported = next_news(thread).lost;
        EXPECT_GT(reported, 0U);
      }
    }
    EXPECT_TRUE(thread.stop());
    EXPECT_EQ(thread.stream(), kIncarnation);
  }
  const std::size_t kept = numbers("press").size();
  JournalThread thread(options());
  thread.add_line("press");
  thread.start();
  const JournalState lost = next_news(thread);
  EXPECT_EQ(lost.error, static_cast<std::uint32_t>(SQLITE_NOTICE));
  EXPECT_EQ(kept + reported + lost.lost, number) << "each event is stored, or reported as lost";
  EXPECT_NE(thread.describe(lost).find("events of the last run are missing"), std::string::npos);
}

// The disk has room for the tables of the new file only.
TEST_F(JournalThreadTest, ANewFileIsReportedOnceWithTheReasonWhenItStores) {
  config::Journal other = plan_;
  other.file = folder_ + "/other.db";
  Journal tables(other);
  ASSERT_EQ(tables.open(), 0);
  const auto size = std::filesystem::file_size(other.file + "-wal");
  std::ofstream(plan_.file) << std::string(10'000, 'j');
  std::optional<JournalThread> thread;
  {
    const FileSizeLimit full(size + 100);
    thread.emplace(options());
    thread->add_line("press");
    thread->start();
    EXPECT_EQ(next_news(*thread).condition, JournalCondition::failing);
  }
  EXPECT_EQ(next_news(*thread), (JournalState{JournalCondition::renewed, SQLITE_NOTADB, 0}));
  EXPECT_EQ(next_news(*thread), (JournalState{JournalCondition::working, 0, 0}));
}

// The statements of deploy/OPERATING.md for a restored backup.
TEST_F(JournalThreadTest, AnOperatorCanBeginANewStream) {
  {
    JournalThread thread(options());
    NumberedLine& press = thread.add_line("press");
    thread.start();
    use(thread, press, 1);
  }
  {
    Database database;
    ASSERT_EQ(database.open(plan_.file, Database::Use::write), 0);
    ASSERT_EQ(database.execute("DELETE FROM stream; DELETE FROM lines"), 0);
  }
  JournalThread::Options again = options();
  again.incarnation = kIncarnation + 1;
  JournalThread thread(again);
  EXPECT_EQ(thread.stream(), again.incarnation);
  NumberedLine& press = thread.add_line("press");
  EXPECT_EQ(press.before, 0U);
  thread.start();
  EXPECT_EQ(next_news(thread), (JournalState{JournalCondition::renewed, 0, 0}));
  use(thread, press, 1);
  thread.stop();
  EXPECT_EQ(numbers("press"), (std::vector<std::uint64_t>{1, 1}));
}

}  // namespace
}  // namespace linegate::gateway

// SPDX-License-Identifier: Apache-2.0
// What was stored is there after the file was opened again; a file that is no journal is moved
// away.
#include "gateway/journal/journal.h"

#include <fstream>
#include <numeric>
#include <random>

#include <sqlite3.h>

#include "tests/gateway/journal/journal_fixture.h"

namespace linegate::gateway {
namespace {

std::string bytes_of(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

void write_file(const std::string& path, const std::string& bytes) {
  std::ofstream(path, std::ios::binary | std::ios::trunc) << bytes;
}

TEST_F(JournalTest, EntriesAndNumbersAreThereAfterAStart) {
  const std::vector<JournalEntry> sent{entry("press", 1), entry("", 0xFFFF'FFFF'FFFF'FFFF),
                                       entry("oven", 7)};
  {
    Journal journal(plan_);
    ASSERT_EQ(journal.open(), 0);
    EXPECT_EQ(journal.stream(), 0U);
    const std::vector<NumberLimit> limits{{"press", 100}, {"", 0xFFFF'FFFF'FFFF'FFFF}};
    ASSERT_EQ(store(journal, sent, kStream, limits, at(0)), 0);
  }
  Journal journal(plan_);
  ASSERT_EQ(journal.open(), 0);
  EXPECT_EQ(journal.set_aside(), 0);
  EXPECT_EQ(journal.stream(), kStream);
  ASSERT_EQ(journal.limits().size(), 2U);
  EXPECT_EQ(journal.limits().at("press"), 100U);
  EXPECT_EQ(journal.limits().at(""), 0xFFFF'FFFF'FFFF'FFFFU);
  EXPECT_EQ(stored(), sent);
}

// More than this version has: a later one may have written the file.
TEST_F(JournalTest, AnEntryOfALaterVersionIsStoredWhole) {
  JournalEntry later = entry("press", 1);
  later.kind = static_cast<EventKind>(250);
  later.data.resize(64);
  for (std::size_t i = 0; i < later.data.size(); ++i)
    later.data[i] = static_cast<std::byte>(200 + i);
  later.text.assign(256, 't');
  Journal journal(plan_);
  ASSERT_EQ(journal.open(), 0);
  ASSERT_EQ(store(journal, std::span(&later, 1), kStream, {}, at(0)), 0);
  EXPECT_EQ(stored(), std::vector<JournalEntry>{later});
}

TEST_F(JournalTest, AnEntryIsStoredOnce) {
  Journal journal(plan_);
  ASSERT_EQ(journal.open(), 0);
  ASSERT_EQ(store(journal, entries("press", 1, 3), kStream, {}, at(0)), 0);
  ASSERT_EQ(store(journal, entries("press", 2, 4), kStream, {}, at(0)), 0);
  EXPECT_EQ(numbers("press"), (std::vector<std::uint64_t>{1, 2, 3, 4}));
}

TEST_F(JournalTest, AnotherStreamHasNumbersOfItsOwn) {
  Journal journal(plan_);
  ASSERT_EQ(journal.open(), 0);
  const std::vector<NumberLimit> before{{"press", 100}, {"oven", 100}};
  const std::vector<NumberLimit> limits{{"press", 50}};
  ASSERT_EQ(store(journal, entries("press", 1, 1), kStream, before, at(0)), 0);
  std::vector<JournalEntry> other = entries("press", 1, 1);
  other[0].stream = 2;
  ASSERT_EQ(store(journal, other, 2, limits, at(0)), 0);
  EXPECT_EQ(numbers("press"), (std::vector<std::uint64_t>{1, 1}));
  journal.close();
  ASSERT_EQ(journal.open(), 0);
  EXPECT_EQ(journal.stream(), 2U);
  EXPECT_EQ(journal.limits(), (std::map<std::string, std::uint64_t, std::less<>>{{"press", 50}}));
}

TEST_F(JournalTest, TheOldestEntriesAreRemovedBeyondTheSize) {
  plan_.max_size = 2'000'000;
  Journal journal(plan_);
  ASSERT_EQ(journal.open(), 0);
  constexpr std::uint64_t kLast = 40'000;
  for (std::uint64_t first = 1; first <= kLast; first += 200) {
    std::vector<JournalEntry> some = entries("press", first, first + 199);
    for (JournalEntry& one : some) {
      one.text = std::string(256, 'x');
    }
    ASSERT_EQ(store(journal, some, kStream, {}, at(0)), 0) << first;
  }
  journal.close();
  EXPECT_LE(std::filesystem::file_size(plan_.file), plan_.max_size);
  const std::vector<std::uint64_t> kept = numbers("press");
  ASSERT_GT(kept.size(), 500U);
  std::vector<std::uint64_t> newest(kept.size());
  std::iota(newest.begin(), newest.end(), kLast + 1 - kept.size());
  EXPECT_EQ(kept, newest);
}

TEST_F(JournalTest, EntriesAreRemovedByAge) {
  plan_.max_age = std::chrono::seconds(10);
  Journal journal(plan_);
  ASSERT_EQ(journal.open(), 0);
  ASSERT_EQ(store(journal, entries("press", 1, 20), kStream, {}, at(20)), 0);
  ASSERT_EQ(store(journal, {}, kStream, {}, at(25)), 0);
  EXPECT_EQ(numbers("press").front(), 15U);
  EXPECT_EQ(numbers("press").back(), 20U);
}

TEST_F(JournalTest, ADamagedFileIsMovedAway) {
  const std::string junk(100'000, 'j');
  for (const std::string& contents : {std::string("not a database at all"), junk}) {
    write_file(plan_.file, contents);
    Journal journal(plan_);
    ASSERT_EQ(journal.open(), 0);
    EXPECT_NE(journal.set_aside(), 0);
    EXPECT_EQ(journal.stream(), 0U);
    EXPECT_EQ(bytes_of(journal.unusable_file()), contents);
    ASSERT_EQ(store(journal, entries("press", 1, 3), kStream, {}, at(0)), 0);
    EXPECT_EQ(numbers("press").size(), 3U);
  }
}

// Each byte of the file may be wrong: the journal opens, as before or new, and stores.
TEST_F(JournalTest, AFileWithWrongBytesIsUsableOrMovedAway) {
  {
    Journal journal(plan_);
    ASSERT_EQ(journal.open(), 0);
    ASSERT_EQ(store(journal, entries("press", 1, 200), kStream, {}, at(0)), 0);
  }
  const std::string sound = bytes_of(plan_.file);
  std::mt19937 random(18);
  unsigned moved = 0;
  for (unsigned i = 0; i < 150; ++i) {
    std::string wrong = sound;
    const std::size_t where = i < 50 ? i * 2 : random() % wrong.size();
    for (std::size_t k = where; k < std::min(wrong.size(), where + 1 + random() % 64); ++k) {
      wrong[k] = static_cast<char>(random());
    }
    write_file(plan_.file, wrong);
    std::filesystem::remove(plan_.file + "-wal");
    std::filesystem::remove(plan_.file + "-shm");
    Journal journal(plan_);
    ASSERT_EQ(journal.open(), 0) << i;
    moved += journal.set_aside() != 0 ? 1U : 0U;
    // Damage that the check cannot find may be found by the first call, and the next open().
    if (store(journal, entries("press", 1000, 1010), kStream, {}, at(0)) != 0) {
      ASSERT_EQ(journal.open(), 0) << i;
      ASSERT_EQ(store(journal, entries("press", 1000, 1010), kStream, {}, at(0)), 0) << i;
    }
  }
  EXPECT_GT(moved, 20U);
}

TEST_F(JournalTest, AFileOfAnotherVersionOrProgramIsMovedAway) {
  for (const char* change : {"PRAGMA user_version=5", "PRAGMA application_id=1"}) {
    {
      Journal journal(plan_);
      ASSERT_EQ(journal.open(), 0);
      ASSERT_EQ(store(journal, entries("press", 1, 1), kStream, {}, at(0)), 0);
      journal.close();
      Database database;
      ASSERT_EQ(database.open(plan_.file, Database::Use::write), 0);
      ASSERT_EQ(database.execute(change), 0);
    }
    Journal journal(plan_);
    ASSERT_EQ(journal.open(), 0);
    EXPECT_EQ(journal.set_aside(), SQLITE_MISMATCH) << change;
    EXPECT_TRUE(stored().empty());
  }
}

// As the first version of the tables was: without the mark of the last run.
void make_first_version(const std::string& file) {
  Database database;
  ASSERT_EQ(database.open(file, Database::Use::write), 0);
  ASSERT_EQ(
      database.execute("DROP TABLE last_run; DROP TABLE value_entries; "
                       "DROP TABLE value_rows; DROP TABLE value_scalings; PRAGMA user_version=1"),
      0);
}

TEST_F(JournalTest, TheFileSaysHowTheLastRunEnded) {
  {
    Journal journal(plan_);
    ASSERT_EQ(journal.open(), 0);
    EXPECT_EQ(journal.last_run(), LastRun{}) << "a new file";
    ASSERT_EQ(store(journal, entries("press", 1, 1), kStream, {}, at(0)), 0);
    journal.close();
    ASSERT_EQ(journal.open(), 0);
    EXPECT_EQ(journal.last_run(), LastRun{}) << "this run is not the last one";
  }
  {
    Journal journal(plan_);
    ASSERT_EQ(journal.open(), 0);
    EXPECT_EQ(journal.last_run(), (LastRun{.ended = false, .lost = 0, .written = at(0)}));
  }
  {
    Journal journal(plan_);
    ASSERT_EQ(journal.open(), 0);
    EXPECT_FALSE(journal.last_run().ended) << "a run that stores nothing changes nothing";
    ASSERT_EQ(store(journal, {}, kStream, {}, at(0)), 0);
    ASSERT_EQ(store(journal, {}, kStream, {}, at(0), 7), 0);
    EXPECT_FALSE(journal.last_run().ended);
  }
  Journal journal(plan_);
  ASSERT_EQ(journal.open(), 0);
  EXPECT_EQ(journal.last_run(), (LastRun{.ended = true, .lost = 7, .written = at(0)}));
}

TEST_F(JournalTest, AFileOfTheFirstVersionContinues) {
  {
    Journal journal(plan_);
    ASSERT_EQ(journal.open(), 0);
    const std::vector<NumberLimit> limits{{"press", 100}};
    ASSERT_EQ(store(journal, entries("press", 1, 3), kStream, limits, at(0)), 0);
  }
  make_first_version(plan_.file);
  {
    Journal journal(plan_);
    ASSERT_EQ(journal.open(), 0);
    EXPECT_EQ(journal.set_aside(), 0);
    EXPECT_EQ(journal.stream(), kStream);
    EXPECT_EQ(journal.limits().at("press"), 100U);
    EXPECT_EQ(journal.last_run(), LastRun{}) << "it does not say how the run ended";
    EXPECT_EQ(numbers("press").size(), 3U) << "the reader reads this version";
    ASSERT_EQ(store(journal, entries("press", 4, 4), kStream, {}, at(0)), 0);
  }
  Journal journal(plan_);
  ASSERT_EQ(journal.open(), 0);
  EXPECT_EQ(journal.set_aside(), 0);
  EXPECT_FALSE(journal.last_run().ended);
  EXPECT_EQ(numbers("press"), (std::vector<std::uint64_t>{1, 2, 3, 4}));
}

// Otherwise its numbers would not continue until the disk has room.
TEST_F(JournalTest, AFileOfTheFirstVersionOnAFullDiskIsOpened) {
  {
    Journal journal(plan_);
    ASSERT_EQ(journal.open(), 0);
    ASSERT_EQ(store(journal, entries("press", 1, 3), kStream, {}, at(0)), 0);
  }
  make_first_version(plan_.file);
  Journal journal(plan_);
  {
    const FileSizeLimit full(33'000);  // room for the index of the log alone
    ASSERT_EQ(journal.open(), 0);
    EXPECT_EQ(journal.stream(), kStream);
    EXPECT_NE(store(journal, entries("press", 4, 250), kStream, {}, at(0)), 0);
  }
  ASSERT_EQ(journal.open(), 0);
  ASSERT_EQ(store(journal, entries("press", 4, 250), kStream, {}, at(0)), 0);
  EXPECT_EQ(numbers("press").size(), 250U);
}

TEST_F(JournalTest, AFullDiskLosesNothingThatWasStored) {
  Journal journal(plan_);
  ASSERT_EQ(journal.open(), 0);
  ASSERT_EQ(store(journal, entries("press", 1, 100), kStream, {}, at(0)), 0);
  {
    const FileSizeLimit full(std::filesystem::file_size(plan_.file + "-wal") + 5000);
    EXPECT_NE(store(journal, entries("press", 101, 300), kStream, {}, at(0)), 0);
    EXPECT_FALSE(journal.is_open());
  }
  ASSERT_EQ(journal.open(), 0);
  EXPECT_EQ(journal.set_aside(), 0);
  EXPECT_EQ(journal.stream(), kStream);
  EXPECT_EQ(numbers("press").size(), 100U);
  ASSERT_EQ(store(journal, entries("press", 101, 300), kStream, {}, at(0)), 0);
  EXPECT_EQ(numbers("press").size(), 300U);
}

// A page of old entries becomes unreadable while the disk is full: neither open() nor new entries
// need it, only a check of the whole file.
TEST_F(JournalTest, AFullDiskDoesNotRepeatTheCheckOfTheFile) {
  auto first_run = std::make_unique<Journal>(plan_);
  Journal& journal = *first_run;
  ASSERT_EQ(journal.open(), 0);
  for (std::uint64_t first = 1; first <= 2000; first += 200) {
    ASSERT_EQ(store(journal, entries("press", first, first + 199), kStream, {}, at(0)), 0);
  }
  {
    const FileSizeLimit full(std::filesystem::file_size(plan_.file + "-wal") + 5000);
    ASSERT_NE(store(journal, entries("press", 2001, 2200), kStream, {}, at(0)), 0);
  }
  std::string bytes = bytes_of(plan_.file);
  constexpr std::size_t kPage = 4096;
  constexpr char kTableLeaf = 0x0D;
  std::size_t page = 20 * kPage;
  while (page < bytes.size() && bytes[page] != kTableLeaf) {
    page += kPage;
  }
  ASSERT_LT(page, bytes.size() / 2);
  bytes[page] = 0x7F;
  write_file(plan_.file, bytes);
  ASSERT_EQ(journal.open(), 0);
  EXPECT_EQ(journal.set_aside(), 0);
  ASSERT_EQ(store(journal, entries("press", 2001, 2200), kStream, {}, at(0)), 0);
  first_run.reset();
  Journal later(plan_);
  ASSERT_EQ(later.open(), 0);
  EXPECT_NE(later.set_aside(), 0) << "the check at the start finds it";
}

// The entries of the index are those of another column, which the check at the start does not see.
TEST_F(JournalTest, DamageThatOnlyAStoreFindsMovesTheFileAway) {
  plan_.max_age = std::chrono::seconds(10);
  {
    Journal journal(plan_);
    ASSERT_EQ(journal.open(), 0);
    ASSERT_EQ(store(journal, entries("press", 1, 20), kStream, {}, at(20)), 0);
  }
  {
    Database database;
    ASSERT_EQ(database.open(plan_.file, Database::Use::write), 0);
    ASSERT_EQ(database.execute("PRAGMA writable_schema=ON; UPDATE sqlite_schema SET sql = "
                               "'CREATE INDEX events_time ON events(code)' "
                               "WHERE name = 'events_time'"),
              0);
  }
  Journal journal(plan_);
  ASSERT_EQ(journal.open(), 0);
  ASSERT_EQ(journal.set_aside(), 0);
  const int error = store(journal, entries("press", 21, 21), kStream, {}, at(40));
  ASSERT_EQ(error & 0xFF, SQLITE_CORRUPT);
  ASSERT_EQ(journal.open(), 0);
  EXPECT_EQ(journal.set_aside(), error);
  EXPECT_TRUE(std::filesystem::exists(journal.unusable_file()));
  ASSERT_EQ(store(journal, entries("press", 21, 21), kStream, {}, at(40)), 0);
  EXPECT_EQ(journal.set_aside(), 0) << "it is stored, hence reported once";
  EXPECT_EQ(numbers("press"), (std::vector<std::uint64_t>{21}));
}

// As after a crash between the two renames, or if somebody removed the database alone.
TEST_F(JournalTest, ALogWithoutItsDatabaseBringsNoNumbersBack) {
  {
    Journal journal(plan_);
    ASSERT_EQ(journal.open(), 0);
    const std::vector<NumberLimit> limits{{"press", 100}};
    ASSERT_EQ(store(journal, entries("press", 1, 3), kStream, limits, at(0)), 0);
    std::filesystem::copy_file(plan_.file + "-wal", folder_ + "/log");
  }
  const std::string log = bytes_of(folder_ + "/log");
  std::filesystem::remove(plan_.file);
  write_file(plan_.file + "-wal", log);
  Journal journal(plan_);
  ASSERT_EQ(journal.open(), 0);
  EXPECT_EQ(journal.stream(), 0U);
  EXPECT_TRUE(journal.limits().empty());
  EXPECT_EQ(bytes_of(journal.unusable_file() + "-wal"), log);
}

// Without the check of the result, the old file would be opened again, or lost.
TEST_F(JournalTest, AFileThatCannotBeMovedAwayIsAnErrorUntilItCan) {
  write_file(plan_.file, std::string(10'000, 'j'));
  std::filesystem::create_directories(plan_.file + ".unusable-wal/occupied");
  Journal journal(plan_);
  EXPECT_EQ(journal.open(), SQLITE_CANTOPEN);
  EXPECT_EQ(bytes_of(plan_.file).size(), 10'000U);
  std::filesystem::remove_all(plan_.file + ".unusable-wal");
  ASSERT_EQ(journal.open(), 0);
  EXPECT_NE(journal.set_aside(), 0);
}

TEST_F(JournalTest, OneProcessWritesAJournal) {
  Journal journal(plan_);
  ASSERT_EQ(journal.open(), 0);
  Journal other(plan_);
  EXPECT_EQ(other.open(), SQLITE_BUSY);
  EXPECT_FALSE(other.is_open());
}

TEST_F(JournalTest, AFolderThatDoesNotExistIsAnError) {
  plan_.file = folder_ + "/missing/journal.db";
  Journal journal(plan_);
  EXPECT_EQ(journal.open(), SQLITE_CANTOPEN);
  EXPECT_EQ(store(journal, entries("press", 1, 1), kStream, {}, at(0)), SQLITE_CANTOPEN);
}

}  // namespace
}  // namespace linegate::gateway

// SPDX-License-Identifier: Apache-2.0
// Queries, each condition alone and together, in pages, while the journal is written.
#include <fstream>

#include <sqlite3.h>
#include <sys/stat.h>

#include "gateway/journal/journal_reader.h"

#include "tests/gateway/journal/journal_fixture.h"

namespace linegate::gateway {
namespace {

class ReaderTest : public JournalTest {
 protected:
  ReaderTest() : journal_(plan_) {
    EXPECT_EQ(journal_.open(), 0);
    std::vector<JournalEntry> sent = entries("press", 1, 6);
    sent[1].node = 9;
    sent[2].kind = EventKind::emcy;
    sent[3].severity = EventSeverity::warning;
    sent[4].text = "100% of a_b: Overheated 'quoted'; DROP";
    sent[5].line = "";
    EXPECT_EQ(store(journal_, sent, kStream, {}, at(0)), 0);
  }

  std::vector<std::uint64_t> found(const JournalQuery& query) const {
    std::vector<std::uint64_t> out;
    for (const JournalEntry& one : stored(query)) {
      out.push_back(one.number);
    }
    return out;
  }

  Journal journal_;
};

using Numbers = std::vector<std::uint64_t>;

TEST_F(ReaderTest, EachConditionAlone) {
  EXPECT_EQ(found({}), (Numbers{1, 2, 3, 4, 5, 6}));
  EXPECT_EQ(found({.line = "press"}), (Numbers{1, 2, 3, 4, 5}));
  EXPECT_EQ(found({.line = ""}), (Numbers{6}));
  EXPECT_EQ(found({.line = "press' OR 1=1 --"}), Numbers{});
  EXPECT_EQ(found({.node = 9}), (Numbers{2}));
  EXPECT_EQ(found({.kind = EventKind::emcy}), (Numbers{3}));
  EXPECT_EQ(found({.least = EventSeverity::error}), (Numbers{1, 2, 3, 5, 6}));
  EXPECT_EQ(found({.text = "overHEATED"}), (Numbers{5}));
  EXPECT_EQ(found({.text = "0% of a_b: overheated 'q"}), (Numbers{5}));
  EXPECT_EQ(found({.text = "0%a"}), Numbers{});
  EXPECT_EQ(found({.since = at(3)}), (Numbers{3, 4, 5, 6}));
  EXPECT_EQ(found({.until = at(3)}), (Numbers{1, 2}));
}

TEST_F(ReaderTest, AllConditionsTogether) {
  EXPECT_EQ(found({.line = "press",
                   .node = 5,
                   .kind = EventKind::heartbeat_lost,
                   .least = EventSeverity::error,
                   .text = "lost",
                   .since = at(1),
                   .until = at(6)}),
            (Numbers{1}));
}

TEST_F(ReaderTest, PagesHaveEachEntryOnceWhileOthersAreStored) {
  JournalReader reader;
  ASSERT_EQ(reader.open(plan_.file), 0);
  JournalPage page;
  Numbers seen;
  for (int i = 0; i < 5; ++i) {
    ASSERT_EQ(reader.read({.after = page.position, .most = 2}, page), 0);
    for (const JournalEntry& one : page.entries) {
      seen.push_back(one.number);
    }
    if (i == 0) {
      ASSERT_EQ(store(journal_, entries("press", 7, 8), kStream, {}, at(0)), 0);
    }
  }
  EXPECT_EQ(seen, (Numbers{1, 2, 3, 4, 5, 6, 7, 8}));
  EXPECT_TRUE(page.entries.empty());
}

TEST_F(ReaderTest, TheNewestInTheirOrder) {
  EXPECT_EQ(found({.newest = true, .most = 2}), (Numbers{5, 6}));
  EXPECT_EQ(found({.line = "press", .newest = true, .most = 2}), (Numbers{4, 5}));
}

TEST_F(ReaderTest, APlaceAfterRemovedEntriesIsNotUsedAgain) {
  JournalReader reader;
  ASSERT_EQ(reader.open(plan_.file), 0);
  JournalPage page;
  ASSERT_EQ(reader.read({}, page), 0);
  journal_.close();
  Database database;
  ASSERT_EQ(database.open(plan_.file, Database::Use::write), 0);
  ASSERT_EQ(database.execute("DELETE FROM events"), 0);
  database.close();
  ASSERT_EQ(journal_.open(), 0);
  ASSERT_EQ(store(journal_, entries("press", 9, 9), kStream, {}, at(0)), 0);
  ASSERT_EQ(reader.read({.after = page.position}, page), 0);
  ASSERT_EQ(page.entries.size(), 1U);
  EXPECT_EQ(page.entries[0].number, 9U);
}

TEST_F(ReaderTest, AFileThatIsNoJournalIsAnError) {
  JournalReader reader;
  EXPECT_EQ(reader.open(folder_ + "/missing.db"), SQLITE_CANTOPEN);
  EXPECT_FALSE(std::filesystem::exists(folder_ + "/missing.db"));
  std::ofstream(folder_ + "/text.db") << "this is a text and no database, whatever its name";
  EXPECT_EQ(reader.open(folder_ + "/text.db") & 0xFF, SQLITE_NOTADB);
  Database database;
  ASSERT_EQ(database.open(folder_ + "/other.db", Database::Use::write), 0);
  ASSERT_EQ(database.execute("CREATE TABLE events(id)"), 0);
  EXPECT_EQ(reader.open(folder_ + "/other.db"), SQLITE_MISMATCH);
}

// A journal without a writer, in a folder whose name SQLite could take for a parameter.
TEST_F(ReaderTest, AJournalThatNoProcessWritesCanBeReadAlone) {
  journal_.close();
  const std::string odd = folder_ + "/a?mode=rwc%41#";
  std::filesystem::create_directory(odd);
  std::filesystem::copy_file(plan_.file, odd + "/journal.db");
  Database database;
  ASSERT_EQ(database.open(odd + "/journal.db", Database::Use::read_alone), 0);
  int error = 0;
  EXPECT_EQ(database.number("SELECT count(*) FROM events", error), 6);
}

// Otherwise the next page reads all entries behind the last match again.
TEST_F(ReaderTest, ThePositionPassesOverEntriesThatDoNotMatch) {
  JournalReader reader;
  JournalPage page;
  ASSERT_EQ(reader.open(plan_.file), 0);
  ASSERT_EQ(reader.read({}, page), 0);
  const std::int64_t end = page.position;
  ASSERT_EQ(reader.read({.kind = EventKind::emcy}, page), 0);
  EXPECT_EQ(page.position, end);
  ASSERT_EQ(reader.read({.text = "no such text", .newest = true}, page), 0);
  EXPECT_EQ(page.position, end);
  ASSERT_EQ(reader.read({.most = 2}, page), 0);
  EXPECT_LT(page.position, end) << "the next page begins behind a full one";
  ASSERT_EQ(store(journal_, entries("press", 7, 7), kStream, {}, at(0)), 0);
  ASSERT_EQ(reader.read({.after = end}, page), 0);
  EXPECT_EQ(page.entries.size(), 1U);
}

}  // namespace
}  // namespace linegate::gateway

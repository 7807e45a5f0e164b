// SPDX-License-Identifier: Apache-2.0
// Pages of the journal for clients: bounded work, cursors, other files, the thread that answers.
#include <chrono>
#include <filesystem>
#include <limits>
#include <thread>

#include "gateway/journal/journal_pages.h"
#include "gateway/journal/journal_server.h"

#include "tests/gateway/journal/journal_fixture.h"

namespace linegate::gateway {
namespace {

using Numbers = std::vector<std::uint64_t>;
using request::EventPosition;
using request::JournalRead;

class PagesTest : public JournalTest {
 protected:
  PagesTest() : pages_(plan_.file) {}

  void store(Journal& journal, const std::string& line, std::uint64_t first, std::uint64_t last,
             std::uint64_t stream = kStream, std::string text = "words") {
    for (std::uint64_t from = first; from <= last; from += Journal::kMostEntries) {
      auto some = entries(line, from, std::min(last, from + Journal::kMostEntries - 1));
      for (JournalEntry& one : some) {
        one.stream = stream;
        one.text = text;
      }
      ASSERT_EQ(journal.store({.entries = some, .stream = stream}, at(0)), 0);
    }
  }
  void fill(const std::string& line, std::uint64_t first, std::uint64_t last) {
    Journal journal(plan_);
    ASSERT_EQ(journal.open(), 0);
    store(journal, line, first, last);
  }
  request::JournalPage page(const JournalRead& request) {
    const auto result = pages_.read(request, stop_);
    const auto* const refusal = std::get_if<PageRefusal>(&result);
    EXPECT_EQ(refusal, nullptr) << (refusal == nullptr ? "" : refusal->text);
    return refusal == nullptr ? std::get<request::JournalPage>(result) : request::JournalPage{};
  }
  PageRefusal refusal(const JournalRead& request) {
    const auto result = pages_.read(request, stop_);
    const auto* const refusal = std::get_if<PageRefusal>(&result);
    return refusal == nullptr ? PageRefusal{} : *refusal;
  }
  // The numbers of all pages.
  Numbers all(JournalRead request, std::size_t* read_pages = nullptr) {
    Numbers out;
    for (std::size_t pages = 1;; ++pages) {
      const request::JournalPage one = page(request);
      for (const auto& record : one.records) {
        out.push_back(record.number);
      }
      request.cursor = one.cursor;
      if (!one.more || pages > 10'000) {
        EXPECT_LE(pages, 10'000U) << "the pages never end";
        if (read_pages != nullptr) {
          *read_pages = pages;
        }
        return out;
      }
    }
  }

  JournalPages pages_;
  exchange::Flag stop_;
};

Numbers from_to(std::uint64_t first, std::uint64_t last) {
  Numbers out;
  for (std::uint64_t number = first; number <= last; ++number) {
    out.push_back(number);
  }
  return out;
}

TEST_F(PagesTest, HaveEachEntryOnceInEitherOrder) {
  fill("press", 1, 1500);
  for (const std::uint32_t most : {0U, 1U, 7U, 600U, std::numeric_limits<std::uint32_t>::max()}) {
    std::size_t pages = 0;
    EXPECT_EQ(all({.most = most}, &pages), from_to(1, 1500)) << most;
    EXPECT_GE(pages, 3U) << most;
    Numbers backwards = all({.newest_first = true, .most = most});
    std::ranges::reverse(backwards);
    EXPECT_EQ(backwards, from_to(1, 1500)) << most;
  }
}

TEST_F(PagesTest, APageFitsIntoTheSamplesOfAReply) {
  Journal journal(plan_);
  ASSERT_EQ(journal.open(), 0);
  store(journal, std::string(64, 'l'), 1, 1000, kStream, std::string(256, 't'));
  const auto one = page({});
  EXPECT_LE(encode(one).size(), request::JournalPage::kMostBytes);
  EXPECT_GT(one.records.size(), 100U);
  EXPECT_EQ(all({}), from_to(1, 1000));
  EXPECT_EQ(all({.newest_first = true}).size(), 1000U);
}

// Also with a condition that nothing fulfils, and indices of other columns.
TEST_F(PagesTest, TheWorkForAPageIsBounded) {
  const std::uint64_t many = JournalPages::kMostScanned * 2 + 10;
  fill("press", 1, many);
  for (const bool newest_first : {false, true}) {
    std::size_t pages = 0;
    EXPECT_EQ(all({.text = "no such words", .newest_first = newest_first}, &pages), Numbers{});
    EXPECT_EQ(pages, 3U);
    EXPECT_EQ(all({.line = "other", .since = at(1), .newest_first = newest_first}, &pages),
              Numbers{});
    EXPECT_EQ(pages, 3U);
  }
  EXPECT_EQ(all({.since = at(static_cast<std::int64_t>(many) - 1)}), from_to(many - 1, many));
}

TEST_F(PagesTest, BeginAfterAnEventOfALine) {
  Journal journal(plan_);
  ASSERT_EQ(journal.open(), 0);
  store(journal, "press", 1, 5);
  store(journal, "hall", 1, 5);
  store(journal, "press", 100, 102);           // after a crash
  store(journal, "press", 1, 2, kStream + 1);  // after another stream began
  const auto after = [&](std::uint64_t stream, std::uint64_t number) {
    return all({.line = "press", .after = EventPosition{stream, number}, .most = 2});
  };
  EXPECT_EQ(after(kStream, 3), (Numbers{4, 5, 100, 101, 102, 1, 2}));
  EXPECT_EQ(after(kStream, 50), (Numbers{100, 101, 102, 1, 2})) << "the number was lost in a crash";
  EXPECT_EQ(after(kStream, 102), (Numbers{1, 2}));
  EXPECT_EQ(after(kStream, 500), (Numbers{1, 2}));
  EXPECT_EQ(after(kStream + 1, 2), Numbers{});
  EXPECT_EQ(after(kStream, 0), (Numbers{1, 2, 3, 4, 5, 100, 101, 102, 1, 2}));
  EXPECT_FALSE(page({.line = "press", .after = EventPosition{kStream, 3}}).unknown_stream);
  const auto unknown = page({.line = "press", .after = EventPosition{kStream + 2, 3}});
  EXPECT_TRUE(unknown.unknown_stream);
  EXPECT_EQ(unknown.records.size(), 10U) << "it begins with the oldest event";
  EXPECT_TRUE(page({.line = "none", .after = EventPosition{kStream, 3}}).unknown_stream);
}

TEST_F(PagesTest, ACursorContinuesWithWhatIsStoredLater) {
  fill("press", 1, 3);
  auto last = page({});
  EXPECT_FALSE(last.more);
  EXPECT_TRUE(page({.cursor = last.cursor}).records.empty());
  EXPECT_EQ(page({.line = "other"}).newest, last.cursor);
  EXPECT_EQ(page({.newest_first = true, .most = 1}).newest, last.cursor);
  fill("press", 4, 5);
  last = page({.cursor = last.cursor});
  ASSERT_EQ(last.records.size(), 2U);
  EXPECT_EQ(last.records[0].number, 4U);
}

// Somebody removes a file beside the journal while the reader has it open, and its writer makes
// another one.
TEST_F(PagesTest, ContinueWithAnotherLogOfTheSameFile) {
  Journal journal(plan_);
  ASSERT_EQ(journal.open(), 0);
  std::uint64_t stored = 0;
  for (const char* suffix : {"-wal", "-shm"}) {
    store(journal, "press", stored + 1, stored + 5);
    EXPECT_EQ(all({}), from_to(1, stored += 5));
    EXPECT_FALSE(journal.is_beside_removed());
    std::filesystem::remove(plan_.file + suffix);
    ASSERT_TRUE(journal.is_beside_removed()) << suffix;
    ASSERT_TRUE(journal.renew());
    ASSERT_EQ(journal.open(), 0);
    store(journal, "press", stored + 1, stored + 5);
    EXPECT_EQ(all({}), from_to(1, stored += 5)) << suffix;
    EXPECT_TRUE(journal.is_beside_removed()) << "the reader still uses the removed one";
    pages_.close();
    ASSERT_TRUE(journal.renew());
    ASSERT_EQ(journal.open(), 0);
    EXPECT_FALSE(journal.is_beside_removed()) << suffix;
    EXPECT_EQ(all({}), from_to(1, stored)) << suffix;
  }
}

TEST_F(PagesTest, ACursorOfAnotherFileIsRefused) {
  fill("press", 1, 10);
  const auto of_first = page({.most = 5});
  std::filesystem::remove_all(folder_);
  std::filesystem::create_directory(folder_);
  {
    Journal journal(plan_);
    ASSERT_EQ(journal.open(), 0);
    store(journal, "press", 1, 10, kStream + 1);
  }
  EXPECT_EQ(refusal({.cursor = of_first.cursor}).refusal, line::Refusal::wrong_incarnation);
  EXPECT_EQ(all({}), from_to(1, 10)) << "the new file is read";
  for (const std::uint64_t position :
       {std::uint64_t{11}, std::uint64_t{1} << 62U, ~std::uint64_t{0}}) {
    for (const bool newest_first : {false, true}) {
      const auto refused = refusal({.cursor = {position, 0}, .newest_first = newest_first});
      EXPECT_EQ(refused.refusal, line::Refusal::wrong_incarnation) << position;
      EXPECT_EQ(refused.text,
                "the cursor is not of this file of the journal: begin without a cursor");
    }
  }
}

TEST_F(PagesTest, ACursorAtARemovedEntryContinuesWithTheOldest) {
  Journal journal({.file = plan_.file, .max_age = std::chrono::seconds(10)});
  ASSERT_EQ(journal.open(), 0);
  store(journal, "press", 1, 10);
  const auto begin = page({.most = 2});
  ASSERT_EQ(journal.store({.stream = kStream}, at(15)), 0);  // removes those before 5
  EXPECT_EQ(all({.cursor = begin.cursor}), from_to(5, 10));
  ASSERT_EQ(journal.store({.stream = kStream}, at(1000)), 0);
  EXPECT_EQ(all({.cursor = begin.cursor}), Numbers{});
  EXPECT_EQ(all({.newest_first = true}), Numbers{});
  store(journal, "press", 1000, 1001);
  EXPECT_EQ(all({.cursor = begin.cursor}), from_to(1000, 1001));
}

TEST_F(PagesTest, WithoutAReadableFileTheReasonIsStatedAndALaterFileIsRead) {
  EXPECT_EQ(refusal({}), (PageRefusal{line::Refusal::wrong_state,
                                      "the journal cannot be read: unable to open database file"}));
  fill("press", 1, 3);
  EXPECT_EQ(all({}), from_to(1, 3));
  fill("press", 4, 3000);  // SQLite looks at the flag after some steps
  stop_.raise();
  EXPECT_EQ(refusal({.text = "words"}).refusal, line::Refusal::cancelled);
}

class ValuePagesTest : public PagesTest {
 protected:
  // Values 1 to `last` with the time of their number, of four entries in turn.
  void fill_values(std::uint64_t last, std::int64_t later = 0) {
    Journal journal(plan_);
    ASSERT_EQ(journal.open(), 0);
    std::vector<std::shared_ptr<const ValueEntry>> four;
    for (const char* const name : {"inlet.A", "inlet.B", "ram.A", "ram.B"}) {
      four.push_back(std::make_shared<const ValueEntry>(
          ValueEntry{.line = "press",
                     .node = *name == 'i' ? std::uint8_t{5} : std::uint8_t{6},
                     .name = name}));
    }
    for (std::uint64_t next = 1; next <= last;) {
      std::vector<StoredValue> some;
      for (; next <= last && some.size() < Journal::kMostValues; ++next) {
        some.push_back(value_at(four[next % 4], later + static_cast<std::int64_t>(next), next));
      }
      ASSERT_EQ(journal.store({.values = some, .stream = kStream}, at(0)), 0);
    }
  }
  Numbers all_values(JournalRead request, std::size_t* read_pages = nullptr) {
    Numbers out;
    request.values = true;
    for (std::size_t pages = 1;; ++pages) {
      const request::JournalPage one = page(request);
      EXPECT_TRUE(one.records.empty());
      for (const auto& value : one.values) {
        out.push_back(value.value.value_or(0));
      }
      request.cursor = one.cursor;
      if (!one.more || pages > 10'000) {
        EXPECT_LE(pages, 10'000U) << "the pages never end";
        if (read_pages != nullptr) {
          *read_pages = pages;
        }
        return out;
      }
    }
  }
};

TEST_F(ValuePagesTest, HaveEachValueOnceInEitherOrder) {
  fill_values(7000);
  for (const std::uint32_t most : {0U, 7U, 3000U, std::numeric_limits<std::uint32_t>::max()}) {
    EXPECT_EQ(all_values({.most = most}), from_to(1, 7000)) << most;
    Numbers backwards = all_values({.newest_first = true, .most = most});
    std::ranges::reverse(backwards);
    EXPECT_EQ(backwards, from_to(1, 7000)) << most;
  }
  request::JournalPage one = page({.values = true});
  EXPECT_GT(one.values.size(), 2900U);
  EXPECT_LE(encode(one).size(), request::JournalPage::kMostBytes);
  EXPECT_EQ(
      one.values[0].series,
      (request::JournalSeries{
          .line = "press", .direction = 0, .node = 5, .type = 6, .bits = 16, .name = "inlet.B"}));
  EXPECT_EQ(one.values[0].clock, 2U);
  EXPECT_EQ(one.values[0].time, at(1));
}

TEST_F(ValuePagesTest, EachConditionSelects) {
  fill_values(12);
  EXPECT_EQ(all_values({.text = "inlet.A"}), (Numbers{4, 8, 12}));
  EXPECT_EQ(all_values({.text = "*.B"}), (Numbers{1, 3, 5, 7, 9, 11}));
  EXPECT_EQ(all_values({.node = 6}), (Numbers{2, 3, 6, 7, 10, 11}));
  EXPECT_EQ(all_values({.line = "press", .since = at(11)}), (Numbers{11, 12}));
  EXPECT_EQ(all_values({.until = at(3)}), (Numbers{1, 2}));
  EXPECT_EQ(all_values({.text = "inlet.A", .until = at(9), .newest_first = true, .most = 1})[0], 8U)
      << "the value that held before that time";
  EXPECT_FALSE(page({.text = "inlet.A", .since = at(99), .values = true}).unknown_entry);
  for (const JournalRead& read :
       {JournalRead{.text = "inlet.C"}, JournalRead{.line = "hall"}, JournalRead{.node = 7}}) {
    JournalRead values = read;
    values.values = true;
    EXPECT_TRUE(page(values).unknown_entry);
    EXPECT_EQ(all_values(values), Numbers{});
  }
  EXPECT_TRUE(page({}).records.empty()) << "values are no events";
}

TEST_F(ValuePagesTest, TheWorkForAPageIsBounded) {
  fill_values(JournalPages::kMostScanned * 2 + 10);
  for (const bool newest_first : {false, true}) {
    std::size_t pages = 0;
    EXPECT_EQ(all_values({.since = at(1'000'000), .newest_first = newest_first}, &pages),
              Numbers{});
    EXPECT_EQ(pages, 3U);
  }
}

// A value that holds is kept although those around it were removed.
TEST_F(ValuePagesTest, RemovedValuesCostNoPages) {
  plan_.values_size = 400'000;
  {
    Journal journal(plan_);
    ASSERT_EQ(journal.open(), 0);
    const auto constant =
        std::make_shared<const ValueEntry>(ValueEntry{.line = "hall", .name = "a"});
    const StoredValue kept = value_at(constant, 0, 7);
    ASSERT_EQ(journal.store({.values = std::span(&kept, 1), .stream = kStream}, at(0)), 0);
    const auto other = std::make_shared<const ValueEntry>(ValueEntry{.line = "hall", .name = "b"});
    const std::vector<StoredValue> many(Journal::kMostValues, value_at(other, 1, 8));
    for (unsigned call = 0; call < 150; ++call) {
      ASSERT_EQ(journal.store({.values = many, .stream = kStream}, at(1)), 0);
    }
  }
  const std::size_t stored = stored_values().size();
  const std::size_t needed = (stored + JournalPages::kMostScanned - 1) / JournalPages::kMostScanned;
  for (const bool newest_first : {false, true}) {
    std::size_t pages = 0;
    EXPECT_EQ(all_values({.text = "a", .newest_first = newest_first}, &pages), (Numbers{7}));
    EXPECT_EQ(pages, needed);
  }
  EXPECT_EQ(all_values({.text = "b"}).size(), stored - 1);
  EXPECT_EQ(all_values({.text = "b", .newest_first = true}).size(), stored - 1);
}

// Earlier builds left the last row of an entry that they removed.
TEST_F(ValuePagesTest, ARowWithoutAnEntryTakesNoPlaceInAPage) {
  fill_values(20);
  {
    Database database;
    ASSERT_EQ(database.open(plan_.file, Database::Use::write), 0);
    ASSERT_EQ(database.execute("UPDATE value_rows SET entry = 999, value = NULL WHERE id % 4 > 1"),
              0);
  }
  const Numbers kept{1, 4, 5, 8, 9, 12, 13, 16, 17, 20};
  for (const std::uint32_t most : {1U, 3U, 4U, 100U}) {
    EXPECT_EQ(all_values({.most = most}), kept) << most;
    Numbers backwards = all_values({.newest_first = true, .most = most});
    std::ranges::reverse(backwards);
    EXPECT_EQ(backwards, kept) << most;
  }
}

TEST_F(ValuePagesTest, ACursorContinuesAndThatOfAnotherFileOrOfEventsIsRefused) {
  fill("press", 1, 100);
  fill_values(100);
  auto last = page({.values = true});
  EXPECT_FALSE(last.more);
  EXPECT_EQ(last.newest, last.cursor);
  EXPECT_EQ(refusal({.cursor = last.cursor}).refusal, line::Refusal::wrong_incarnation);
  EXPECT_EQ(refusal({.cursor = page({}).cursor, .values = true}).refusal,
            line::Refusal::wrong_incarnation);
  fill_values(3, 1000);
  last = page({.text = "inlet.B", .cursor = last.cursor, .values = true});
  ASSERT_EQ(last.values.size(), 2U) << "the run ended: its end is stored, too";
  EXPECT_FALSE(last.values[0].value);
  EXPECT_EQ(last.values[1].value, 1U);
  std::filesystem::remove_all(folder_);
  std::filesystem::create_directory(folder_);
  fill_values(500, 7);
  EXPECT_EQ(refusal({.cursor = last.cursor, .values = true}).refusal,
            line::Refusal::wrong_incarnation);
}

TEST_F(ValuePagesTest, AJournalOfAnEarlierVersionHasNoValues) {
  fill("press", 1, 3);
  {
    Database database;
    ASSERT_EQ(database.open(plan_.file, Database::Use::write), 0);
    ASSERT_EQ(database.execute(
                  "DROP TABLE value_entries; DROP TABLE value_rows; DROP TABLE value_scalings; "
                  "ALTER TABLE last_run DROP COLUMN written; PRAGMA user_version=2"),
              0);
  }
  const auto none = page({.values = true});
  EXPECT_TRUE(none.values.empty());
  EXPECT_TRUE(none.unknown_entry);
  EXPECT_FALSE(none.more);
  EXPECT_EQ(all({}), from_to(1, 3));
  fill_values(12);
  EXPECT_EQ(all_values({}), from_to(1, 12)) << "the next transaction has made the tables";
}

class ServerTest : public PagesTest {
 protected:
  void ask(std::uint64_t tag, JournalRead request = {}) {
    ASSERT_TRUE(server_.requests().push({.tag = tag, .request = std::move(request)}));
    server_.signal();
  }
  line::Reply await_reply() {
    line::Reply reply;
    while (!replies_.pop(reply)) {
      std::this_thread::yield();
    }
    return reply;
  }

  exchange::Wakeup answered_;
  exchange::Ring<line::Reply> replies_{2};
  JournalServer server_{plan_.file, replies_, answered_};
};

TEST_F(ServerTest, AnswersEachRequestOnceAlsoWhileThePublisherIsStopped) {
  fill("press", 1, 3);
  server_.start();
  constexpr std::uint64_t kMany = 20;  // more than the ring of replies
  for (std::uint64_t tag = 1; tag <= kMany; ++tag) {
    ask(tag);
  }
  for (std::uint64_t tag = 1; tag <= kMany; ++tag) {
    const line::Reply reply = await_reply();
    EXPECT_EQ(reply.tag, tag);
    const auto read = request::decode_page(reply.bytes());
    ASSERT_TRUE(read);
    EXPECT_EQ(read->records.size(), 3U);
  }
  EXPECT_TRUE(server_.stop());
}

TEST_F(ServerTest, RequestsThatWaitAtTheEndAreCancelled) {
  fill("press", 1, 3);
  ask(7);
  server_.start();
  const line::Reply first = await_reply();
  EXPECT_EQ(first.tag, 7U);
  EXPECT_TRUE(server_.stop());
  ask(8);
  server_.start();
  server_.stop();
  const line::Reply last = await_reply();
  EXPECT_EQ(last.tag, 8U);
  EXPECT_TRUE(last.ok() || last.error == line::to_error(line::Refusal::cancelled));
}

}  // namespace
}  // namespace linegate::gateway

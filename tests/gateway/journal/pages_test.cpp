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

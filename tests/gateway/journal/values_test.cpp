// SPDX-License-Identifier: Apache-2.0
// The value history: what was stored is read by its conditions, the oldest values make room, and no
// value holds beyond the run that read it.
#include <algorithm>
#include <thread>

#include <sqlite3.h>

#include "gateway/journal/journal_thread.h"

#include "tests/gateway/journal/journal_fixture.h"

namespace linegate::gateway {
namespace {

std::shared_ptr<const ValueEntry> entry_called(const std::string& name,
                                               const std::string& line = "press") {
  return std::make_shared<const ValueEntry>(ValueEntry{
      line, image::Direction::inputs, name == "ram" ? std::uint8_t{6} : std::uint8_t{5}, name});
}

class ValuesTest : public JournalTest {
 protected:
  static int store_values(Journal& journal, std::span<const StoredValue> values, Instant utc,
                          std::optional<std::uint64_t> lost_at_end = std::nullopt) {
    return journal.store({.values = values, .stream = kStream, .lost_at_end = lost_at_end}, utc);
  }
  // "inlet@5=7", "inlet@9=invalid"
  std::vector<std::string> texts(const ValueQuery& query = {.most = 1'000'000}) const {
    std::vector<std::string> out;
    for (const StoredValue& one : stored_values(query)) {
      const auto time = std::chrono::floor<std::chrono::seconds>(one.time.time_since_epoch());
      out.push_back(one.entry->name + "@" + std::to_string(time.count()) + "=" +
                    (one.value ? std::to_string(*one.value) : std::string("invalid")));
    }
    return out;
  }

  std::int64_t rows(const std::string& table) const {
    Database database;
    EXPECT_EQ(database.open(plan_.file, Database::Use::read), 0);
    int error = 0;
    const auto count = database.number("SELECT count(*) FROM " + table, error);
    EXPECT_EQ(error, 0);
    return count.value_or(-1);
  }

  using Texts = std::vector<std::string>;
  std::shared_ptr<const ValueEntry> inlet_ = entry_called("inlet");
  std::shared_ptr<const ValueEntry> ram_ = entry_called("ram");
};

TEST_F(ValuesTest, AreReadAsTheyWereStored) {
  Journal journal(plan_);
  ASSERT_EQ(journal.open(), 0);
  const StoredValue sent{
      std::make_shared<const ValueEntry>(ValueEntry{"p", image::Direction::outputs, 127, "x.y"}),
      Instant(std::chrono::nanoseconds(1'795'000'000'123'456'789)),
      ClockQuality::free_running,
      od::DataType::real64,
      64,
      0xFFFF'FFFF'FFFF'FFFE};
  ASSERT_EQ(store_values(journal, std::span(&sent, 1), at(0)), 0);
  const std::vector<StoredValue> found = stored_values();
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(*found[0].entry, *sent.entry);
  EXPECT_EQ(found[0].time, sent.time);
  EXPECT_EQ(found[0].clock, sent.clock);
  EXPECT_EQ(found[0].type, sent.type);
  EXPECT_EQ(found[0].bits, sent.bits);
  EXPECT_EQ(found[0].value, sent.value);
}

TEST_F(ValuesTest, AreSelectedByEachCondition) {
  Journal journal(plan_);
  ASSERT_EQ(journal.open(), 0);
  const std::vector<StoredValue> sent{value_at(inlet_, 1, 10), value_at(ram_, 2, 20),
                                      value_at(entry_called("inlet", "hall"), 3, 30),
                                      value_at(inlet_, 4, std::nullopt), value_at(inlet_, 5, 50)};
  ASSERT_EQ(store_values(journal, sent, at(5)), 0);
  EXPECT_EQ(texts(),
            (Texts{"inlet@1=10", "ram@2=20", "inlet@3=30", "inlet@4=invalid", "inlet@5=50"}));
  EXPECT_EQ(texts({.name = "ram"}), (Texts{"ram@2=20"}));
  EXPECT_EQ(texts({.node = 6}), (Texts{"ram@2=20"}));
  EXPECT_EQ(texts({.line = "hall"}), (Texts{"inlet@3=30"}));
  EXPECT_EQ(texts({.line = "press", .name = "inlet", .since = at(4)}),
            (Texts{"inlet@4=invalid", "inlet@5=50"}));
  EXPECT_EQ(texts({.until = at(2)}), (Texts{"inlet@1=10"}));
  EXPECT_EQ(texts({.newest = true, .most = 2}), (Texts{"inlet@4=invalid", "inlet@5=50"}));
  EXPECT_EQ(texts({.name = "x') OR 1=1 --"}), Texts{});
}

TEST_F(ValuesTest, AStarInANameIsAnyText) {
  Journal journal(plan_);
  ASSERT_EQ(journal.open(), 0);
  std::vector<StoredValue> sent;
  for (const char* const name : {"inlet.Left", "inlet.Lift", "ram.Left", "inlet.*", "a.aab"}) {
    sent.push_back(value_at(entry_called(name), 1, 1));
  }
  ASSERT_EQ(store_values(journal, sent, at(1)), 0);
  const auto found = [&](const std::string& name) {
    std::string out;
    for (const StoredValue& one : stored_values({.name = name})) {
      out += one.entry->name + ' ';
    }
    return out;
  };
  EXPECT_EQ(found("inlet.*"), "inlet.Left inlet.Lift inlet.* ");
  EXPECT_EQ(found("*.L*ft"), "inlet.Left inlet.Lift ram.Left ");
  EXPECT_EQ(found("*Left"), "inlet.Left ram.Left ");
  EXPECT_EQ(found("*ab*"), "a.aab ");
  EXPECT_EQ(found("**"), "inlet.Left inlet.Lift ram.Left inlet.* a.aab ");
  EXPECT_EQ(found("inlet.L"), "");
  EXPECT_EQ(found("inlet.L?ft"), "");
  EXPECT_EQ(found("Inlet.Left"), "");
  JournalReader reader;
  ValuePage page;
  ASSERT_EQ(reader.open(plan_.file), 0);
  ASSERT_EQ(reader.read(ValueQuery{.name = "ram.Left", .since = at(100)}, page), 0);
  EXPECT_TRUE(page.is_known) << "it has values, at other times";
  ASSERT_EQ(reader.read(ValueQuery{.name = "ram.Right"}, page), 0);
  EXPECT_FALSE(page.is_known);
}

TEST_F(ValuesTest, PagesHaveEachValueOnceWhileOthersAreStored) {
  Journal journal(plan_);
  ASSERT_EQ(journal.open(), 0);
  std::vector<StoredValue> sent;
  for (std::int64_t i = 1; i <= 6; ++i) {
    sent.push_back(value_at(i % 2 == 0 ? ram_ : inlet_, i, static_cast<std::uint64_t>(i)));
  }
  ASSERT_EQ(store_values(journal, sent, at(5)), 0);
  JournalReader reader;
  ValuePage page;
  ASSERT_EQ(reader.open(plan_.file), 0);
  std::vector<std::uint64_t> seen;
  std::int64_t position = 0;
  for (int i = 0; i < 4; ++i) {
    ASSERT_EQ(reader.read(ValueQuery{.name = "inlet", .after = position, .most = 2}, page), 0);
    for (const StoredValue& one : page.values) {
      seen.push_back(*one.value);
    }
    position = page.positions.empty() ? position : page.positions.back();
    if (i == 0) {
      const StoredValue more = value_at(inlet_, 7, 7);
      ASSERT_EQ(store_values(journal, std::span(&more, 1), at(7)), 0);
    }
  }
  EXPECT_EQ(seen, (std::vector<std::uint64_t>{1, 3, 5, 7}));
}

TEST_F(ValuesTest, TheOldestMakeRoomAndCostNoEvent) {
  plan_.max_size = 10'000'000;
  plan_.values_size = 400'000;
  Journal journal(plan_);
  ASSERT_EQ(journal.open(), 0);
  ASSERT_EQ(store(journal, entries("press", 1, 200), kStream, {}, at(0)), 0);
  std::int64_t next = 0;
  for (unsigned call = 0; call < 100; ++call) {
    std::vector<StoredValue> some;
    for (unsigned i = 0; i < Journal::kMostValues; ++i, ++next) {
      some.push_back(value_at(next % 2 == 0 ? inlet_ : ram_, next, next % 65'536));
    }
    ASSERT_EQ(store_values(journal, some, at(next)), 0) << call;
  }
  journal.close();
  EXPECT_EQ(numbers("press").size(), 200U);
  const std::vector<StoredValue> kept = stored_values();
  EXPECT_GT(kept.size(), 7'000U);
  EXPECT_LE(kept.size(), 400'000U / 40);
  EXPECT_EQ(kept.back().time, at(next - 1));
  EXPECT_EQ(kept.front().time, at(next - static_cast<std::int64_t>(kept.size())));
  EXPECT_LE(std::filesystem::file_size(plan_.file), 500'000U) << "the room of a value is enough";
}

// A constant value is as true as one that changes: it is not pushed out. When it has ended, it is.
TEST_F(ValuesTest, AValueThatHoldsIsNotRemoved) {
  plan_.values_size = 200'000;
  plan_.max_age = std::chrono::hours(1);
  Journal journal(plan_);
  ASSERT_EQ(journal.open(), 0);
  const StoredValue constant = value_at(ram_, 0, 7);
  ASSERT_EQ(store_values(journal, std::span(&constant, 1), at(0)), 0);
  std::int64_t next = 0;
  const auto fill = [&] {
    for (unsigned call = 0; call < 50; ++call) {
      std::vector<StoredValue> some;
      for (unsigned i = 0; i < Journal::kMostValues; ++i, ++next) {
        some.push_back(value_at(inlet_, next, 1));
      }
      ASSERT_EQ(store_values(journal, some, at(next)), 0) << call;
    }
  };
  fill();
  EXPECT_EQ(texts({.name = "ram"}), (Texts{"ram@0=7"}));
  EXPECT_GT(stored_values().size(), 2000U);
  const StoredValue end = value_at(ram_, next, std::nullopt);
  ASSERT_EQ(store_values(journal, std::span(&end, 1), at(next)), 0);
  EXPECT_EQ(texts({.name = "ram"}).size(), 2U);
  fill();
  EXPECT_EQ(texts({.name = "ram"}), Texts{});
  const StoredValue again = value_at(ram_, next, 8);
  ASSERT_EQ(store_values(journal, std::span(&again, 1), at(next)), 0);
  EXPECT_EQ(texts({.name = "ram"}).size(), 1U) << "the entry is made again";
}

TEST_F(ValuesTest, AnEntryIsRemovedWithItsLastRow) {
  plan_.values_size = 200'000;
  Journal journal(plan_);
  ASSERT_EQ(journal.open(), 0);
  std::vector<StoredValue> ended;
  for (std::int64_t i = 0; i < 100; ++i) {
    ended.push_back(value_at(entry_called("entry " + std::to_string(i)), i, 7));
    ended.push_back(value_at(ended.back().entry, i, std::nullopt));
  }
  ASSERT_EQ(store_values(journal, ended, at(100)), 0);
  for (std::int64_t call = 0; call < 50; ++call) {
    const std::vector<StoredValue> some(Journal::kMostValues, value_at(inlet_, 100 + call, 1));
    ASSERT_EQ(store_values(journal, some, at(100 + call)), 0) << call;
    ASSERT_EQ(rows("value_rows"), static_cast<std::int64_t>(stored_values().size())) << call;
  }
  EXPECT_EQ(rows("value_entries"), 1);
}

// The clock was years ahead when the first value was stored: those after it are removed by their
// age, and the numbers of their rows cost the later values no room.
TEST_F(ValuesTest, RemovedValuesNeedNoRoom) {
  plan_.values_size = 200'000;
  plan_.max_age = std::chrono::hours(1);
  Journal journal(plan_);
  ASSERT_EQ(journal.open(), 0);
  const std::vector<StoredValue> ahead{value_at(inlet_, 1'000'000'000, 1)};
  ASSERT_EQ(store_values(journal, ahead, at(1'000'000'000)), 0);
  std::int64_t now = 0;
  for (unsigned call = 0; call < 100; ++call) {
    std::vector<StoredValue> some;
    for (unsigned i = 0; i < 100; ++i, now += 2) {
      some.push_back(value_at(inlet_, now, 1));
    }
    ASSERT_EQ(store_values(journal, some, at(now)), 0) << call;
    EXPECT_GE(stored_values({.name = "inlet", .since = at(now - 3600), .most = 10'000}).size(),
              std::min<std::size_t>(1 + 100 * (call + 1), 1800))
        << call;
  }
}

// Values that hold are older than all others and count nevertheless.
TEST_F(ValuesTest, ValuesThatHoldCountAndTheirEndsHaveRoom) {
  plan_.max_size = 10'000'000;
  plan_.values_size = 400'000;
  std::int64_t next = 0;
  {
    Journal journal(plan_);
    ASSERT_EQ(journal.open(), 0);
    for (unsigned call = 0; call < 10; ++call) {
      std::vector<StoredValue> constant;
      for (unsigned i = 0; i < 250; ++i, ++next) {
        constant.push_back(value_at(entry_called("entry " + std::to_string(next)), 0, 7));
      }
      ASSERT_EQ(store_values(journal, constant, at(0)), 0);
    }
    for (unsigned call = 0; call < 100; ++call, ++next) {
      const std::vector<StoredValue> some(Journal::kMostValues, value_at(inlet_, next, 1));
      ASSERT_EQ(store_values(journal, some, at(next)), 0) << call;
      ASSERT_LE(rows("value_rows"), 400'000 / 40 - 2500) << call;
    }
    EXPECT_EQ(stored_values({.until = at(1), .most = 10'000}).size(), 2500U);
  }
  Journal journal(plan_);
  ASSERT_EQ(journal.open(), 0);
  ASSERT_EQ(store_values(journal, {}, at(next)), 0);
  EXPECT_LE(rows("value_rows"), 400'000 / 40);
}

// All entries end in one transaction, in a file without room for more values.
TEST_F(ValuesTest, ManyEntriesEndInAFullFile) {
  plan_.max_size = 10'000'000;
  plan_.values_size = 400'000;
  constexpr std::int64_t kMany = 2000;
  std::vector<std::shared_ptr<const ValueEntry>> many;
  for (std::int64_t i = 0; i < kMany; ++i) {
    many.push_back(entry_called("entry " + std::to_string(i)));
  }
  {
    Journal journal(plan_);
    ASSERT_EQ(journal.open(), 0);
    std::int64_t next = 0;
    for (unsigned call = 0; call < 60; ++call) {
      std::vector<StoredValue> some;
      for (unsigned i = 0; i < Journal::kMostValues; ++i, ++next) {
        some.push_back(value_at(many[static_cast<std::size_t>(next % kMany)], next, 1));
      }
      ASSERT_EQ(store_values(journal, some, at(next)), 0) << call;
    }
  }
  Journal journal(plan_);
  ASSERT_EQ(journal.open(), 0);
  ASSERT_EQ(store_values(journal, {}, at(1'000'000)), 0);
  const std::vector<StoredValue> kept = stored_values();
  EXPECT_EQ(std::ranges::count_if(kept, [](const StoredValue& one) { return !one.value; }), kMany);
  EXPECT_LE(kept.size(), 400'000U / 40);
}

TEST_F(ValuesTest, AreRemovedByAge) {
  plan_.max_age = std::chrono::seconds(10);
  Journal journal(plan_);
  ASSERT_EQ(journal.open(), 0);
  const std::vector<StoredValue> sent{value_at(inlet_, 1, 10), value_at(inlet_, 9, 20)};
  ASSERT_EQ(store_values(journal, sent, at(9)), 0);
  ASSERT_EQ(store_values(journal, {}, at(15)), 0);
  EXPECT_EQ(texts(), (Texts{"inlet@9=20"}));
}

TEST_F(ValuesTest, EndWithTheirRun) {
  {
    Journal journal(plan_);
    ASSERT_EQ(journal.open(), 0);
    const std::vector<StoredValue> sent{value_at(inlet_, 1, 10), value_at(ram_, 2, 20),
                                        value_at(ram_, 3, std::nullopt)};
    ASSERT_EQ(store_values(journal, sent, at(3)), 0);
    ASSERT_EQ(store_values(journal, {}, at(7), 0), 0);
    EXPECT_EQ(texts(), (Texts{"inlet@1=10", "ram@2=20", "ram@3=invalid", "inlet@7=invalid"}));
  }
  Journal journal(plan_);
  ASSERT_EQ(journal.open(), 0);
  ASSERT_EQ(store_values(journal, {}, at(20)), 0);
  EXPECT_EQ(stored_values().size(), 4U) << "they have ended once";
}

// The gateway was killed: its values hold until its last transaction, not until the next start.
TEST_F(ValuesTest, EndWithTheLastTransactionOfARunThatDidNotEndInOrder) {
  {
    Journal journal(plan_);
    ASSERT_EQ(journal.open(), 0);
    const StoredValue sent = value_at(inlet_, 1, 10);
    ASSERT_EQ(store_values(journal, std::span(&sent, 1), at(1)), 0);
    ASSERT_EQ(store_values(journal, {}, at(60)), 0);
  }
  Journal journal(plan_);
  ASSERT_EQ(journal.open(), 0);
  EXPECT_EQ(texts(), (Texts{"inlet@1=10"})) << "to open it changes nothing";
  const StoredValue sent = value_at(inlet_, 1000, 11);
  ASSERT_EQ(store_values(journal, std::span(&sent, 1), at(1000)), 0);
  EXPECT_EQ(texts(), (Texts{"inlet@1=10", "inlet@60=invalid", "inlet@1000=11"}));
}

// A transaction that failed has made no entry.
TEST_F(ValuesTest, AFullDiskLosesNoEntry) {
  Journal journal(plan_);
  ASSERT_EQ(journal.open(), 0);
  ASSERT_EQ(store_values(journal, {}, at(0)), 0);
  std::vector<StoredValue> sent;
  for (unsigned i = 0; i < Journal::kMostValues; ++i) {
    sent.push_back(value_at(entry_called("entry " + std::to_string(i)), i, i));
  }
  {
    const FileSizeLimit full(std::filesystem::file_size(plan_.file + "-wal") + 5000);
    EXPECT_NE(store_values(journal, sent, at(0)), 0);
  }
  ASSERT_EQ(journal.open(), 0);
  ASSERT_EQ(store_values(journal, sent, at(0)), 0);
  EXPECT_EQ(texts({.name = "entry 200"}), (Texts{"entry 200@200=200"}));
  EXPECT_EQ(stored_values().size(), Journal::kMostValues);
}

TEST_F(ValuesTest, AJournalOfAnEarlierVersionHasNoneAndContinues) {
  for (const char* const earlier :
       {"DROP TABLE last_run; PRAGMA user_version=1",
        "ALTER TABLE last_run DROP COLUMN written; PRAGMA user_version=2"}) {
    std::filesystem::remove_all(folder_);
    std::filesystem::create_directory(folder_);
    {
      Journal journal(plan_);
      ASSERT_EQ(journal.open(), 0);
      ASSERT_EQ(store(journal, entries("press", 1, 1), kStream, {}, at(0)), 0);
    }
    Database database;
    ASSERT_EQ(database.open(plan_.file, Database::Use::write), 0);
    ASSERT_EQ(database.execute(
                  "DROP TABLE value_entries; DROP TABLE value_rows; DROP TABLE value_scalings"),
              0);
    ASSERT_EQ(database.execute(earlier), 0);
    database.close();
    EXPECT_TRUE(stored_values().empty());
    Journal journal(plan_);
    ASSERT_EQ(journal.open(), 0);
    EXPECT_EQ(journal.set_aside(), 0);
    const StoredValue sent = value_at(inlet_, 1, 10);
    ASSERT_EQ(store_values(journal, std::span(&sent, 1), at(1)), 0);
    EXPECT_EQ(texts(), (Texts{"inlet@1=10"}));
    EXPECT_EQ(numbers("press").size(), 1U);
  }
}

TEST_F(ValuesTest, AJournalBeforeTheScalingsKeepsItsValues) {
  {
    Journal journal(plan_);
    ASSERT_EQ(journal.open(), 0);
    const StoredValue sent = value_at(inlet_, 1, 10);
    ASSERT_EQ(store_values(journal, std::span(&sent, 1), at(1)), 0);
  }
  Database database;
  ASSERT_EQ(database.open(plan_.file, Database::Use::write), 0);
  ASSERT_EQ(database.execute("DROP TABLE value_scalings; ALTER TABLE value_rows DROP COLUMN "
                             "scaling; PRAGMA user_version=3"),
            0);
  database.close();
  EXPECT_EQ(texts(), (Texts{"inlet@1=10"})) << "the reader reads this version";
  Journal journal(plan_);
  ASSERT_EQ(journal.open(), 0);
  EXPECT_EQ(journal.set_aside(), 0);
  StoredValue sent = value_at(inlet_, 2, 20);
  sent.scaling = std::make_shared<const od::Scaling>(od::Scaling{"bar", 0.1, 0});
  ASSERT_EQ(store_values(journal, std::span(&sent, 1), at(2)), 0);
  EXPECT_EQ(texts(), (Texts{"inlet@1=10", "inlet@1=invalid", "inlet@2=20"}));
  EXPECT_EQ(stored_values().front().scaling, nullptr);
}

TEST_F(ValuesTest, HaveTheScalingWithWhichTheyWereStored) {
  const auto scaled = [&](std::int64_t time, const od::Scaling& scaling) {
    StoredValue out = value_at(inlet_, time, 10);
    out.scaling = std::make_shared<const od::Scaling>(scaling);
    return out;
  };
  const od::Scaling bar{"bar", 0.1, -40};
  const od::Scaling mbar{"mbar", 1, 0};
  Journal journal(plan_);
  for (int run = 0; run < 2; ++run) {  // also those that another run made
    ASSERT_EQ(journal.open(), 0);
    const std::int64_t first = 10 * run;
    const std::vector<StoredValue> sent{scaled(first + 1, bar), scaled(first + 2, mbar),
                                        scaled(first + 3, bar), value_at(inlet_, first + 4, 10)};
    ASSERT_EQ(store_values(journal, sent, at(first + 5)), 0);
    journal.close();
  }
  std::vector<od::Scaling> found;
  for (const StoredValue& one : stored_values()) {
    if (one.value)
      found.push_back(one.scaling ? *one.scaling : od::Scaling{});
  }
  EXPECT_EQ(found, (std::vector{bar, mbar, bar, od::Scaling{}, bar, mbar, bar, od::Scaling{}}));
  EXPECT_EQ(rows("value_scalings"), 2);
}

TEST_F(ValuesTest, TheEndOfARunHasTheScalingOfTheLastValue) {
  Journal journal(plan_);
  ASSERT_EQ(journal.open(), 0);
  StoredValue sent = value_at(inlet_, 1, 10);
  sent.scaling = std::make_shared<const od::Scaling>(od::Scaling{"bar", 0.1, 0});
  ASSERT_EQ(store_values(journal, std::span(&sent, 1), at(1), 0), 0);
  const std::vector<StoredValue> found = stored_values();
  ASSERT_EQ(found.size(), 2U);
  EXPECT_FALSE(found[1].value);
  ASSERT_NE(found[1].scaling, nullptr);
  EXPECT_EQ(*found[1].scaling, *sent.scaling);
}

TEST_F(ValuesTest, AScalingThatNoEntryCanHaveIsNone) {
  Journal journal(plan_);
  ASSERT_EQ(journal.open(), 0);
  StoredValue sent = value_at(inlet_, 1, 10);
  sent.scaling = std::make_shared<const od::Scaling>(od::Scaling{"bar", 0.1, 0});
  ASSERT_EQ(store_values(journal, std::span(&sent, 1), at(1)), 0);
  journal.close();
  for (const char* const change :
       {"scale = 0", "scale = 9e999", "offset = -9e999", "scale = 'x'", "unit = zeroblob(33)"}) {
    Database database;
    ASSERT_EQ(database.open(plan_.file, Database::Use::write), 0);
    ASSERT_EQ(database.execute("UPDATE value_scalings SET unit = 'bar', scale = 1, offset = 0"), 0);
    ASSERT_EQ(database.execute((std::string("UPDATE value_scalings SET ") + change).c_str()), 0);
    database.close();
    ASSERT_EQ(stored_values().size(), 1U) << change;
    EXPECT_EQ(stored_values()[0].scaling, nullptr) << change;
    EXPECT_EQ(stored_values()[0].value, 10U) << change;
  }
}

TEST_F(ValuesTest, AreStoredByTheThreadWhileTheQueueHasRoom) {
  JournalThread::Options options{.plan = plan_, .incarnation = 42, .queued_values = 8};
  {
    JournalThread thread(options);
    thread.add_line("press");
    thread.start();
    EXPECT_TRUE(thread.record(value_at(inlet_, 1, 10)));
    EXPECT_TRUE(thread.stop());
    for (std::int64_t i = 2; i < 10; ++i) {
      EXPECT_TRUE(thread.record(value_at(inlet_, i, 10)));
    }
    EXPECT_FALSE(thread.record(value_at(inlet_, 10, 10)));
  }
  const Texts found = texts();
  ASSERT_EQ(found.size(), 2U);
  EXPECT_EQ(found[0], "inlet@1=10");
  EXPECT_TRUE(found[1].ends_with("=invalid")) << "the run has ended";
}

// Values alone find the failure, too. What found room in the queue is stored when the disk works.
TEST_F(ValuesTest, ADiskThatFailsIsReportedAndLosesNoQueuedValue) {
  JournalThread thread({.plan = plan_,
                        .incarnation = kStream,
                        .period = std::chrono::milliseconds(2),
                        .retry_period = std::chrono::milliseconds(2),
                        .queued_values = 64});
  thread.add_line("press");
  thread.start();
  const auto next_condition = [&] {
    for (;;) {
      if (const auto news = thread.pop_news()) {
        return news->condition;
      }
      std::this_thread::yield();
    }
  };
  EXPECT_EQ(next_condition(), event::JournalCondition::renewed);
  std::int64_t queued = 0;
  {
    const FileSizeLimit full(8192);
    ASSERT_TRUE(thread.record(value_at(inlet_, ++queued, 1)));
    EXPECT_EQ(next_condition(), event::JournalCondition::failing);
    while (thread.record(value_at(inlet_, queued + 1, 1))) {
      ASSERT_LT(++queued, 1000) << "the queue is bounded";
    }
  }
  EXPECT_EQ(next_condition(), event::JournalCondition::working);
  EXPECT_TRUE(thread.stop());
  const std::vector<StoredValue> kept = stored_values();
  ASSERT_EQ(kept.size(), static_cast<std::size_t>(queued) + 1);
  for (std::int64_t i = 0; i < queued; ++i) {
    EXPECT_EQ(kept[static_cast<std::size_t>(i)].time, at(i + 1));
  }
  EXPECT_FALSE(kept.back().value) << "the run has ended";
}

// More values than the disk takes: the thread still reports, and still ends.
TEST_F(ValuesTest, AFloodOfValuesHidesNoNews) {
  JournalThread thread({.plan = plan_,
                        .incarnation = kStream,
                        .period = std::chrono::milliseconds(2),
                        .retry_period = std::chrono::milliseconds(2)});
  thread.add_line("press");
  thread.start();
  exchange::Flag stop;
  std::thread flood([&] {
    for (std::int64_t i = 1; !stop.raised(); ++i) {
      (void)thread.record(value_at(inlet_, i, 1));
    }
  });
  const auto await = [&](event::JournalCondition condition) {
    for (auto news = thread.pop_news(); !news || news->condition != condition;) {
      std::this_thread::yield();
      news = thread.pop_news();
    }
  };
  await(event::JournalCondition::renewed);
  {
    const FileSizeLimit full(8192);
    await(event::JournalCondition::failing);
  }
  await(event::JournalCondition::working);
  stop.raise();
  flood.join();
  EXPECT_TRUE(thread.stop());
}

}  // namespace
}  // namespace linegate::gateway

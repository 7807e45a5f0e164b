// SPDX-License-Identifier: Apache-2.0
// Power failures at any operation of the disk: after each, the journal opens, has every entry that
// was stored once, and none in part.
#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <memory>
#include <random>

#include "gateway/journal/journal.h"

#include "tests/dds/sanitizers.h"
#include "tests/gateway/journal/journal_fixture.h"
#include "tests/gateway/journal/recorded_disk.h"

namespace linegate::gateway {
namespace {

std::uint64_t from_environment(const char* name, std::uint64_t otherwise) {
  const char* const text = std::getenv(name);
  return text == nullptr ? otherwise : std::strtoul(text, nullptr, 10);
}

class PowerCut : public JournalTest {
 protected:
  // What is promised from an operation of the record on.
  struct Promise {
    std::size_t operation = 0;
    std::uint64_t last = 0;   // entries 1 to this one are stored
    std::uint64_t limit = 0;  // numbers that may be in use
    LastRun run;
  };

  PowerCut() : seed_(static_cast<unsigned>(from_environment("LINEGATE_POWER_CUT_SEED", 18))) {
    random_.seed(seed_);
    plan_.file = folder_ + "/disk/journal.db";
    plan_.max_size = 50'000'000;
    checked_.file = folder_ + "/checked/journal.db";
    checked_.max_size = plan_.max_size;
  }

  void commit(Journal& journal, std::size_t count, std::optional<std::uint64_t> lost = {}) {
    const std::uint64_t last = stored_ + count;
    const std::vector<NumberLimit> limits{{"press", last + 100}};
    const std::vector<JournalEntry> some = entries("press", stored_ + 1, last);
    const StoredValue value = value_at(count_, 0, last);
    ASSERT_EQ(journal.store({.entries = some,
                             .values = std::span(&value, 1),
                             .stream = kStream,
                             .limits = limits,
                             .lost_at_end = lost},
                            at(0)),
              0);
    stored_ = last;
    promises_.push_back(
        {disk_.operations(), last, last + 100,
         LastRun{.ended = lost.has_value(), .lost = lost.value_or(0), .written = at(0)}});
  }

  // Runs of a gateway, the last of which ends in order or not.
  void run(unsigned runs, unsigned stores) {
    std::filesystem::create_directories(folder_ + "/disk");
    disk_.begin(folder_ + "/disk");
    for (unsigned i = 0; i < runs; ++i) {
      Journal journal(plan_);
      ASSERT_EQ(journal.open(), 0);
      ASSERT_EQ(journal.set_aside(), 0);
      for (unsigned k = 0; k < stores; ++k) {
        commit(journal, 1 + random_() % 20);
      }
      if (random_() % 2 == 0) {
        commit(journal, 0, random_() % 3);
      }
    }
  }

  static void write(const RecordedDisk::Files& files, const std::string& folder) {
    std::filesystem::create_directories(folder);
    for (const auto& [name, contents] : files) {
      std::ofstream(folder + "/" + name, std::ios::binary) << contents;
    }
  }

  // Everything promised at that operation is in these files; the reason if it is not.
  std::string check(const RecordedDisk::Files& files, std::size_t operation) const {
    std::filesystem::remove_all(folder_ + "/checked");
    write(files, folder_ + "/checked");
    const auto after = std::ranges::upper_bound(promises_, operation, {}, &Promise::operation);
    const Promise& promised = *std::prev(after);
    Journal journal(checked_);
    if (const int error = journal.open(); error != 0 || journal.set_aside() != 0) {
      return "not opened: " + error_text(error != 0 ? error : journal.set_aside());
    }
    const bool next_is_there = journal.last_run() != promised.run && after != promises_.end() &&
                               journal.last_run() == after->run;
    if (journal.last_run() != promised.run && !next_is_there) {
      return "the last run ended " + std::to_string(static_cast<int>(journal.last_run().ended)) +
             " with " + std::to_string(journal.last_run().lost) + " lost, not " +
             std::to_string(static_cast<int>(promised.run.ended)) + " with " +
             std::to_string(promised.run.lost);
    }
    const auto limit = journal.limits().find("press");
    if (promised.last != 0 && (journal.stream() != kStream || limit == journal.limits().end() ||
                               limit->second < promised.limit)) {
      return "numbers would be used twice";
    }
    journal.close();
    return check_entries(promised.last, after == promises_.end() ? promised.last : after->last);
  }

  std::string check_entries(std::uint64_t promised, std::uint64_t next) const {
    JournalReader reader;
    JournalPage page;
    if (reader.open(checked_.file) != 0 || reader.read({.most = 1'000'000}, page) != 0) {
      return "not read";
    }
    if (page.entries.size() != promised && page.entries.size() != next) {
      return std::to_string(page.entries.size()) + " entries instead of " +
             std::to_string(promised);
    }
    for (std::size_t i = 0; i < page.entries.size(); ++i) {
      if (page.entries[i] != entry("press", i + 1)) {
        return "entry " + std::to_string(i + 1) + " differs";
      }
    }
    ValuePage values;
    if (reader.read({.newest = true, .most = 2}, values) != 0) {
      return "values are not read";
    }
    const auto is_count = [&](const StoredValue& one) { return one.value == page.entries.size(); };
    if (!page.entries.empty() && std::ranges::none_of(values.values, is_count)) {
      return "the value of the last transaction is missing";
    }
    return {};
  }

  std::size_t random_operation() { return random_() % (disk_.operations() + 1); }

  unsigned seed_;
  std::mt19937 random_;
  RecordedDisk disk_;
  config::Journal checked_;
  const std::shared_ptr<const ValueEntry> count_ =
      std::make_shared<const ValueEntry>(ValueEntry{.line = "press", .name = "events"});
  std::uint64_t stored_ = 0;
  std::vector<Promise> promises_{Promise{}};
};

// Includes the files that a start makes, the end of a run, and the write of the log into the file.
TEST_F(PowerCut, NothingThatWasStoredIsMissing) {
  run(4, 12);
  const std::uint64_t cuts = from_environment("LINEGATE_POWER_CUTS", 150);
  for (std::uint64_t i = 0; i < cuts; ++i) {
    const std::size_t operation = random_operation();
    const auto files = disk_.cut(operation, RecordedDisk::Sync::honest, random_);
    ASSERT_EQ(check(files, operation), "")
        << "seed " << seed_ << ", cut " << i << " after " << operation << " operations";
  }
}

#ifndef LINEGATE_TESTS_ARE_SANITIZED  // each cut repeats all operations: half a minute there
// The log is written into the file while it grows, and its pages are used again.
TEST_F(PowerCut, NothingIsMissingWhileTheLogIsWrittenIntoTheFile) {
  run(1, 500);
  const std::uint64_t cuts = from_environment("LINEGATE_POWER_CUTS", 150) / 50;
  for (std::uint64_t i = 0; i < cuts; ++i) {
    const std::size_t operation = random_operation();
    const auto files = disk_.cut(operation, RecordedDisk::Sync::honest, random_);
    ASSERT_EQ(check(files, operation), "")
        << "seed " << seed_ << ", cut " << i << " after " << operation << " operations";
  }
}
#endif

// Each run begins with the files that the cut before left, and is cut, too, also while SQLite
// recovers them.
TEST_F(PowerCut, CutsFollowCuts) {
  for (unsigned round = 0; round < 20; ++round) {
    run(1, 1 + static_cast<unsigned>(random_() % 6));
    const std::size_t operation = random_operation();
    const auto files = disk_.cut(operation, RecordedDisk::Sync::honest, random_);
    ASSERT_EQ(check(files, operation), "")
        << "seed " << seed_ << ", round " << round << " after " << operation << " operations";
    JournalReader reader;
    JournalPage page;
    ASSERT_EQ(reader.open(checked_.file), 0);
    ASSERT_EQ(reader.read({.most = 1'000'000}, page), 0);
    Journal journal(checked_);
    ASSERT_EQ(journal.open(), 0);
    const auto limit = journal.limits().find("press");
    stored_ = page.entries.size();
    promises_ = {Promise{0, stored_, limit == journal.limits().end() ? 0 : limit->second,
                         journal.last_run()}};
    std::filesystem::remove_all(folder_ + "/disk");
    write(files, folder_ + "/disk");
  }
}

// The test can fail: on a disk that confirms before it has written, entries are missing.
TEST_F(PowerCut, ADiskThatIgnoresSyncLosesEntries) {
  run(2, 10);
  unsigned lost = 0;
  for (unsigned i = 0; i < 20; ++i) {
    const std::size_t operation = random_operation();
    const auto files = disk_.cut(operation, RecordedDisk::Sync::ignored, random_);
    lost += check(files, operation).empty() ? 0U : 1U;
  }
  EXPECT_GT(lost, 10U);
}

}  // namespace
}  // namespace linegate::gateway

// SPDX-License-Identifier: Apache-2.0
// A folder for a journal, and a disk without room.
#pragma once

#include <csignal>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <unistd.h>

#include "gateway/journal/journal.h"
#include "gateway/journal/journal_reader.h"

namespace linegate::gateway {

constexpr std::uint64_t kStream = 0xFEED'0000'0000'0001;

inline Instant at(std::int64_t seconds) {
  return Instant(std::chrono::seconds(seconds));
}

inline JournalEntry entry(std::string line, std::uint64_t number) {
  return {.stream = kStream,
          .incarnation = 0xFEED'0000'0000'0002,
          .line = std::move(line),
          .number = number,
          .time = at(static_cast<std::int64_t>(number)),
          .clock = ClockQuality::synchronised,
          .kind = EventKind::heartbeat_lost,
          .severity = EventSeverity::error,
          .node = 5,
          .code = 0xFFFF'FFFF,
          .value = 0x8000'0000,
          .data = {std::byte{0}, std::byte{0xFF}},
          .text = "node 5: heartbeat lost"};
}

inline std::vector<JournalEntry> entries(const std::string& line, std::uint64_t first,
                                         std::uint64_t last) {
  std::vector<JournalEntry> out;
  for (std::uint64_t number = first; number <= last; ++number) {
    out.push_back(entry(line, number));
  }
  return out;
}

inline int store(Journal& journal, std::span<const JournalEntry> entries, std::uint64_t stream,
                 std::span<const NumberLimit> limits, Instant utc,
                 std::optional<std::uint64_t> lost_at_end = std::nullopt) {
  return journal.store(
      {.entries = entries, .stream = stream, .limits = limits, .lost_at_end = lost_at_end}, utc);
}

// A value of an entry that is valid from that time on, or of which the validity ends then.
inline StoredValue value_at(const std::shared_ptr<const ValueEntry>& entry, std::int64_t seconds,
                            std::optional<std::uint64_t> value) {
  return {entry, at(seconds), ClockQuality::synchronised, od::DataType::unsigned16, 16, value};
}

// While it exists, no file of this process can grow beyond `bytes`.
class FileSizeLimit {
 public:
  explicit FileSizeLimit(rlim_t bytes) {
    std::signal(SIGXFSZ, SIG_IGN);
    getrlimit(RLIMIT_FSIZE, &before_);
    rlimit limit = before_;
    limit.rlim_cur = bytes;
    setrlimit(RLIMIT_FSIZE, &limit);
  }
  ~FileSizeLimit() { setrlimit(RLIMIT_FSIZE, &before_); }
  FileSizeLimit(const FileSizeLimit&) = delete;
  FileSizeLimit& operator=(const FileSizeLimit&) = delete;

 private:
  rlimit before_{};
};

class JournalTest : public testing::Test {
 protected:
  JournalTest() {
    std::string name =
        (std::filesystem::temp_directory_path() / "linegate-journal-XXXXXX").string();
    folder_ = mkdtemp(name.data());
    plan_.file = folder_ + "/journal.db";
  }
  ~JournalTest() override { std::filesystem::remove_all(folder_); }

  // All entries, or those of the query.
  std::vector<JournalEntry> stored(JournalQuery query = {.most = 1'000'000}) const {
    JournalReader reader;
    JournalPage page;
    EXPECT_EQ(reader.open(plan_.file), 0);
    EXPECT_EQ(reader.read(query, page), 0);
    return page.entries;
  }
  std::vector<StoredValue> stored_values(const ValueQuery& query = {.most = 1'000'000}) const {
    JournalReader reader;
    ValuePage page;
    EXPECT_EQ(reader.open(plan_.file), 0);
    EXPECT_EQ(reader.read(query, page), 0);
    EXPECT_EQ(page.values.size(), page.positions.size());
    return page.values;
  }
  // The numbers of a line, in the order of the file.
  std::vector<std::uint64_t> numbers(const std::string& line) const {
    std::vector<std::uint64_t> out;
    for (const JournalEntry& one : stored({.line = line, .most = 1'000'000})) {
      out.push_back(one.number);
    }
    return out;
  }

  std::string folder_;
  config::Journal plan_;
};

}  // namespace linegate::gateway

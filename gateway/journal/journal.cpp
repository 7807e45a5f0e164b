// SPDX-License-Identifier: Apache-2.0
#include "gateway/journal/journal.h"

#include <algorithm>
#include <bit>
#include <cstdio>
#include <filesystem>
#include <system_error>
#include <utility>

#include <fcntl.h>
#include <fmt/format.h>
#include <sqlite3.h>
#include <sys/file.h>
#include <unistd.h>

#include "gateway/journal/schema.h"
#include "stack/base/assert.h"

namespace linegate::gateway {
namespace {

constexpr std::int64_t kPageBytes = 4096;
// Entries that one store() removes at most: it must not take much longer than other calls.
constexpr std::int64_t kRemovedAtOnce = 2000;
// Pages that stay free for one store(): its entries, limits and changed index pages.
constexpr std::int64_t kSparePages = 64;

std::int64_t stored(std::uint64_t number) {
  return std::bit_cast<std::int64_t>(number);
}

std::uint64_t loaded(std::int64_t number) {
  return std::bit_cast<std::uint64_t>(number);
}

}  // namespace

struct Journal::Statements {
  explicit Statements(sqlite3* of)
      : insert(of,
               "INSERT OR IGNORE INTO events(stream, incarnation, line, number, time, clock, kind, "
               "severity, node, code, value, data, text) VALUES(?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, "
               "?, ?)"),
        stream(of, "INSERT OR REPLACE INTO stream VALUES(1, ?)"),
        limit(of, "INSERT OR REPLACE INTO lines VALUES(?, ?)"),
        remove_oldest(of,
                      "DELETE FROM events WHERE id IN (SELECT id FROM events ORDER BY id LIMIT ?)"),
        remove_aged(of,
                    "DELETE FROM events WHERE time < ?1 AND id IN "
                    "(SELECT id FROM events ORDER BY id LIMIT ?2)") {}

  Statement insert;
  Statement stream;
  Statement limit;
  Statement remove_oldest;
  Statement remove_aged;
};

Journal::Journal(config::Journal plan) : plan_(std::move(plan)) {
}

Journal::~Journal() {
  close();
  if (lock_ >= 0) {
    ::close(lock_);
  }
}

std::string Journal::unusable_file() const {
  return plan_.file + ".unusable";
}

void Journal::close() {
  statements_.reset();
  database_.close();
}

// A file of its own: closing another descriptor of the journal would end the locks of SQLite.
int Journal::lock() {
  if (lock_ < 0) {
    lock_ = ::open((plan_.file + ".lock").c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0640);
  }
  if (lock_ < 0) {
    return SQLITE_CANTOPEN;
  }
  return ::flock(lock_, LOCK_EX | LOCK_NB) == 0 ? SQLITE_OK : SQLITE_BUSY;
}

int Journal::open() {
  int error = lock();
  if (error != SQLITE_OK) {
    return error;
  }
  error = unusable_ != 0 ? unusable_ : open_file();
  if (is_unusable(error)) {
    const int why = error;
    error = set_file_aside();
    if (error == SQLITE_OK) {
      set_aside_ = why;  // until store() succeeds: a new file may take several calls on a full disk
      unusable_ = 0;
      error = open_file();
    }
  }
  if (error == SQLITE_OK) {
    checked_ = true;
    statements_ = std::make_unique<Statements>(database_.get());
  } else {
    close();
  }
  return error;
}

int Journal::open_file() {
  // A log without its database, after a crash in set_file_aside(), has numbers of the past
  std::error_code ignored;
  int error = std::filesystem::exists(plan_.file, ignored) ? SQLITE_OK : move_log_aside();
  error = error != SQLITE_OK ? error : database_.open(plan_.file, Database::Use::write);
  if (error == SQLITE_OK) {
    database_.stop_when(interrupted_);
  }
  // FULL: a commit is on the disk when store() returns, also if the power fails.
  error = error != SQLITE_OK ? error
                             : database_.execute(
                                   "PRAGMA journal_mode=WAL; PRAGMA synchronous=FULL;"
                                   "PRAGMA journal_size_limit=8000000");
  if (error == SQLITE_OK) {
    const auto version = database_.number("PRAGMA user_version", error);
    const auto tables = error != SQLITE_OK
                            ? std::nullopt
                            : database_.number("SELECT count(*) FROM sqlite_schema", error);
    if (error == SQLITE_OK) {
      error = version == 0 && tables == 0 ? create() : check();
    }
  }
  if (error == SQLITE_OK) {
    const std::int64_t pages = static_cast<std::int64_t>(plan_.max_size) / kPageBytes;
    error = database_.execute(fmt::format("PRAGMA max_page_count={}", pages).c_str());
  }
  return error == SQLITE_OK ? read_numbers() : error;
}

int Journal::create() {
  const int error = database_.execute(
      fmt::format("BEGIN IMMEDIATE; PRAGMA application_id={}; PRAGMA user_version={}; {}{} COMMIT",
                  kJournalApplication, kJournalVersion, kJournalTables, kLastRunTable)
          .c_str());
  if (error != SQLITE_OK) {
    database_.execute("ROLLBACK");
  }
  version_ = kJournalVersion;
  return error;
}

// Unusable: another program's file, another version, or damaged. The contents are read once only: a
// large file takes long, and a full disk is no reason to doubt it.
int Journal::check() {
  int error = SQLITE_OK;
  const auto application = database_.number("PRAGMA application_id", error);
  const auto version =
      error == SQLITE_OK ? database_.number("PRAGMA user_version", error) : std::nullopt;
  if (error != SQLITE_OK) {
    return error;
  }
  if (application != kJournalApplication || version < kOldestJournalVersion ||
      version > kJournalVersion) {
    return SQLITE_MISMATCH;
  }
  version_ = static_cast<int>(*version);
  if (checked_) {
    return SQLITE_OK;
  }
  const auto finding = database_.text("PRAGMA quick_check(1)", error);
  return error != SQLITE_OK ? error : finding == "ok" ? SQLITE_OK : SQLITE_CORRUPT;
}

int Journal::read_numbers() {
  int error = SQLITE_OK;
  stream_ = loaded(database_.number("SELECT id FROM stream", error).value_or(0));
  limits_.clear();
  if (error != SQLITE_OK) {
    return error;
  }
  Statement lines(database_.get(), "SELECT name, number_limit FROM lines");
  while ((error = lines.step()) == SQLITE_ROW) {
    limits_[lines.text(0)] = loaded(lines.number(1));
  }
  return error == SQLITE_DONE ? read_last_run() : error;
}

int Journal::read_last_run() {
  if (last_run_read_ || version_ < 2) {
    return SQLITE_OK;
  }
  int error = SQLITE_OK;
  const auto ended = database_.number("SELECT ended FROM last_run", error);
  const auto lost =
      error == SQLITE_OK ? database_.number("SELECT lost FROM last_run", error) : std::nullopt;
  if (error == SQLITE_OK && ended && lost) {
    last_run_ = {*ended != 0, loaded(*lost)};
  }
  return error;
}

// In the transaction of a store(): a file of version 1 on a full disk can still be opened.
int Journal::mark(const LastRun& run) {
  int error = SQLITE_OK;
  if (version_ < kJournalVersion) {
    error = database_.execute(
        fmt::format("{} PRAGMA user_version={}", kLastRunTable, kJournalVersion).c_str());
  }
  return error != SQLITE_OK || run == marked_
             ? error
             : database_.execute(fmt::format("INSERT OR REPLACE INTO last_run VALUES(1, {}, {})",
                                             run.ended ? 1 : 0, stored(run.lost))
                                     .c_str());
}

// The database first: without its log it would be a sound journal with limits of the past, from
// which numbers would repeat.
int Journal::set_file_aside() {
  close();
  checked_ = false;
  marked_.reset();
  std::error_code error;
  std::filesystem::remove(unusable_file() + "-wal", error);
  if (!error) {
    std::filesystem::rename(plan_.file, unusable_file(), error);
  }
  if (error && error != std::errc::no_such_file_or_directory) {
    return SQLITE_CANTOPEN;
  }
  return move_log_aside();
}

// The log of SQLite belongs to the file; the shared memory is made anew.
int Journal::move_log_aside() {
  std::error_code error;
  std::filesystem::rename(plan_.file + "-wal", unusable_file() + "-wal", error);
  if (!error || error == std::errc::no_such_file_or_directory) {
    std::filesystem::remove(plan_.file + "-shm", error);
  }
  return error ? SQLITE_CANTOPEN : SQLITE_OK;
}

int Journal::store(std::span<const JournalEntry> entries, std::uint64_t stream,
                   std::span<const NumberLimit> limits, Instant utc,
                   std::optional<std::uint64_t> lost_at_end) {
  LINEGATE_ASSERT(entries.size() <= kMostEntries, "the free pages suffice for the entries");
  if (!is_open()) {
    return SQLITE_CANTOPEN;
  }
  int error = database_.execute("BEGIN IMMEDIATE");
  const LastRun run{lost_at_end.has_value(), lost_at_end.value_or(0)};
  error = error == SQLITE_OK ? write(entries, stream, limits, utc) : error;
  error = error == SQLITE_OK ? mark(run) : error;
  error = error == SQLITE_OK ? database_.execute("COMMIT") : error;
  if (error != SQLITE_OK) {
    database_.execute("ROLLBACK");
    unusable_ = is_unusable(error) ? error : 0;
    close();
    return error;
  }
  set_aside_ = 0;
  version_ = kJournalVersion;
  last_run_read_ = true;
  marked_ = run;
  if (stream != stream_) {
    limits_.clear();
  }
  stream_ = stream;
  for (const NumberLimit& one : limits) {
    limits_[one.line] = one.limit;
  }
  return SQLITE_OK;
}

int Journal::write(std::span<const JournalEntry> entries, std::uint64_t stream,
                   std::span<const NumberLimit> limits, Instant utc) {
  int error = trim(utc);
  for (auto entry = entries.begin(); error == SQLITE_OK && entry != entries.end(); ++entry) {
    error = insert(*entry);
  }
  if (error == SQLITE_OK && stream != stream_) {
    statements_->stream.bind(1, stored(stream));
    error = statements_->stream.run();
    error = error == SQLITE_OK ? database_.execute("DELETE FROM lines") : error;
  }
  for (auto one = limits.begin(); error == SQLITE_OK && one != limits.end(); ++one) {
    statements_->limit.bind(1, std::string_view(one->line));
    statements_->limit.bind(2, stored(one->limit));
    error = statements_->limit.run();
  }
  return error;
}

int Journal::insert(const JournalEntry& entry) {
  Statement& to = statements_->insert;
  to.bind(1, stored(entry.stream));
  to.bind(2, stored(entry.incarnation));
  to.bind(3, std::string_view(entry.line));
  to.bind(4, stored(entry.number));
  to.bind(5, entry.time.time_since_epoch().count());
  to.bind(6, static_cast<std::int64_t>(entry.clock));
  to.bind(7, static_cast<std::int64_t>(entry.kind));
  to.bind(8, static_cast<std::int64_t>(entry.severity));
  to.bind(9, std::int64_t{entry.node});
  to.bind(10, std::int64_t{entry.code});
  to.bind(11, std::int64_t{entry.value});
  to.bind(12, std::span<const std::byte>(entry.data));
  to.bind(13, std::string_view(entry.text));
  return to.run();
}

bool Journal::is_nearly_full(int& error) {
  const auto pages = database_.number("PRAGMA page_count", error);
  const auto unused =
      error == SQLITE_OK ? database_.number("PRAGMA freelist_count", error) : std::nullopt;
  const std::int64_t most = static_cast<std::int64_t>(plan_.max_size) / kPageBytes;
  return error == SQLITE_OK && *pages - *unused + std::max(kSparePages, most / 50) > most;
}

// By age: of the oldest stored entries, because the clock may have been wrong when an entry was
// made.
int Journal::trim(Instant utc) {
  int error = SQLITE_OK;
  if (plan_.max_age > Duration::zero()) {
    statements_->remove_aged.bind(1, (utc - plan_.max_age).time_since_epoch().count());
    statements_->remove_aged.bind(2, kRemovedAtOnce);
    error = statements_->remove_aged.run();
  }
  if (error == SQLITE_OK && is_nearly_full(error)) {
    statements_->remove_oldest.bind(1, kRemovedAtOnce);
    error = statements_->remove_oldest.run();
  }
  return error;
}

}  // namespace linegate::gateway

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
// Pages that stay free for one store(): its entries, values, limits and changed index pages.
constexpr std::int64_t kSparePages = 128;
// Of a value, with its part of the unused room of pages; at most.
constexpr std::int64_t kValueRowBytes = 40;

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
                    "(SELECT id FROM events ORDER BY id LIMIT ?2)"),
        insert_value(of,
                     "INSERT INTO value_rows(entry, time, clock, type, bits, value, scaling) "
                     "VALUES(?, ?, ?, ?, ?, ?, ?)"),
        set_newest(of, "UPDATE value_entries SET newest = last_insert_rowid() WHERE id = ?"),
        oldest_value(of,
                     "SELECT id FROM value_rows WHERE id NOT IN (SELECT newest FROM value_entries) "
                     "ORDER BY id LIMIT 1"),
        remove_ended_values(of,
                            "DELETE FROM value_rows WHERE value IS NULL AND id IN "
                            "(SELECT newest FROM value_entries WHERE newest < ?)"),
        remove_entries(of,
                       "DELETE FROM value_entries WHERE newest < ? AND "
                       "NOT EXISTS (SELECT 1 FROM value_rows WHERE value_rows.id = newest)"),
        remove_values(of,
                      "DELETE FROM value_rows WHERE id IN (SELECT id FROM value_rows WHERE id NOT "
                      "IN (SELECT newest FROM value_entries) ORDER BY id LIMIT ?)"),
        remove_aged_values(of,
                           "DELETE FROM value_rows WHERE time < ?1 AND id IN (SELECT id FROM "
                           "value_rows WHERE id NOT IN (SELECT newest FROM value_entries) "
                           "ORDER BY id LIMIT ?2)") {}

  Statement insert;
  Statement stream;
  Statement limit;
  Statement remove_oldest;
  Statement remove_aged;
  Statement insert_value;
  Statement set_newest;
  Statement oldest_value;
  Statement remove_ended_values;
  Statement remove_entries;
  Statement remove_values;
  Statement remove_aged_values;
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
  value_entries_.clear();  // those of a failed transaction do not exist
  scalings_.clear();
  value_rows_.reset();
  database_.close();
}

bool Journal::is_moved() const {
  int moved = 0;
  return is_open() &&
         sqlite3_file_control(database_.get(), "main", SQLITE_FCNTL_HAS_MOVED, &moved) ==
             SQLITE_OK &&
         moved != 0;
}

bool Journal::is_beside_removed() const {
  const auto is_it = [](const std::string& path, const FileIdentity& opened) {
    const FileIdentity now = FileIdentity::of(path);
    return now.inode != 0 && now == opened;
  };
  return is_open() &&
         !(is_it(plan_.file + "-wal", log_) && is_it(plan_.file + "-shm", shared_memory_) &&
           is_it(plan_.file + ".lock", FileIdentity::of(lock_)));
}

// The shared memory belongs to the log that is gone. SQLite has one of each file in a process:
// while a reader of this process is open, the next open() gets it again.
bool Journal::renew() {
  int error = SQLITE_OK;
  statements_.reset();
  const auto busy = database_.number("PRAGMA wal_checkpoint(TRUNCATE)", error);
  if (error != SQLITE_OK || busy != 0) {
    statements_ = std::make_unique<Statements>(database_.get());
    return false;
  }
  close();
  std::error_code ignored;
  std::filesystem::remove(plan_.file + "-shm", ignored);
  return true;
}

// The log at the path may still be that of the file that was moved, and SQLite would apply it to
// the one that took its place: it is emptied, or else moved aside. Its shared memory is made anew,
// because a reader of the old file would end the locks of this process when it closes it.
void Journal::leave() {
  int error = SQLITE_OK;
  statements_.reset();
  const auto busy = database_.number("PRAGMA wal_checkpoint(TRUNCATE)", error);
  close();
  if (error != SQLITE_OK || busy != 0) {
    (void)move_log_aside();
  }
  std::error_code ignored;
  std::filesystem::remove(plan_.file + "-shm", ignored);
  checked_ = false;
  last_run_read_ = false;
  if (lock_ >= 0) {
    ::close(std::exchange(lock_, -1));
  }
}

// A file of its own: closing another descriptor of the journal would end the locks of SQLite.
int Journal::lock() {
  if (lock_ >= 0 && FileIdentity::of(plan_.file + ".lock") != FileIdentity::of(lock_)) {
    ::close(std::exchange(lock_, -1));
  }
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
    log_ = FileIdentity::of(plan_.file + "-wal");
    shared_memory_ = FileIdentity::of(plan_.file + "-shm");
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
    const std::int64_t pages =
        static_cast<std::int64_t>(plan_.max_size + plan_.values_size) / kPageBytes;
    error = database_.execute(fmt::format("PRAGMA max_page_count={}", pages).c_str());
  }
  return error == SQLITE_OK ? read_numbers() : error;
}

int Journal::create() {
  const int error = database_.execute(
      fmt::format(
          "BEGIN IMMEDIATE; PRAGMA application_id={}; PRAGMA user_version={}; {}{}{}{} COMMIT",
          kJournalApplication, kJournalVersion, kJournalTables, kLastRunTable, kValueTables,
          kScalingTables)
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
  Statement row(database_.get(), version_ < kFirstVersionWithValues
                                     ? "SELECT ended, lost, 0 FROM last_run"
                                     : "SELECT ended, lost, written FROM last_run");
  const int result = row.step();
  if (result == SQLITE_ROW) {
    last_run_ = {row.number(0) != 0, loaded(row.number(1)), Instant(Duration(row.number(2)))};
  }
  return result == SQLITE_ROW || result == SQLITE_DONE ? SQLITE_OK : result;
}

int Journal::mark(const LastRun& run) {
  return database_.execute(fmt::format("INSERT OR REPLACE INTO last_run VALUES(1, {}, {}, {})",
                                       run.ended ? 1 : 0, stored(run.lost),
                                       run.written.time_since_epoch().count())
                               .c_str());
}

// The database first: without its log it would be a sound journal with limits of the past, from
// which numbers would repeat.
int Journal::set_file_aside() {
  close();
  checked_ = false;
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

int Journal::store(const JournalBatch& batch, Instant utc) {
  LINEGATE_ASSERT(batch.entries.size() <= kMostEntries && batch.values.size() <= kMostValues,
                  "the free pages suffice for the entries and values");
  if (!is_open()) {
    return SQLITE_CANTOPEN;
  }
  int error = database_.execute("BEGIN IMMEDIATE");
  error = error == SQLITE_OK ? write(batch, utc) : error;
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
  if (batch.stream != stream_) {
    limits_.clear();
  }
  stream_ = batch.stream;
  for (const NumberLimit& one : batch.limits) {
    limits_[one.line] = one.limit;
  }
  return SQLITE_OK;
}

// A file of an earlier version gets its further tables here, so that it can be opened on a full
// disk.
int Journal::write(const JournalBatch& batch, Instant utc) {
  int error = SQLITE_OK;
  if (version_ < kJournalVersion) {
    error = database_.execute(fmt::format("{}{}{} PRAGMA user_version={}",
                                          version_ < 2 ? kLastRunTable : "",
                                          version_ < kFirstVersionWithValues ? kValueTables : "",
                                          kScalingTables, kJournalVersion)
                                  .c_str());
    statements_ = std::make_unique<Statements>(database_.get());
  }
  error = error == SQLITE_OK ? trim(utc) : error;
  if (error == SQLITE_OK && !last_run_read_) {
    error = end_values(last_run_.written);
  }
  for (auto entry = batch.entries.begin(); error == SQLITE_OK && entry != batch.entries.end();
       ++entry) {
    error = insert(*entry);
  }
  for (auto value = batch.values.begin(); error == SQLITE_OK && value != batch.values.end();
       ++value) {
    error = insert(*value);
  }
  if (error == SQLITE_OK && batch.lost_at_end) {
    error = end_values(utc);
  }
  error = error == SQLITE_OK ? write_numbers(batch) : error;
  return error == SQLITE_OK
             ? mark({batch.lost_at_end.has_value(), batch.lost_at_end.value_or(0), utc})
             : error;
}

int Journal::write_numbers(const JournalBatch& batch) {
  int error = SQLITE_OK;
  if (batch.stream != stream_) {
    statements_->stream.bind(1, stored(batch.stream));
    error = statements_->stream.run();
    error = error == SQLITE_OK ? database_.execute("DELETE FROM lines") : error;
  }
  for (auto one = batch.limits.begin(); error == SQLITE_OK && one != batch.limits.end(); ++one) {
    statements_->limit.bind(1, std::string_view(one->line));
    statements_->limit.bind(2, stored(one->limit));
    error = statements_->limit.run();
  }
  return error;
}

int Journal::number_of(const ValueEntry& entry, std::int64_t& number) {
  if (const auto known = value_entries_.find(entry); known != value_entries_.end()) {
    number = known->second;
    return SQLITE_OK;
  }
  int error = SQLITE_OK;
  for (const char* const text :
       {"INSERT OR IGNORE INTO value_entries(line, direction, node, name) VALUES(?1, ?2, ?3, ?4)",
        "SELECT id FROM value_entries WHERE line = ?1 AND direction = ?2 AND node = ?3 AND "
        "name = ?4"}) {
    Statement statement(database_.get(), text);
    statement.bind(1, std::string_view(entry.line));
    statement.bind(2, static_cast<std::int64_t>(entry.direction));
    statement.bind(3, std::int64_t{entry.node});
    statement.bind(4, std::string_view(entry.name));
    const int result = statement.step();
    error = result == SQLITE_ROW || result == SQLITE_DONE ? error : result;
    number = result == SQLITE_ROW ? statement.number(0) : 0;
  }
  if (error == SQLITE_OK) {
    value_entries_.emplace(entry, number);
  }
  return error;
}

int Journal::number_of(const od::Scaling& scaling, std::int64_t& number) {
  const std::tuple key{scaling.unit, scaling.scale, scaling.offset};
  if (const auto known = scalings_.find(key); known != scalings_.end()) {
    number = known->second;
    return SQLITE_OK;
  }
  int error = SQLITE_OK;
  for (const char* const text :
       {"INSERT OR IGNORE INTO value_scalings(unit, scale, offset) VALUES(?1, ?2, ?3)",
        "SELECT id FROM value_scalings WHERE unit = ?1 AND scale = ?2 AND offset = ?3"}) {
    Statement statement(database_.get(), text);
    statement.bind(1, std::string_view(scaling.unit));
    statement.bind(2, scaling.scale);
    statement.bind(3, scaling.offset);
    const int result = statement.step();
    error = result == SQLITE_ROW || result == SQLITE_DONE ? error : result;
    number = result == SQLITE_ROW ? statement.number(0) : 0;
  }
  if (error == SQLITE_OK) {
    scalings_.emplace(key, number);
  }
  return error;
}

int Journal::insert(const StoredValue& value) {
  std::int64_t number = 0;
  std::int64_t scaling = 0;
  int error = number_of(*value.entry, number);
  if (error == SQLITE_OK && value.scaling) {
    error = number_of(*value.scaling, scaling);
  }
  return error == SQLITE_OK ? insert(number, scaling, value) : error;
}

int Journal::insert(std::int64_t entry, std::int64_t scaling, const StoredValue& value) {
  Statement& to = statements_->insert_value;
  to.bind(1, entry);
  to.bind(7, scaling);
  to.bind(2, value.time.time_since_epoch().count());
  to.bind(3, static_cast<std::int64_t>(value.clock));
  to.bind(4, static_cast<std::int64_t>(value.type));
  to.bind(5, std::int64_t{value.bits});
  if (value.value) {
    to.bind(6, stored(*value.value));
  } else {
    to.bind_null(6);
  }
  const int error = to.run();
  value_rows_ = value_rows_.value_or(0) + (error == SQLITE_OK ? 1 : 0);
  statements_->set_newest.bind(1, entry);
  return error == SQLITE_OK ? statements_->set_newest.run() : error;
}

// No value holds while no gateway reads it. The time of its clock is not known.
int Journal::end_values(Instant utc) {
  struct End {
    std::int64_t entry = 0;
    std::int64_t scaling = 0;
    StoredValue value;
  };
  std::vector<End> valid;
  Statement rows(database_.get(),
                 "SELECT e.id, max(v.time, ?1), v.type, v.bits, v.scaling FROM value_entries e "
                 "JOIN value_rows v ON v.id = e.newest WHERE v.value IS NOT NULL");
  rows.bind(1, utc.time_since_epoch().count());
  int result = SQLITE_OK;
  while ((result = rows.step()) == SQLITE_ROW) {
    valid.push_back({rows.number(0), rows.number(4),
                     StoredValue{.entry = {},
                                 .time = Instant(Duration(rows.number(1))),
                                 .clock = ClockQuality::unknown,
                                 .type = static_cast<od::DataType>(rows.number(2)),
                                 .bits = static_cast<std::uint16_t>(rows.number(3)),
                                 .value = {}}});
  }
  int error = result == SQLITE_DONE ? SQLITE_OK : result;
  for (auto one = valid.begin(); error == SQLITE_OK && one != valid.end(); ++one) {
    error = insert(one->entry, one->scaling, one->value);
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

// Values do not use the room of entries.
bool Journal::is_nearly_full(int& error) {
  const auto pages = database_.number("PRAGMA page_count", error);
  const auto unused =
      error == SQLITE_OK ? database_.number("PRAGMA freelist_count", error) : std::nullopt;
  const std::int64_t most = static_cast<std::int64_t>(plan_.max_size) / kPageBytes;
  const std::int64_t of_values = value_rows_.value_or(0) * kValueRowBytes / kPageBytes;
  return error == SQLITE_OK &&
         *pages - *unused - of_values + std::max(kSparePages, most / 50) > most;
}

// Executes a statement that removes rows of values.
int Journal::remove_values(Statement& statement) {
  const int error = statement.run();
  if (error == SQLITE_OK) {
    value_rows_ = value_rows_.value_or(0) - sqlite3_changes(database_.get());
  }
  return error;
}

// The newest value of an entry is not removed as long as it holds. An entry whose last value has
// ended, and is older than all others, is removed with it.
int Journal::trim_values() {
  if (version_ < kFirstVersionWithValues) {
    value_rows_ = 0;  // write() has made the table
    return SQLITE_OK;
  }
  int error = SQLITE_OK;
  if (!value_rows_) {
    value_rows_ = database_.number("SELECT count(*) FROM value_rows", error);
  }
  const auto entries = error == SQLITE_OK
                           ? database_.number("SELECT count(*) FROM value_entries", error)
                           : std::nullopt;
  if (error != SQLITE_OK) {
    return error;
  }
  const int result = statements_->oldest_value.step();
  const std::int64_t oldest = result == SQLITE_ROW ? statements_->oldest_value.number(0) : 0;
  statements_->oldest_value.reset();
  if (result != SQLITE_ROW) {
    return result == SQLITE_DONE ? SQLITE_OK : result;
  }
  const std::int64_t most = static_cast<std::int64_t>(plan_.values_size) / kValueRowBytes;
  statements_->remove_ended_values.bind(1, oldest);
  error = remove_values(statements_->remove_ended_values);
  statements_->remove_entries.bind(1, oldest);
  error = error == SQLITE_OK ? statements_->remove_entries.run() : error;
  if (error == SQLITE_OK && sqlite3_changes(database_.get()) > 0) {
    value_entries_.clear();
  }
  // All entries may end in one transaction
  if (error == SQLITE_OK &&
      *value_rows_ + static_cast<std::int64_t>(kMostValues) + *entries > most) {
    statements_->remove_values.bind(1, kRemovedAtOnce + *entries);
    error = remove_values(statements_->remove_values);
  }
  return error;
}

// By age: of the oldest stored entries, because the clock may have been wrong when an entry was
// made.
int Journal::trim(Instant utc) {
  int error = trim_values();
  if (plan_.max_age > Duration::zero()) {
    for (Statement* const remove : {&statements_->remove_aged, &statements_->remove_aged_values}) {
      remove->bind(1, (utc - plan_.max_age).time_since_epoch().count());
      remove->bind(2, kRemovedAtOnce);
    }
    error = error == SQLITE_OK ? statements_->remove_aged.run() : error;
    error = error == SQLITE_OK ? remove_values(statements_->remove_aged_values) : error;
  }
  if (error == SQLITE_OK && is_nearly_full(error)) {
    statements_->remove_oldest.bind(1, kRemovedAtOnce);
    error = statements_->remove_oldest.run();
  }
  return error;
}

}  // namespace linegate::gateway

// SPDX-License-Identifier: Apache-2.0
// The file of the journal: the events of all lines of a gateway, bounded by size and age.
//
// Calls block on the disk; one thread at a time. The invariants are in README.md.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <tuple>
#include <vector>

#include "gateway/config/plant.h"
#include "gateway/exchange/cell.h"
#include "gateway/journal/database.h"
#include "gateway/journal/entry.h"
#include "gateway/journal/file_identity.h"
#include "gateway/journal/stored_value.h"
#include "stack/base/time.h"

namespace linegate::gateway {

// The event numbers that a line may use: those up to `limit`, from now on also after a restart.
struct NumberLimit {
  std::string line;  // empty: the gateway itself
  std::uint64_t limit = 0;
};

// What one transaction stores.
struct JournalBatch {
  std::span<const JournalEntry> entries{};  // up to Journal::kMostEntries
  std::span<const StoredValue> values{};    // up to Journal::kMostValues
  std::uint64_t stream = 0;                 // of later numbers
  std::span<const NumberLimit> limits{};    // of all lines if the stream is another one
  // The run ends with this transaction, and so many of its entries are missing. Nothing: the file
  // says that the run has not ended.
  std::optional<std::uint64_t> lost_at_end{};
};

// How the run of the gateway that wrote the file last ended.
struct LastRun {
  bool ended = true;       // in order; also of a file that does not say it
  std::uint64_t lost = 0;  // its entries that are missing, and that no event reported
  Instant written{};       // UTC: of its last transaction

  friend bool operator==(const LastRun&, const LastRun&) = default;
};

class Journal {
 public:
  explicit Journal(config::Journal plan);
  ~Journal();
  Journal(const Journal&) = delete;
  Journal& operator=(const Journal&) = delete;

  // Opens or creates the file, and checks it. A file that is no sound journal of this version is
  // renamed to unusable_file(), replacing an earlier one, and a new one is created. So is a file in
  // which store() found damage. The contents are read and checked until that succeeds once: later
  // calls, after a disk that was full or busy, check the header only. Returns 0 or the result code
  // of SQLite; SQLITE_BUSY: another process writes this journal; SQLITE_INTERRUPT: interrupt().
  int open();
  bool is_open() const { return database_.is_open(); }
  // Writes the log of SQLite into the file.
  void close();
  // Whether the path has no file, or another one, since open(): what is stored is lost with it.
  bool is_moved() const;
  // Whether a file beside it was removed or replaced since open(): the log of SQLite, which would
  // be lost with all that is not yet in the file; its shared memory; the lock.
  bool is_beside_removed() const;
  // Closes a file whose is_beside_removed(), after it has all that was stored. The next open()
  // makes what is missing. False: a reader uses the log, the file stays open; call it again.
  bool renew();
  // Closes a file that is_moved(), with all that was stored, and its lock. The next open() opens or
  // creates the file at the path, and checks it; the next store() ends the values of its last run.
  void leave();

  // --- after open() ---

  // The stream of the event numbers; 0 in a new file.
  std::uint64_t stream() const { return stream_; }
  // The result code for which the previous file was renamed; 0 = it was not, or the new file
  // stored since.
  int set_aside() const { return set_aside_; }
  // The highest number that each line may have used.
  const std::map<std::string, std::uint64_t, std::less<>>& limits() const { return limits_; }
  // Of the run before the first store() of this object.
  const LastRun& last_run() const { return last_run_; }
  std::string unusable_file() const;

  // Stores all of this, or nothing, and waits for the disk; entries that are stored already are
  // skipped. Removes the oldest entries beyond max_size, the oldest values beyond values_size, and
  // both beyond max_age; but not the newest value of an entry while it holds. The first call ends
  // the values of the last run at the time of its last transaction, and the last call those of this
  // run. utc: the present time. Returns 0 or the result code of SQLite; the journal is then closed.
  static constexpr std::size_t kMostEntries = 256;
  static constexpr std::size_t kMostValues = 256;
  int store(const JournalBatch& batch, Instant utc);

  // Ends the calls in progress and later ones with SQLITE_INTERRUPT, at their next statement or
  // after some steps of it. A call that waits for the disk does not return earlier. Any thread.
  void interrupt() { interrupted_.raise(); }

 private:
  struct Statements;

  int open_file();
  int check();
  int create();
  int read_numbers();
  int set_file_aside();
  int move_log_aside();
  int lock();
  int write(const JournalBatch& batch, Instant utc);
  int write_numbers(const JournalBatch& batch);
  int read_last_run();
  int mark(const LastRun& run);
  int insert(const StoredValue& value);
  int insert(std::int64_t entry, std::int64_t scaling, const StoredValue& value);
  int number_of(const ValueEntry& entry, std::int64_t& number);
  int number_of(const od::Scaling& scaling, std::int64_t& number);
  int end_values(Instant utc);
  int remove_values(Statement& statement);
  int trim_values();
  int insert(const JournalEntry& entry);
  int trim(Instant utc);
  bool is_nearly_full(int& error);

  const config::Journal plan_;
  Database database_;
  std::unique_ptr<Statements> statements_;
  std::uint64_t stream_ = 0;
  std::map<std::string, std::uint64_t, std::less<>> limits_;
  int version_ = 0;             // of the tables
  bool last_run_read_ = false;  // a later open() reads the mark of this run
  LastRun last_run_;
  std::map<ValueEntry, std::int64_t> value_entries_;  // their number in the file
  std::map<std::tuple<std::string, double, double>, std::int64_t> scalings_;  // likewise
  std::optional<std::int64_t> value_rows_;  // stored ones; nothing: not counted since open()
  int set_aside_ = 0;
  int unusable_ = 0;      // result code of a store() that found damage
  bool checked_ = false;  // the contents of the file
  int lock_ = -1;         // descriptor
  FileIdentity log_;      // of SQLite, since open()
  FileIdentity shared_memory_;
  exchange::Flag interrupted_;
};

}  // namespace linegate::gateway

// SPDX-License-Identifier: Apache-2.0
// The thread that writes the journal, so that neither a line nor the publisher waits for the disk,
// and the event numbers that continue after a restart.
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "gateway/exchange/cell.h"
#include "gateway/exchange/ring.h"
#include "gateway/exchange/wakeup.h"
#include "gateway/journal/journal.h"
#include "gateway/runtime/clock.h"
#include "stack/base/events.h"

namespace linegate::gateway {

// The event numbers of a line, between the publisher and the journal.
struct NumberedLine {
  std::string name;          // empty: the gateway itself
  std::uint64_t before = 0;  // the highest number that an earlier run may have used
  exchange::Counter used;    // by the publisher: the highest number in use
  exchange::Counter limit;   // by the journal: a later run begins above this number
  bool beyond = false;       // by the publisher: the last number was above the limit
};

class JournalThread {
 public:
  static constexpr auto kLongestWait = std::chrono::seconds(1);
  // The check of a file is interrupted after that time, and the thread is given up after the
  // double, so that the last samples of DDS are still sent (limit_end(), 4.5 s).
  static constexpr auto kLongestStop = std::chrono::seconds(1);

  struct Options {
    config::Journal plan;
    std::uint64_t incarnation = 1;                     // of the entries; the first stream
    Duration period = std::chrono::milliseconds(500);  // between two commits, at most
    Duration retry_period = std::chrono::seconds(1);   // while the journal fails
    std::size_t queued = 8192;                         // entries that wait for the disk, at most
    std::size_t queued_values = 8192;                  // the same of values
    std::uint64_t reserved = 16'384;                   // numbers of a line that are set aside
  };

  // Opens the journal in the thread, and waits for it: at most kLongestWait, after which the
  // incarnation is the stream, and the file takes it when it is open. A journal that cannot be
  // opened is tried again.
  explicit JournalThread(Options options);
  // Waits for the thread without limit.
  ~JournalThread();
  JournalThread(const JournalThread&) = delete;
  JournalThread& operator=(const JournalThread&) = delete;

  // --- main ---

  // Call it while the publisher is stopped, at most once for each name; then start(). The line
  // exists as long as this object.
  NumberedLine& add_line(const std::string& name);
  // Starts the thread unless it runs. Waits until numbers are reserved for all lines, at most
  // kLongestWait, and not while the journal fails: a disk stops nothing.
  void start();
  // Stores what is queued, the numbers in use, and that the run ended, if the disk permits. Call it
  // when the publisher has stopped, and after the last pop_news() whose result becomes an event:
  // the next run reports the losses that no pop_news() returned. False: the thread still waits for
  // the disk after kLongestStop. This object must then exist until the process ends.
  bool stop();
  // After a stop() that returned true: entries that are not stored, and not in news either.
  std::uint64_t lost_at_stop() const;
  // Conditions that the journal entered, oldest first. For one thread only. The result codes
  // SQLITE_NOTICE (events of the previous run are missing) and SQLITE_NOTICE_RECOVER_WAL (it did
  // not end in order) are those of the previous run.
  std::optional<event::JournalState> pop_news();
  // In words, at most 256 bytes.
  std::string describe(const event::JournalState& news) const;

  // --- publisher ---

  // The stream of the next event number. Changes if record() was called with a number above the
  // limit: the disk failed for so long that a later run might use the number again.
  std::uint64_t stream() const { return stream_; }
  // Prepares for an event of the line with that number: call it before stream().
  void use_number(NumberedLine& line, std::uint64_t number);
  // Queues the entry with stream() and the incarnation. If the queue is full it is dropped and
  // counted. The entry becomes that of an earlier call, for the memory of its members.
  void record(JournalEntry& entry);
  // Queues a value of the value history. False: the queue is full.
  bool record(StoredValue value);
  // How many files replaced a damaged one, or one that was removed or replaced while the gateway
  // runs: such a file has none of the values stored before.
  std::uint64_t replaced_files() const { return replaced_files_.value(); }

 private:
  // Of the first open(): its result counts if it comes before the thread that waits gives up.
  enum class Opening : std::uint8_t { waiting, done, given_up };

  Opening opening() const;
  // Ends the waiting. False: the other thread did before.
  bool end_opening(Opening with);
  void launch();
  bool await_end();
  void read_numbers();
  void run();
  void work(bool last);
  void pop_lines();
  bool open(Instant now);
  bool leave_moved_file();
  void pop_entries();
  void pop_values();
  std::vector<NumberLimit> limits(bool all) const;
  std::vector<NumberLimit> final_limits() const;
  bool store(const std::vector<NumberLimit>& limits,
             std::optional<std::uint64_t> lost_at_end = std::nullopt);
  void report_last_run();
  void failed(int error, Instant now);
  void report(event::JournalCondition condition, int error);

  const Options options_;
  exchange::Wakeup wakeup_;
  exchange::Flag stop_;
  std::vector<std::unique_ptr<NumberedLine>> lines_;  // main
  exchange::Ring<NumberedLine*> new_lines_{2048};     // main to journal
  exchange::Ring<event::JournalState> news_{64};      // journal to main
  exchange::Ring<JournalEntry> entries_;              // publisher to journal
  exchange::Ring<StoredValue> values_;                // publisher to journal
  exchange::Counter dropped_;                         // by the publisher
  exchange::Counter announced_;                       // by main: lost entries in pop_news()
  exchange::Counter replaced_files_;                  // by the journal
  exchange::Flag ended_;                              // by the journal: run() has ended
  exchange::Flag failing_shown_;                      // no reason to wait for the disk
  mutable std::mutex opening_mutex_;
  Opening opening_ = Opening::waiting;  // guarded by opening_mutex_
  std::uint64_t stream_;                // publisher
  std::size_t since_signal_ = 0;        // publisher: entries
  std::uint64_t recorded_ = 0;          // publisher: entries that were queued

  // From here on used by the journal, and by main while the thread does not run.
  Journal journal_;
  std::map<std::string, std::uint64_t, std::less<>> earlier_;  // of earlier runs; constant if done
  std::vector<NumberedLine*> known_;
  std::vector<JournalEntry> batch_;  // not stored yet; its first batch_size_ are used
  std::size_t batch_size_ = 0;
  std::vector<StoredValue> value_batch_;  // not stored yet
  std::uint64_t taken_ = 0;               // entries of the queue
  std::uint64_t first_stream_;            // of the file, or the incarnation
  std::uint64_t stream_stored_ = 0;       // of the newest entry
  std::uint64_t dropped_seen_ = 0;
  bool failing_ = false;
  bool renewed_ = false;  // files beside it; until it is open again
  bool moved_ = false;    // the file was removed or replaced; until the next one stores
  bool opening_seen_ = false;
  bool last_run_reported_ = false;
  Instant again_{};
  Instant trim_due_{};
  WallClock clock_;
  std::thread thread_;
};

}  // namespace linegate::gateway

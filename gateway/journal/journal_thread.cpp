// SPDX-License-Identifier: Apache-2.0
#include "gateway/journal/journal_thread.h"

#include <algorithm>
#include <limits>
#include <random>
#include <utility>

#include <fmt/format.h>
#include <poll.h>
#include <pthread.h>
#include <sqlite3.h>

#include "gateway/runtime/clock.h"

namespace linegate::gateway {
namespace {

constexpr Duration kTrimPeriod = std::chrono::minutes(1);
// Transactions before the thread does its other work again, while more and more is queued.
constexpr unsigned kMostRounds = 64;

std::uint64_t random_stream() {
  std::random_device device;
  std::uint64_t value = 0;
  while (value == 0) {
    value = std::uint64_t{device()} << 32U | device();
  }
  return value;
}

std::uint32_t in_32_bits(std::uint64_t number) {
  return static_cast<std::uint32_t>(
      std::min<std::uint64_t>(number, std::numeric_limits<std::uint32_t>::max()));
}

// Waits for the condition until that time. Returns the condition.
template <typename Condition>
bool await(Instant until, const Condition& condition) {
  while (!condition()) {
    if (monotonic_now() >= until) {
      return false;
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  return true;
}

// Codes that SQLite itself only logs, for a file that an earlier process did not close.
bool is_of_last_run(const event::JournalState& news) {
  return (news.error & 0xFFU) == SQLITE_NOTICE;
}

void raise(exchange::Counter& counter, std::uint64_t to) {
  if (to > counter.value()) {
    counter.add(to - counter.value());
  }
}

}  // namespace

JournalThread::JournalThread(Options options)
    : options_(std::move(options)),
      entries_(options_.queued),
      values_(options_.queued_values),
      stream_(options_.incarnation),
      journal_(options_.plan),
      batch_(Journal::kMostEntries),
      first_stream_(options_.incarnation) {
  trim_due_ = monotonic_now() + kTrimPeriod;
  stream_stored_ = stream_;
  launch();
  const Instant until = monotonic_now() + kLongestWait;
  if (!await(until, [&] { return opening() != Opening::waiting; }) &&
      end_opening(Opening::given_up)) {
    failing_shown_.raise();
    return;
  }
  stream_ = first_stream_;
}

JournalThread::~JournalThread() {
  if (!stop()) {
    thread_.join();
  }
}

JournalThread::Opening JournalThread::opening() const {
  const std::lock_guard lock(opening_mutex_);
  return opening_;
}

bool JournalThread::end_opening(Opening with) {
  const std::lock_guard lock(opening_mutex_);
  if (opening_ != Opening::waiting) {
    return false;
  }
  opening_ = with;
  return true;
}

void JournalThread::launch() {
  stop_.lower();
  ended_.lower();
  thread_ = std::thread([this] { run(); });
}

NumberedLine& JournalThread::add_line(const std::string& name) {
  NumberedLine& line = *lines_.emplace_back(std::make_unique<NumberedLine>());
  line.name = name;
  if (opening() == Opening::done) {
    const auto there = earlier_.find(name);
    line.before = there == earlier_.end() ? 0 : there->second;
  }
  line.used.add(line.before);
  line.limit.add(line.before);
  NumberedLine* pointer = &line;
  (void)new_lines_.push(pointer);  // beyond its places, numbers of the line end the stream
  return line;
}

void JournalThread::start() {
  if (!thread_.joinable()) {
    launch();
  }
  wakeup_.signal();
  const auto is_reserved = [](const auto& line) { return line->limit.value() > line->before; };
  const bool ready = await(monotonic_now() + kLongestWait, [&] {
    return failing_shown_.raised() || std::ranges::all_of(lines_, is_reserved);
  });
  if (!ready) {
    failing_shown_.raise();
  }
}

bool JournalThread::stop() {
  if (!thread_.joinable()) {
    return true;
  }
  stop_.raise();
  wakeup_.signal();
  if (!await_end()) {
    journal_.interrupt();
    if (!await_end()) {
      return false;
    }
  }
  thread_.join();
  return true;
}

bool JournalThread::await_end() {
  return await(monotonic_now() + kLongestStop, [&] { return ended_.raised(); });
}

std::uint64_t JournalThread::lost_at_stop() const {
  return batch_size_ + recorded_ - taken_ + dropped_.value() - dropped_seen_;
}

std::optional<event::JournalState> JournalThread::pop_news() {
  event::JournalState news;
  if (!news_.pop(news)) {
    return std::nullopt;
  }
  if (!is_of_last_run(news)) {
    announced_.add(news.lost);
  }
  return news;
}

std::string JournalThread::describe(const event::JournalState& news) const {
  const std::string lost = news.lost == 0
                               ? ""
                               : fmt::format("; {} events{} are missing in it", news.lost,
                                             is_of_last_run(news) ? " of the last run" : "");
  std::string what;
  switch (news.condition) {
    case event::JournalCondition::working:
      what = news.error != SQLITE_NOTICE_RECOVER_WAL
                 ? news.error == SQLITE_READONLY_DBMOVED
                       ? "stores events; files beside it were removed or replaced while the "
                         "gateway runs, and were made again"
                       : "stores events"
                 : "stores events; the last run did not end in order: its events of the last "
                   "second, or since the disk failed, may be missing";
      break;
    case event::JournalCondition::failing:
      what = fmt::format("cannot store events: {} (SQLite result code {})",
                         error_text(static_cast<int>(news.error)), news.error);
      break;
    case event::JournalCondition::renewed:
      what = news.error == 0 ? "begins a new stream of event numbers"
             : news.error == SQLITE_READONLY_DBMOVED
                 ? "was removed or replaced while the gateway runs; events are stored in the file "
                   "that is there now"
                 : fmt::format(
                       "is new, the previous file was unusable ({}) and has the "
                       "suffix .unusable now",
                       error_text(static_cast<int>(news.error)));
      break;
  }
  // The end of a long path names the file
  constexpr std::size_t kLongestPath = 80;
  const std::string& path = options_.plan.file;
  const std::size_t from = path.size() - std::min(path.size(), kLongestPath);
  return fmt::format("journal {}{} {}{}", from == 0 ? "" : "...", path.substr(from), what, lost);
}

// A quarter of the reserved numbers is enough for the time that a commit takes.
void JournalThread::use_number(NumberedLine& line, std::uint64_t number) {
  raise(line.used, number);
  const std::uint64_t limit = line.limit.value();
  if (number > limit && !line.beyond) {
    stream_ = random_stream();
  }
  line.beyond = number > limit;
  if (number + options_.reserved / 4 > limit) {
    wakeup_.signal();
  }
}

void JournalThread::record(JournalEntry& entry) {
  entry.stream = stream_;
  entry.incarnation = options_.incarnation;
  if (entries_.push(entry)) {
    ++recorded_;
  } else {
    dropped_.add();
  }
  if (++since_signal_ >= entries_.capacity() / 4) {
    since_signal_ = 0;
    wakeup_.signal();
  }
}

bool JournalThread::record(StoredValue value) {
  const bool queued = values_.push(value);
  if (!queued) {
    wakeup_.signal();
  }
  return queued;
}

void JournalThread::run() {
  pthread_setname_np(pthread_self(), "journal");
  const auto period =
      std::chrono::duration_cast<std::chrono::milliseconds>(options_.period).count();
  for (;;) {
    wakeup_.clear();
    const bool last = stop_.raised();
    work(last);
    if (last) {
      journal_.close();
      ended_.raise();
      return;
    }
    pollfd waiting{wakeup_.descriptor(), POLLIN, 0};
    poll(&waiting, 1, static_cast<int>(period));
  }
}

void JournalThread::work(bool last) {
  const Instant now = monotonic_now();
  clock_.refresh();
  pop_lines();
  const bool beside_removed = journal_.is_beside_removed();  // perhaps after the file itself
  if (!leave_moved_file() && beside_removed) {
    renewed_ = journal_.renew() || renewed_;
  }
  if (!journal_.is_open() && ((now < again_ && !last) || !open(now))) {
    return;
  }
  for (unsigned round = 0;; ++round) {
    if (round == kMostRounds && !last) {
      wakeup_.signal();
      break;
    }
    pop_entries();
    pop_values();
    const auto due = limits(moved_ || stream_stored_ != journal_.stream());
    if (batch_size_ == 0 && value_batch_.empty() && due.empty() && now < trim_due_) {
      break;
    }
    trim_due_ = now + kTrimPeriod;
    if (!store(due) && (monotonic_now() < again_ || !open(now))) {
      return;
    }
  }
  if (const std::uint64_t dropped = dropped_.value(); failing_ || dropped != dropped_seen_) {
    failing_ = false;
    report(event::JournalCondition::working, 0);
  }
  if (std::exchange(renewed_, false)) {
    report(event::JournalCondition::working, SQLITE_READONLY_DBMOVED);
  }
  if (last) {
    (void)store(final_limits(), dropped_.value() - announced_.value());
  }
}

void JournalThread::pop_lines() {
  for (NumberedLine* line = nullptr; new_lines_.pop(line);) {
    known_.push_back(line);
  }
}

bool JournalThread::leave_moved_file() {
  if (!journal_.is_moved()) {
    return false;
  }
  journal_.leave();
  moved_ = true;
  return true;
}

bool JournalThread::open(Instant now) {
  if (const int error = journal_.open(); error != SQLITE_OK) {
    failed(error, now);
    read_numbers();
    return false;
  }
  read_numbers();
  return true;
}

// Of the first open(): later ones continue the numbers in memory.
void JournalThread::read_numbers() {
  if (opening_seen_) {
    return;
  }
  opening_seen_ = true;
  if (journal_.is_open() && journal_.stream() != 0) {
    first_stream_ = journal_.stream();
    earlier_ = journal_.limits();
  }
  if (end_opening(Opening::done)) {
    stream_stored_ = first_stream_;
  } else {
    earlier_.clear();
  }
}

void JournalThread::pop_entries() {
  while (batch_size_ < batch_.size() && entries_.pop(batch_[batch_size_])) {
    stream_stored_ = batch_[batch_size_].stream;
    ++batch_size_;
    ++taken_;
  }
}

void JournalThread::pop_values() {
  for (StoredValue value; value_batch_.size() < Journal::kMostValues && values_.pop(value);) {
    value_batch_.push_back(std::move(value));
  }
}

std::vector<NumberLimit> JournalThread::limits(bool all) const {
  std::vector<NumberLimit> out;
  for (const NumberedLine* line : known_) {
    const std::uint64_t used = line->used.value();
    if (all || used + options_.reserved / 2 > line->limit.value()) {
      out.push_back({line->name, used + options_.reserved});
    }
  }
  // A file that replaces a damaged one has the numbers of lines that this run has not, too
  for (const auto& earlier : earlier_) {
    const auto is_it = [&](const NumberedLine* line) { return line->name == earlier.first; };
    if (all && !std::ranges::any_of(known_, is_it)) {
      out.push_back({earlier.first, earlier.second});
    }
  }
  return out;
}

std::vector<NumberLimit> JournalThread::final_limits() const {
  std::vector<NumberLimit> out;
  for (const NumberedLine* line : known_) {
    out.push_back({line->name, line->used.value()});
  }
  return out;
}

bool JournalThread::store(const std::vector<NumberLimit>& limits,
                          std::optional<std::uint64_t> lost_at_end) {
  const std::uint64_t before = journal_.stream();
  const int set_aside = journal_.set_aside();
  const Instant utc = monotonic_now() + clock_.map().offset;
  const int error = journal_.store({.entries = std::span(batch_).first(batch_size_),
                                    .values = value_batch_,
                                    .stream = stream_stored_,
                                    .limits = limits,
                                    .lost_at_end = lost_at_end},
                                   utc);
  if (error != SQLITE_OK) {
    failed(error, monotonic_now());
    return false;
  }
  if (leave_moved_file()) {
    return false;  // the file at the path does not have the batch
  }
  batch_size_ = 0;
  value_batch_.clear();
  failing_shown_.lower();
  const bool moved = std::exchange(moved_, false);
  if (moved || set_aside != 0) {
    replaced_files_.add();
  }
  if (moved || before != stream_stored_) {
    report(event::JournalCondition::renewed,
           moved && set_aside == 0 ? SQLITE_READONLY_DBMOVED : set_aside);
  }
  report_last_run();
  for (const NumberLimit& stored : limits) {
    const auto line = std::ranges::find(known_, stored.line, &NumberedLine::name);
    if (line != known_.end()) {
      raise((*line)->limit, stored.limit);
    }
  }
  return true;
}

// Once, after the first store(): the file then stores the event, too.
void JournalThread::report_last_run() {
  if (last_run_reported_) {
    return;
  }
  const LastRun& last = journal_.last_run();
  event::JournalState news{
      event::JournalCondition::working,
      static_cast<std::uint32_t>(last.ended ? SQLITE_NOTICE : SQLITE_NOTICE_RECOVER_WAL),
      in_32_bits(last.lost)};
  last_run_reported_ = (last.ended && last.lost == 0) || news_.push(news);
}

void JournalThread::failed(int error, Instant now) {
  again_ = now + options_.retry_period;
  failing_shown_.raise();
  if (!std::exchange(failing_, true)) {
    report(event::JournalCondition::failing, error);
  }
}

void JournalThread::report(event::JournalCondition condition, int error) {
  const std::uint64_t dropped = dropped_.value();
  event::JournalState news{condition, static_cast<std::uint32_t>(error), 0};
  news.lost = in_32_bits(dropped - dropped_seen_);
  if (news_.push(news)) {
    dropped_seen_ = dropped;
  }
}

}  // namespace linegate::gateway

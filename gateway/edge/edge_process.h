// SPDX-License-Identifier: Apache-2.0
// Starts a second process and replaces it whenever it ends or no longer responds; exchanges
// messages with it through shared memory.
//
// That process is not trusted: nothing that it does with the memory, its descriptors or its output
// blocks this process or accesses memory outside of the rings (exchange/byte_ring.h).
#pragma once

#include <array>
#include <csignal>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <span>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "gateway/exchange/bell.h"
#include "gateway/exchange/cell.h"
#include "gateway/exchange/shared_rings.h"
#include "gateway/exchange/wakeup.h"
#include "stack/base/diagnostic.h"
#include "stack/base/events.h"
#include "stack/base/time.h"

namespace linegate::gateway {

// When a process that ended is started again.
class RestartPauses {
 public:
  static constexpr Duration kFirst = std::chrono::milliseconds(250);
  static constexpr Duration kLongest = std::chrono::seconds(30);

  // stable: a process that ran for that long is replaced at once; otherwise pauses double.
  explicit RestartPauses(Duration stable) : stable_(stable) {}

  // Returns the pause after a process that ran for `ran`.
  Duration after(Duration ran);

 private:
  Duration stable_;
  Duration next_{};
};

// Whether a process makes progress, from counters that it increments.
//
// A process that hangs stops at once. One that lacks processors, as in a virtual machine whose host
// is overloaded, becomes slower before, and must not be replaced again and again: that would cost
// even more. So the limit grows with the intervals between its steps, and the time to start grows
// with each process that did not manage to.
class ProgressLimit {
 public:
  // From the start of the process to its first progress, and later from one to the next.
  static constexpr Duration kToStart = std::chrono::seconds(15);
  static constexpr Duration kToContinue = std::chrono::milliseconds(1'500);
  // The same for slow processes, at most.
  static constexpr Duration kLongestToStart = std::chrono::seconds(60);
  static constexpr Duration kLongestToContinue = std::chrono::seconds(10);
  // The limit is at least that many times the longest one of the last intervals.
  static constexpr int kMargin = 4;
  // Time between two calls beyond which this process itself was late, so that nothing follows.
  static constexpr Duration kOwnDelay = std::chrono::milliseconds(500);

  // Another process is started at that time. Call it before look().
  void begin(Instant start);

  // Returns false if one of the counters has not changed for too long. Call it several times a
  // second.
  bool look(std::span<const std::uint64_t> counters, Instant now);

 private:
  struct Seen {
    std::uint64_t value = 0;
    Duration unchanged{};
  };
  bool has_started() const;
  void note_interval(Duration interval);

  std::vector<Seen> seen_;  // of the present process
  Instant asked_{};
  Duration to_start_ = kToStart;
  Duration longest_interval_{};  // it decays
};

// Memory that the process receives by two descriptors.
class SharedWithProcess {
 public:
  virtual ~SharedWithProcess() = default;
  virtual std::array<int, 2> descriptors() const = 0;
  // The process has written to it what no working process writes. From any thread.
  virtual bool damaged() const = 0;
  // It is passed to another process.
  virtual void forget_damage() = 0;
};

class EdgeProcess {
 public:
  struct Options {
    std::string program;
    // The first one is the name that a list of processes shows. The process receives descriptors as
    // described in edge_end.h.
    std::vector<std::string> arguments;
    std::string name;  // in the log: "DDS"
    // A process that ran for that long is replaced at once.
    Duration stable = std::chrono::seconds(10);
    // A process that uses more is replaced; in octets, as MemorySize::resident. 0: not limited.
    std::size_t memory = 0;
    // Receives each end of the process, and each failed start. The words are those of the log
    // without their subject; the pause is before the next start. Called in the thread of this
    // object, after `log`.
    struct End {
      event::ProcessEnd cause{};
      std::uint32_t detail = 0;  // as event::DdsProcessEnded
      Duration pause{};
      std::string words;
    };
    std::function<void(End)> ended = [](const End&) {};
    // Receives each change of its condition; starting when the object is made. Called in the
    // thread of this object, the first time in that of the constructor.
    enum class Condition : std::uint8_t {
      starting,  // it runs, and has shown no progress yet
      working,
      hangs,  // it does not respond, and is being ended
      waits,  // it does not run
    };
    // start_due: of `waits`, when it is started.
    std::function<void(Condition, Instant start_due)> changed = [](Condition, Instant) {};
    // Wakes the process; any thread may ring it.
    std::shared_ptr<exchange::Bell> bell = std::make_shared<exchange::Bell>();
    // Receive reports of the end of the process, and the lines of its output, which may contain
    // anything. Called in the thread of this object.
    std::function<void(Severity, std::string_view text)> log;
    std::function<void(Severity, std::string_view text)> output;
  };

  // Starts the process. Throws std::system_error if the system refuses memory or descriptors.
  explicit EdgeProcess(Options options);
  ~EdgeProcess();
  EdgeProcess(const EdgeProcess&) = delete;
  EdgeProcess& operator=(const EdgeProcess&) = delete;

  // 1, 2, 3, ... for each start; 0: it does not run. From any thread, as all functions below.
  std::uint64_t number() const;
  // Never waits. Returns false if there is no room, or another process runs.
  bool send(std::uint64_t number, std::span<const std::byte> message);
  // Passes that memory to it, before a message about it. Never waits. Returns false if there is no
  // room, or another process runs.
  bool share(std::uint64_t number, std::uint64_t tag,
             const std::shared_ptr<SharedWithProcess>& memory);
  struct Positions {
    std::uint64_t sent = 0;
    std::uint64_t done = 0;
  };
  Positions positions(std::uint64_t number);
  // Returns the number of the process, or 0 without a message. From one thread at a time.
  std::uint64_t receive(std::vector<std::byte>& message);
  // Until a message may have arrived, a process was started, wake(), or the timeout. From one
  // thread at a time.
  void wait(Duration timeout);
  void wake() { wakeup_.signal(); }

  // Replaces that process. No more of its messages are received.
  void reject(std::uint64_t number, std::string_view reason);
  // That process was asked to end. When it has, or after kTimeToEnd, another one is started at
  // once.
  static constexpr Duration kTimeToEnd = std::chrono::seconds(3);
  void replace(std::uint64_t number, std::string_view reason);
  // Waits for the end of the process, which was asked to end, at most `limit`; then kills it. It is
  // not started again.
  void finish(Duration limit);

 private:
  struct Child;
  void run();
  bool start();
  void start_again(Instant now);
  void set_condition(Options::Condition condition);
  void note_end(const Child& child, const siginfo_t& end, Instant now);
  void look_at(Child& child, Instant now);
  bool has_ended(Child& child, Instant now);
  void report_end(const Child& child, const siginfo_t& end, Instant now);
  std::string reason_to_kill(Child& child, Instant now);
  std::string excess_of_memory(const Child& child) const;
  void read_output(Child& child, bool all);
  void report_line(std::string_view line) const;
  void note_wake(const Child& child);
  std::shared_ptr<Child> present() const;

  const Options options_;
  mutable std::mutex mutex_;  // held for a copy of one message at most
  std::shared_ptr<Child> child_;
  std::uint64_t started_ = 0;
  std::string rejected_;  // reason; empty: none
  std::string replaced_;  // the same; the process was asked to end
  Instant end_due_{};     // of that process
  int empty_wakes_ = 0;   // since the last message

  exchange::Wakeup wakeup_;      // of the thread in wait()
  exchange::Wakeup supervisor_;  // of thread_
  exchange::Flag finishing_;
  exchange::Flag kill_;
  RestartPauses pauses_;
  ProgressLimit progress_;
  Instant start_due_{};
  Options::Condition condition_ = Options::Condition::waits;
  std::thread thread_;
};

}  // namespace linegate::gateway

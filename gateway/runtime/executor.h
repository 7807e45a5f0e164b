// SPDX-License-Identifier: Apache-2.0
// A thread that runs one or more lines.
#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "gateway/config/plant.h"
#include "gateway/exchange/cell.h"
#include "gateway/exchange/ring.h"
#include "gateway/exchange/wakeup.h"
#include "gateway/runtime/deadline_timer.h"
#include "gateway/runtime/runner.h"

namespace linegate::gateway {

// Waits for the descriptors and times of its runners and serves those that are ready. It never
// waits for another thread, and its loop neither locks nor allocates.
class Executor {
 public:
  explicit Executor(config::ExecutorPlan plan);
  // Stops and joins unless that was done.
  ~Executor();
  Executor(const Executor&) = delete;
  Executor& operator=(const Executor&) = delete;

  // Call it before start(), or at run time from the one thread that called start(): present runners
  // continue meanwhile.
  void add(std::unique_ptr<Runner> runner);
  // At run time, from the same thread. Stops the runners in an orderly way and returns them when
  // all have stopped.
  std::vector<std::unique_ptr<Runner>> send_away(const std::vector<Runner*>& runners);
  // From the same thread: executes `work` on the executor's thread, between two rounds, and waits
  // for its end. Executes it directly while the executor does not run.
  void visit(const std::function<void()>& work);

  // Signal it after putting something into a ring that one of its runners reads.
  exchange::Wakeup& wakeup() { return wakeup_; }
  // Signal it after leaving values for Runner::has_values(): only the runners that have some are
  // served, and they do not check the rings of other threads.
  exchange::Wakeup& values_wakeup() { return values_wakeup_; }
  // Number of completed rounds, in each of which every runner had its turn.
  const exchange::Counter& rounds() const { return rounds_; }
  const std::string& name() const { return plan_.name; }

  // No effect if it runs already. Scheduling that is configured but not permitted by the system is
  // logged; the executor runs without it.
  void start();
  // Stops all runners in an orderly way; then the thread ends.
  void request_stop();
  void join();

 private:
  struct Registered {
    int descriptor = -1;
    bool writable = false;
  };
  // A place without a runner is free. Runners keep their places, because epoll identifies them by
  // place.
  struct Place {
    std::unique_ptr<Runner> runner;
    Registered registered;
    bool ready = true;
    bool readable = true;  // the descriptor, as far as known
    bool called = true;
    bool served = false;  // in this round
    bool leaving = false;
  };
  static constexpr std::size_t kMostChanges = 64;  // changes at the same time

  bool is_own_thread() const { return std::this_thread::get_id() == thread_.get_id(); }
  void run();
  void serve(std::size_t i, Instant now);
  void announce();
  void update_interest(std::size_t i);
  // Sets `ready` and `readable` of places whose descriptor is ready; `ready` and `called` of all if
  // the executor was woken; `ready` of those that have values of another line. now: the time of the
  // present round.
  void wait(Instant until, Instant now);
  void note_event(std::uint64_t what);
  bool all_stopped(Instant now) const;
  void place(std::unique_ptr<Runner> runner);
  void poll_changes(Instant now);
  void receive_visits();
  void let_go(Instant now);

  config::ExecutorPlan plan_;
  exchange::Ring<std::unique_ptr<Runner>> arrivals_{kMostChanges};
  exchange::Ring<Runner*> departures_{kMostChanges};
  exchange::Ring<std::unique_ptr<Runner>> departed_{kMostChanges};
  exchange::Wakeup someone_departed_;
  using Visit = const std::function<void()>*;
  exchange::Ring<Visit> visits_{2};  // one at a time
  exchange::Ring<Visit> visited_{2};
  exchange::Wakeup visit_over_;
  std::thread thread_;
  // The members that each round uses are adjacent, to occupy few cache lines.
  exchange::Flag stop_;
  exchange::Counter rounds_;
  std::vector<Place> places_;
  std::size_t leaving_ = 0;
  DeadlineTimer timer_;
  int epoll_ = -1;
  bool woken_ = true;
  alignas(exchange::kCacheLine) exchange::Wakeup wakeup_;  // written by other threads
  exchange::Wakeup values_wakeup_;
};

}  // namespace linegate::gateway

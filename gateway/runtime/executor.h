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

// Waits for the descriptors and times of its runners and serves those that are ready. Nothing it
// waits for belongs to another thread, and nothing in its loop locks or allocates.
class Executor {
 public:
  explicit Executor(config::ExecutorPlan plan);
  // Stops and joins if that was not done.
  ~Executor();
  Executor(const Executor&) = delete;
  Executor& operator=(const Executor&) = delete;

  // Before start(), or while it runs, from the one thread that started it: runners that are there
  // go on meanwhile.
  void add(std::unique_ptr<Runner> runner);
  // While it runs, from the same thread. Stops them in good order and gives them back; waits until
  // all have stopped.
  std::vector<std::unique_ptr<Runner>> send_away(const std::vector<Runner*>& runners);
  // From the same thread: does `work` on the executor's thread, between two rounds, and waits until
  // it is done. At once while it does not run.
  void visit(const std::function<void()>& work);

  // To be signalled after something was put into a ring one of its runners reads.
  exchange::Wakeup& wakeup() { return wakeup_; }
  // Times it went round: every runner had its turn.
  const exchange::Counter& rounds() const { return rounds_; }
  const std::string& name() const { return plan_.name; }

  // Nothing if it runs already. What scheduling the configuration wants and the system does not
  // permit is logged; the executor runs without it.
  void start();
  // All runners stop in good order; then the thread ends.
  void request_stop();
  void join();

 private:
  struct Registered {
    int descriptor = -1;
    bool writable = false;
  };
  // A place is free when it has no runner; the others keep theirs, by which epoll knows them.
  struct Place {
    std::unique_ptr<Runner> runner;
    Registered registered;
    bool ready = true;
    bool called = true;
    bool served = false;  // in this round
    bool leaving = false;
  };
  static constexpr std::size_t kMostChanges = 64;  // under way at a time

  bool is_own_thread() const { return std::this_thread::get_id() == thread_.get_id(); }
  void run();
  void serve(std::size_t i, Instant now);
  void announce();
  void update_interest(std::size_t i);
  // Sets ready of those whose descriptor is; ready and called of all if the executor was woken.
  void wait(Instant until);
  bool all_stopped(Instant now) const;
  void place(std::unique_ptr<Runner> runner);
  void take_changes(Instant now);
  void receive_visits();
  void let_go(Instant now);

  config::ExecutorPlan plan_;
  exchange::Wakeup wakeup_;
  exchange::Flag stop_;
  exchange::Counter rounds_;
  std::vector<Place> places_;
  exchange::Ring<std::unique_ptr<Runner>> arrivals_{kMostChanges};
  exchange::Ring<Runner*> departures_{kMostChanges};
  exchange::Ring<std::unique_ptr<Runner>> departed_{kMostChanges};
  exchange::Wakeup someone_departed_;
  using Visit = const std::function<void()>*;
  exchange::Ring<Visit> visits_{2};  // one at a time
  exchange::Ring<Visit> visited_{2};
  exchange::Wakeup visit_over_;
  bool woken_ = true;
  std::size_t leaving_ = 0;
  DeadlineTimer timer_;
  int epoll_ = -1;
  std::thread thread_;
};

}  // namespace linegate::gateway

// A thread that runs one or more lines.
#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "gateway/config/plant.h"
#include "gateway/exchange/cell.h"
#include "gateway/exchange/wakeup.h"
#include "gateway/runner.h"

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

  // Before start().
  void add(std::unique_ptr<Runner> runner);
  // To be signalled after something was put into a ring one of its runners reads.
  exchange::Wakeup& wakeup() { return wakeup_; }
  // Times it went round: every runner had its turn.
  const exchange::Counter& rounds() const { return rounds_; }
  const std::string& name() const { return plan_.name; }

  // What scheduling the configuration wants and the system does not permit is logged; the executor
  // runs without it.
  void start();
  // All runners stop in good order; then the thread ends.
  void request_stop();
  void join();

 private:
  struct Registered {
    int descriptor = -1;
    bool writable = false;
  };

  void run();
  void apply_scheduling();
  void serve(std::size_t i, Instant now);
  void update_interest(std::size_t i);
  // Sets ready_ of those whose descriptor is; all if the executor was woken.
  void wait(Instant until);
  bool all_stopped(Instant now) const;

  config::ExecutorPlan plan_;
  exchange::Wakeup wakeup_;
  exchange::Flag stop_;
  exchange::Counter rounds_;
  std::vector<std::unique_ptr<Runner>> runners_;
  std::vector<Registered> registered_;
  std::vector<char> ready_;
  int epoll_ = -1;
  std::thread thread_;
};

}  // namespace linegate::gateway

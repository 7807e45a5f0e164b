// SPDX-License-Identifier: Apache-2.0
// Lines, run like in the gateway, with the thread's CPU clock and a thread in the publisher's
// place.
#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <thread>

#include "gateway/config/plant.h"
#include "gateway/exchange/wakeup.h"
#include "gateway/runtime/line_port.h"
#include "gateway/runtime/line_runner.h"
#include "gateway/runtime/runner.h"
#include "stack/line/line.h"

#include "tests/bench/clock.h"
#include "tests/bench/wire.h"

namespace linegate::bench {

// Creates the line of a configuration, which must be valid.
std::unique_ptr<line::Line> make_line(const line::LineConfig& config);

// Runs that line on the far end of the wire.
std::unique_ptr<gateway::LineRunner> make_runner(std::unique_ptr<line::Line> line, const Wire& wire,
                                                 const config::LinePlan& plan,
                                                 gateway::LinePort& port, exchange::Wakeup& wakeup);

// Starts the clock of the executor's thread with the first service of the line.
class ClockedRunner final : public gateway::Runner {
 public:
  // serviced: called after each service; may be empty.
  ClockedRunner(std::unique_ptr<gateway::LineRunner> runner, ThreadClock& clock,
                std::function<void()> serviced = {});

  int descriptor() const override { return runner_->descriptor(); }
  bool wants_writable() const override { return runner_->wants_writable(); }
  void nothing_to_read() override { runner_->nothing_to_read(); }
  bool has_values() const override { return runner_->has_values(); }
  void called() override { runner_->called(); }
  void service(Instant now) override;
  exchange::Wakeup* announce() override { return runner_->announce(); }
  Instant next_wake() const override { return runner_->next_wake(); }
  void stop(Instant now) override { runner_->stop(now); }
  bool stopped(Instant now) const override { return runner_->stopped(now); }

 private:
  std::unique_ptr<gateway::LineRunner> runner_;
  ThreadClock& clock_;
  std::function<void()> serviced_;
  bool begun_ = false;
};

// Discards the events and the states of the nodes. Returns the newest status or nullptr; it is
// valid until the next call.
const gateway::LineStatus* discard_reports(gateway::LinePort& port);
void discard_images(gateway::LinePort& port);
bool manager_runs(const gateway::LineStatus& status);

// A thread in the publisher's place: calls `take` whenever the wake-up was signalled, from start()
// to stop().
class PublisherThread {
 public:
  explicit PublisherThread(std::function<void()> take) : take_(std::move(take)) {}
  ~PublisherThread() { stop(); }
  PublisherThread(const PublisherThread&) = delete;
  PublisherThread& operator=(const PublisherThread&) = delete;

  void start();
  void stop();

  exchange::Wakeup wakeup;

 private:
  void run();

  std::function<void()> take_;
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

}  // namespace linegate::bench

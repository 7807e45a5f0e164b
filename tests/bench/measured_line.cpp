// SPDX-License-Identifier: Apache-2.0
#include "tests/bench/measured_line.h"

#include <utility>

#include <poll.h>

#include "bridges/can/socketcan.h"

#include "tests/bench/measure.h"

namespace linegate::bench {

std::unique_ptr<line::Line> make_line(const line::LineConfig& config) {
  auto made = line::Line::make(config);
  require(made.ok(), "no line");
  return *std::move(made.value);
}

std::unique_ptr<gateway::LineRunner> make_runner(std::unique_ptr<line::Line> line, const Wire& wire,
                                                 const config::LinePlan& plan,
                                                 gateway::LinePort& port,
                                                 exchange::Wakeup& wakeup) {
  return std::make_unique<gateway::LineRunner>(
      std::move(line), can_bridge::open_on_descriptor(wire.far()), plan, port, wakeup);
}

ClockedRunner::ClockedRunner(std::unique_ptr<gateway::LineRunner> runner, ThreadClock& clock,
                             std::function<void()> serviced)
    : runner_(std::move(runner)), clock_(clock), serviced_(std::move(serviced)) {
}

void ClockedRunner::service(Instant now) {
  if (!std::exchange(begun_, true)) {
    clock_.begin();
  }
  runner_->service(now);
  if (serviced_) {
    serviced_();
  }
}

const gateway::LineStatus* discard_reports(gateway::LinePort& port) {
  for (Event event; port.events.pop(event);) {
  }
  for (gateway::NodeStatus node; port.nodes.pop(node);) {
  }
  return port.status.fetch();
}

void discard_images(gateway::LinePort& port) {
  for (const auto direction : {image::Direction::inputs, image::Direction::outputs}) {
    (void)port.image(direction).fetch();
  }
}

bool manager_runs(const gateway::LineStatus& status) {
  return status.state.manager == line::ManagerState::running;
}

void PublisherThread::start() {
  thread_ = std::thread([this] { run(); });
}

void PublisherThread::stop() {
  stop_ = true;
  wakeup.signal();
  if (thread_.joinable()) {
    thread_.join();
  }
}

void PublisherThread::run() {
  while (!stop_) {
    pollfd readable{wakeup.descriptor(), POLLIN, 0};
    poll(&readable, 1, -1);
    wakeup.clear();
    take_();
  }
}

}  // namespace linegate::bench

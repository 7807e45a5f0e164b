// SPDX-License-Identifier: Apache-2.0
// Two lines, run like in the gateway, that forward a PDO from one to the other.
#pragma once

#include <algorithm>
#include <array>
#include <memory>
#include <optional>
#include <vector>

#include "bridges/can/channel.h"
#include "gateway/config/plant.h"
#include "gateway/runtime/binder.h"
#include "gateway/runtime/executor.h"
#include "gateway/runtime/line_port.h"

#include "tests/bench/forwarding_course.h"
#include "tests/bench/measured_line.h"

namespace linegate::bench {

class ForwardingLines {
 public:
  // Frames enter on the first channel. together: both lines on one executor, else on one each.
  // processors: those of the executors; if empty, the scheduler chooses. publish: when images are
  // handed over; if empty, as configured by default.
  ForwardingLines(std::array<std::unique_ptr<can_bridge::Channel>, 2> channels, bool together,
                  std::array<std::optional<unsigned>, 2> processors = {},
                  std::optional<config::Publish> publish = {});
  ~ForwardingLines();
  ForwardingLines(const ForwardingLines&) = delete;
  ForwardingLines& operator=(const ForwardingLines&) = delete;

  std::size_t threads() const { return executors_.size(); }
  const ThreadClock& clock(std::size_t thread) const { return clocks_[thread]; }

 private:
  std::size_t thread_of(std::size_t line) const { return std::min(line, executors_.size() - 1); }
  void take();

  config::Plant plant_;
  gateway::BoundLink link_;
  std::array<gateway::LinePort, 2> ports_;
  std::array<ThreadClock, 2> clocks_;
  std::vector<std::unique_ptr<gateway::Executor>> executors_;
  PublisherThread publisher_;
};

}  // namespace linegate::bench

// SPDX-License-Identifier: Apache-2.0
#include "tests/bench/forwarding_lines.h"

#include <utility>

#include <poll.h>

#include "gateway/runtime/line_runner.h"

namespace linegate::bench {
namespace {

// Lines that obey another master, so that they need no boot.
constexpr const char* kPlant = R"(schema: 1
lines:
  - name: press
    interface: virtual:press
    nodes: [{id: 5, name: axis, eds: bridges/sim/eds/drive.eds}]
  - name: hall
    interface: virtual:hall
    nodes: [{id: 5, name: axis, eds: bridges/sim/eds/drive.eds}]
forward:
  - press.axis.6041:0 -> hall.axis.6040:0
  - press.axis.6061:0 -> hall.axis.6060:0
)";

class Clocked final : public gateway::Runner {
 public:
  Clocked(std::unique_ptr<gateway::LineRunner> runner, ThreadClock& clock)
      : runner_(std::move(runner)), clock_(clock) {}

  int descriptor() const override { return runner_->descriptor(); }
  bool wants_writable() const override { return runner_->wants_writable(); }
  void called() override { runner_->called(); }
  void service(Instant now) override {
    if (!std::exchange(begun_, true)) {
      clock_.begin();
    }
    runner_->service(now);
  }
  void announce() override { runner_->announce(); }
  Instant next_wake() const override { return runner_->next_wake(); }
  void stop(Instant now) override { runner_->stop(now); }
  bool stopped(Instant now) const override { return runner_->stopped(now); }

 private:
  std::unique_ptr<gateway::LineRunner> runner_;
  ThreadClock& clock_;
  bool begun_ = false;
};

}  // namespace

ForwardingLines::ForwardingLines(std::array<std::unique_ptr<can_bridge::Channel>, 2> channels,
                                 bool together, std::array<std::optional<unsigned>, 2> processors)
    : plant_(*config::read(kPlant, LINEGATE_SOURCE_DIR "/plant.yaml").value),
      link_(plant_.bindings),
      taker_([this] { take(); }) {
  for (std::size_t i = 0; i < (together ? 1U : 2U); ++i) {
    executors_.push_back(
        std::make_unique<gateway::Executor>(config::ExecutorPlan{.processor = processors[i]}));
  }
  std::array<std::unique_ptr<gateway::LineRunner>, 2> runners;
  for (std::size_t i = 0; i < 2; ++i) {
    config::LinePlan& plan = plant_.lines[i];
    plan.config.role = line::Role::device;
    runners[i] =
        std::make_unique<gateway::LineRunner>(*std::move(line::Line::make(plan.config).value),
                                              std::move(channels[i]), plan, ports_[i], wakeup_);
  }
  link_.runner = together ? runners[1].get() : nullptr;
  link_.taker = &executors_.back()->wakeup();
  runners[0]->bind({gateway::BoundSource(link_)}, {});
  runners[1]->bind({}, {gateway::BoundTarget(link_)});
  for (std::size_t i = 0; i < 2; ++i) {
    executors_[thread_of(i)]->add(
        std::make_unique<Clocked>(std::move(runners[i]), clocks_[thread_of(i)]));
  }
  for (const auto& one : executors_) {
    one->start();
  }
}

ForwardingLines::~ForwardingLines() {
  for (const auto& one : executors_) {
    one->request_stop();
    one->join();
  }
  stop_ = true;
  wakeup_.signal();
  taker_.join();
}

void ForwardingLines::take() {
  while (!stop_) {
    pollfd readable{wakeup_.descriptor(), POLLIN, 0};
    poll(&readable, 1, -1);
    wakeup_.clear();
    for (gateway::LinePort& port : ports_) {
      for (Event event; port.events.pop(event);) {
      }
      for (gateway::NodeStatus node; port.nodes.pop(node);) {
      }
      (void)port.status.fetch();
      for (const auto direction : {image::Direction::inputs, image::Direction::outputs}) {
        (void)port.image(direction).fetch();
      }
    }
  }
}

}  // namespace linegate::bench

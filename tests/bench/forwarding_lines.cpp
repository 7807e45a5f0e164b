// SPDX-License-Identifier: Apache-2.0
#include "tests/bench/forwarding_lines.h"

#include <utility>

#include "tests/paths.h"

namespace linegate::bench {
namespace {

// The lines are slaves of another master, so that they need no boot.
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

}  // namespace

ForwardingLines::ForwardingLines(std::array<std::unique_ptr<can_bridge::Channel>, 2> channels,
                                 bool together, std::array<std::optional<unsigned>, 2> processors,
                                 std::optional<config::Publish> publish)
    : plant_(*config::read(kPlant, paths::in_repository("plant.yaml")).value),
      link_(plant_.bindings),
      publisher_([this] { take(); }) {
  for (std::size_t i = 0; i < (together ? 1U : 2U); ++i) {
    executors_.push_back(
        std::make_unique<gateway::Executor>(config::ExecutorPlan{.processor = processors[i]}));
  }
  std::array<std::unique_ptr<gateway::LineRunner>, 2> runners;
  for (std::size_t i = 0; i < 2; ++i) {
    config::LinePlan& plan = plant_.lines[i];
    plan.config.role = line::Role::device;
    plan.publish = publish.value_or(plan.publish);
    runners[i] = std::make_unique<gateway::LineRunner>(
        make_line(plan.config), std::move(channels[i]), plan, ports_[i], publisher_.wakeup);
  }
  link_.runner = together ? runners[1].get() : nullptr;
  link_.taker = &executors_.back()->values_wakeup();
  runners[0]->bind({gateway::BoundSource(link_)}, {});
  runners[1]->bind({}, {gateway::BoundTarget(link_)});
  for (std::size_t i = 0; i < 2; ++i) {
    executors_[thread_of(i)]->add(std::move(runners[i]));
  }
  publisher_.start();
  for (std::size_t i = 0; i < executors_.size(); ++i) {
    executors_[i]->start();
    executors_[i]->visit([this, i] { clocks_[i].begin(); });
  }
}

ForwardingLines::~ForwardingLines() {
  for (const auto& one : executors_) {
    one->request_stop();
    one->join();
  }
  publisher_.stop();
}

void ForwardingLines::take() {
  for (gateway::LinePort& port : ports_) {
    (void)discard_reports(port);
    discard_images(port);
  }
}

}  // namespace linegate::bench

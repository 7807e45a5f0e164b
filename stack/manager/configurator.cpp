// SPDX-License-Identifier: Apache-2.0
#include "stack/manager/configurator.h"

#include <algorithm>
#include <span>
#include <utility>

#include "stack/manager/boot_event.h"
#include "stack/manager/task_boot_step.h"

namespace linegate::manager {

class Configurator::Step final : public TaskBootStep<ConfigurationRun> {
 public:
  explicit Step(Configurator& owner, std::uint8_t node) : owner_(owner), node_(node) {}
  ~Step() override { owner_.runs_[node_] = nullptr; }

  void cancel() override {
    TaskBootStep::cancel();
    owner_.runs_[node_] = nullptr;
  }

  void completed(const sdo::Completion& completion, Instant now) override {
    TaskBootStep::completed(completion, now);
    owner_.runs_[node_] = task();
  }

 private:
  ConfigurationRun first(const StepContext& context) override {
    ConfigurationOrder order = owner_.begin(node_);
    order.read_only = context.is_kept_alive();
    return ConfigurationRun(std::move(order));
  }
  ConfigurationRun again(const StepContext& /*context*/) override {
    ConfigurationOrder order = owner_.begin(node_);
    order.restore = 0;
    order.check = false;
    return ConfigurationRun(std::move(order));
  }
  StepEnd judge(const ConfigurationRun& run, Instant now) override {
    owner_.ended(run, now);
    switch (run.result()) {
      case ConfigurationRun::Result::restored:
        return {.kind = StepEnd::Kind::reset};
      case ConfigurationRun::Result::unlike:
        return {.kind = StepEnd::Kind::unlike};
      case ConfigurationRun::Result::failed:
        return {.kind = StepEnd::Kind::failed,
                .letter = 'J',
                .finding = run.finding(),
                .again = run.may_succeed_later()};
      case ConfigurationRun::Result::applied:
      case ConfigurationRun::Result::unchanged:
        break;
    }
    return {};
  }

  Configurator& owner_;
  std::uint8_t node_;
};

Configurator::Configurator(od::Dictionary& dictionary, std::span<const NodePlan> plans,
                           sdo::Arbiter& sdo, EventLog& events, Duration sdo_timeout)
    : events_(events), objects_(dictionary, plans), comparisons_(sdo, sdo_timeout) {
}

std::unique_ptr<BootStep> Configurator::make_step(std::uint8_t node) {
  return std::make_unique<Step>(*this, node);
}

ConfigurationOrder Configurator::begin(std::uint8_t node) {
  if (auto comparison = comparisons_.cancel(node)) {
    comparison->give_up(AbortCode::device_state);
    reports_.push_back(
        {.node = node, .end = comparison->end(), .differences = comparison->pop_differences()});
  }
  ConfigurationOrder order = objects_.order(node);
  order.check = !forced_[node];
  return order;
}

void Configurator::ended(const ConfigurationRun& run, Instant now) {
  const std::uint8_t node = run.node();
  if (run.result() != ConfigurationRun::Result::restored && !run.read_only()) {
    forced_.reset(node);
  }
  const auto before = std::exchange(faults_[node], std::nullopt);
  const bool failed = run.result() == ConfigurationRun::Result::failed;
  if (failed || run.abort() != AbortCode::none) {
    faults_[node] = run.fault();
  }
  if (run.abort() == AbortCode::none) {
    return;
  }
  if (failed && is_communication_error(run.abort()) && before == faults_[node]) {
    return;  // the node is retried every second: an unchanged failure is reported once
  }
  events_.emit({.time = now,
                .node = node,
                .data = event::ConfigurationError{
                    .abort = run.abort(), .index = run.object().index, .sub = run.object().sub}});
}

bool Configurator::verify(std::uint8_t node, Instant now, std::uint32_t client) {
  if (runs_[node] != nullptr || comparisons_.busy(node)) {
    return false;
  }
  const ConfigurationOrder order = objects_.order(node);
  comparisons_.begin(std::make_unique<Comparison>(node, order.writes, order.pdos), now, client);
  return true;
}

void Configurator::advance(Instant now) {
  comparisons_.advance(now);
}

std::optional<NodeReport> Configurator::pop_report() {
  if (const auto comparison = comparisons_.pop_ended()) {
    reports_.push_back({.node = comparison->node(),
                        .end = comparison->end(),
                        .differences = comparison->pop_differences()});
  }
  if (reports_.empty()) {
    return std::nullopt;
  }
  NodeReport out = std::move(reports_.front());
  reports_.pop_front();
  return out;
}

Configurator::Progress Configurator::progress(std::uint8_t node) const {
  if (const ConfigurationRun* run = runs_[node]) {
    return {run->done(), run->total()};
  }
  if (const Comparison* comparison = comparisons_.find(node)) {
    return {comparison->done(), comparison->total()};
  }
  return {};
}

}  // namespace linegate::manager

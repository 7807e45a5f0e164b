// SPDX-License-Identifier: Apache-2.0
#include "stack/line/configure_service.h"

#include <algorithm>
#include <array>
#include <utility>

#include "stack/base/time.h"
#include "stack/can/cob_id.h"

namespace linegate::line {
namespace {

constexpr Duration kProgressPeriod = std::chrono::seconds(1);

template <class Action>
void for_each_node(const std::bitset<128>& nodes, Action action) {
  for (std::uint8_t node = can::kMinNodeId; node <= can::kMaxNodeId; ++node) {
    if (nodes[node]) {
      action(node);
    }
  }
}

}  // namespace

ConfigureService::ConfigureService(ServiceHost& host, manager::Manager& manager,
                                   manager::Configurator& configurator, EventLog& events)
    : Service(host), manager_(manager), configurator_(configurator), events_(events) {
  configurator.objects().set_may_configure([this](std::uint8_t id) { return may_configure(id); });
}

std::span<const CommandKind> ConfigureService::commands() const {
  static constexpr std::array kCommands{CommandKind::configure};
  return kCommands;
}

void ConfigureService::execute(Command command, Instant now) {
  if (!host().manages()) {
    host().refuse(command, Refusal::wrong_role, now);
  } else if (!host().usable()) {
    host().refuse(command, Refusal::line_down, now);
  } else if (const Refusal why = begin(command, now); why != Refusal::none) {
    host().refuse(command, why, now);
  } else {
    conclude(now);
  }
}

// The abort code for a request by 1F25h (CiA 302-3).
AbortCode ConfigureService::may_configure(std::uint8_t id) const {
  if (!host().manages() || !manager_.active()) {
    return AbortCode::local_control;
  }
  if (!manager_.node(id).configured) {
    return AbortCode::invalid_value;
  }
  const bool booting = manager_.node(id).boot == manager::kBootUnfinished;
  return booting ? AbortCode::device_state : AbortCode::none;
}

Refusal ConfigureService::begin(const Command& command, Instant now) {
  if (running_) {
    return Refusal::busy;
  }
  if (!manager_.active()) {
    return Refusal::wrong_state;
  }
  const auto& request = std::get<Configure>(command.request);
  std::bitset<128> nodes;
  for (std::uint8_t node = can::kMinNodeId; node <= can::kMaxNodeId; ++node) {
    const bool meant = request.node == 0 || request.node == node;
    nodes.set(node, meant && manager_.node(node).configured);
  }
  if (request.node != 0 && nodes.none()) {
    return Refusal::bad_request;
  }
  running_ = Running{.tag = command.tag,
                     .client = command.client,
                     .apply = request.apply,
                     .report_at = now + kProgressPeriod};
  running_->deadline = command.timeout > Duration::zero() ? deadline(now, command.timeout) : kNever;
  running_->nodes = nodes;
  running_->totals.resize(nodes.size());
  for_each_node(nodes, [&](std::uint8_t node) { begin_node(node, now); });
  return Refusal::none;
}

void ConfigureService::begin_node(std::uint8_t node, Instant now) {
  if (running_->apply) {
    running_->totals[node] = configurator_.objects().order(node).writes.size();
    apply(node, now, running_->client);
  } else if (configurator_.verify(node, now, running_->client)) {
    running_->totals[node] = configurator_.progress(node).total;
  } else {
    running_->nodes.reset(node);
    running_->reports.push_back({.node = node, .end = AbortCode::device_state});
  }
}

void ConfigureService::apply(std::uint8_t node, Instant now, std::uint32_t client) {
  configurator_.force(node);
  manager_.boot(node, now, client);
}

void ConfigureService::carry_out_requests(Instant now, std::uint32_t client) {
  if (configurator_.objects().requested()) {
    for_each_node(configurator_.objects().pop_requests(), [&](std::uint8_t node) {
      if (may_configure(node) != AbortCode::local_control) {
        apply(node, now, client);
      }
    });
  }
}

void ConfigureService::advance(Instant now) {
  configurator_.advance(now);
  carry_out_requests(now);
  conclude(now);
}

// Evaluates the results of the configurator and the manager.
void ConfigureService::conclude(Instant now) {
  collect();
  if (!running_) {
    return;
  }
  if (running_->nodes.none()) {
    finish();
  } else if (now >= running_->deadline) {
    end(Refusal::timed_out, now);
  } else if (now >= running_->report_at) {
    running_->report_at = now + kProgressPeriod;
    report_progress(now);
  }
}

// Drops reports of a command that has already ended.
void ConfigureService::collect() {
  while (auto report = configurator_.pop_report()) {
    if (running_ && !running_->apply && running_->nodes[report->node]) {
      running_->nodes.reset(report->node);
      running_->reports.push_back(*std::move(report));
    }
  }
  if (!running_ || !running_->apply) {
    return;
  }
  for_each_node(running_->nodes, [&](std::uint8_t node) {
    if (manager_.concluded(node)) {
      running_->nodes.reset(node);
      running_->reports.push_back(applied(node));
    }
  });
}

// An error of the configuration itself is reported as a difference; a node whose boot did not reach
// the configuration has only the letter.
manager::NodeReport ConfigureService::applied(std::uint8_t node) const {
  manager::NodeReport report{.node = node, .boot = manager_.node(node).boot};
  const auto& fault = configurator_.fault(node);
  if (fault && (report.boot == manager::kBooted || report.boot == 'J')) {
    report.end = fault->abort;
    report.differences.push_back(*fault);
  }
  return report;
}

void ConfigureService::report_progress(Instant now) const {
  std::size_t done = 0;
  std::size_t total = 0;
  for (std::uint8_t node = can::kMinNodeId; node <= can::kMaxNodeId; ++node) {
    const std::size_t of_node = running_->totals[node];
    total += of_node;
    done += running_->nodes[node] ? configurator_.progress(node).done : of_node;
  }
  events_.emit({.time = now,
                .data = event::CommandProgress{.command = CommandKind::configure,
                                               .done = static_cast<std::uint32_t>(done),
                                               .total = static_cast<std::uint32_t>(total)}});
}

void ConfigureService::finish() {
  std::ranges::sort(running_->reports, {}, &manager::NodeReport::node);
  Running ended = *std::exchange(running_, std::nullopt);
  host().reply(ended.tag, Error{}, std::move(ended.reports));
}

void ConfigureService::end(Refusal why, Instant /*now*/) {
  if (!running_) {
    return;
  }
  if (!running_->apply) {
    for_each_node(running_->nodes,
                  [this](std::uint8_t node) { configurator_.cancel_verify(node); });
  }
  const std::uint64_t tag = std::exchange(running_, std::nullopt)->tag;
  host().reply(tag, to_error(why), {});
}

Instant ConfigureService::next_wake() const {
  if (configurator_.objects().requested()) {
    return Instant{};
  }
  const Instant wake = configurator_.next_wake();
  return running_ ? earlier(wake, earlier(running_->deadline, running_->report_at)) : wake;
}

}  // namespace linegate::line

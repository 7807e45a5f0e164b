// SPDX-License-Identifier: Apache-2.0
#include "stack/line/configure_command.h"

#include <algorithm>
#include <utility>

#include "stack/base/byte_order.h"
#include "stack/base/deadline.h"
#include "stack/can/cob_id.h"

namespace linegate::line {
namespace {

constexpr Duration kTellEvery = std::chrono::seconds(1);

template <class Action>
void for_each_node(const std::bitset<128>& nodes, Action action) {
  for (std::uint8_t node = can::kMinNodeId; node <= can::kMaxNodeId; ++node) {
    if (nodes[node]) {
      action(node);
    }
  }
}

}  // namespace

Refusal ConfigureCommand::begin(const Command& command, Instant now) {
  if (running_ || reply_) {
    return Refusal::busy;
  }
  if (!manager_.active()) {
    return Refusal::wrong_state;
  }
  std::bitset<128> nodes;
  for (std::uint8_t node = can::kMinNodeId; node <= can::kMaxNodeId; ++node) {
    const bool meant = command.node == 0 || command.node == node;
    nodes.set(node, meant && manager_.node(node).configured);
  }
  if (command.code > 1 || (command.node != 0 && nodes.none())) {
    return Refusal::bad_request;
  }
  running_ = Running{.tag = command.tag, .apply = command.code == 1, .tell_at = now + kTellEvery};
  running_->deadline = command.timeout > Duration::zero() ? deadline(now, command.timeout) : kNever;
  running_->nodes = nodes;
  running_->totals.resize(nodes.size());
  for_each_node(nodes, [&](std::uint8_t node) { begin_node(node, now); });
  advance(now);
  return Refusal::none;
}

void ConfigureCommand::begin_node(std::uint8_t node, Instant now) {
  if (running_->apply) {
    running_->totals[node] = configurator_.objects().order(node).writes.size();
    apply(node, now);
  } else if (configurator_.verify(node, now)) {
    running_->totals[node] = configurator_.progress(node).total;
  } else {
    running_->nodes.reset(node);
    running_->reports.push_back({.node = node, .end = AbortCode::device_state});
  }
}

void ConfigureCommand::apply(std::uint8_t node, Instant now) {
  configurator_.force(node);
  manager_.boot(node, now);
}

void ConfigureCommand::carry_out_requests(Instant now) {
  if (configurator_.objects().requested()) {
    for_each_node(configurator_.objects().take_requests(),
                  [&](std::uint8_t node) { apply(node, now); });
  }
}

void ConfigureCommand::advance(Instant now) {
  collect();
  if (!running_) {
    return;
  }
  if (running_->nodes.none()) {
    finish();
  } else if (now >= running_->deadline) {
    end(Refusal::timed_out);
  } else if (now >= running_->tell_at) {
    running_->tell_at = now + kTellEvery;
    tell(now);
  }
}

// Reports of nodes that nobody waits for any longer are dropped.
void ConfigureCommand::collect() {
  while (auto report = configurator_.take_report()) {
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

// What the configuration itself found is told as difference; a node that was not booted so far has
// the letter alone.
manager::NodeReport ConfigureCommand::applied(std::uint8_t node) const {
  manager::NodeReport report{.node = node, .boot = manager_.node(node).boot};
  const auto& fault = configurator_.fault(node);
  if (fault && (report.boot == manager::kBooted || report.boot == 'J')) {
    report.end = fault->abort;
    report.differences.push_back(*fault);
  }
  return report;
}

void ConfigureCommand::tell(Instant now) const {
  std::size_t done = 0;
  std::size_t total = 0;
  for (std::uint8_t node = can::kMinNodeId; node <= can::kMaxNodeId; ++node) {
    const std::size_t of_node = running_->totals[node];
    total += of_node;
    done += running_->nodes[node] ? configurator_.progress(node).done : of_node;
  }
  Event event{.time = now, .kind = EventKind::command_progress, .length = 4};
  event.code = static_cast<std::uint32_t>(CommandKind::configure);
  event.value = static_cast<std::uint32_t>(done);
  store_le(event.data.data(), static_cast<std::uint32_t>(total));
  events_.emit(event);
}

void ConfigureCommand::finish() {
  std::ranges::sort(running_->reports, {}, &manager::NodeReport::node);
  reply_ = Reply{.tag = running_->tag,
                 .error = {},
                 .data = manager::write_configuration_report(running_->reports)};
  running_.reset();
}

void ConfigureCommand::end(Refusal why) {
  if (!running_) {
    return;
  }
  if (!running_->apply) {
    for_each_node(running_->nodes,
                  [this](std::uint8_t node) { configurator_.cancel_verify(node); });
  }
  reply_ = Reply{.tag = running_->tag, .error = to_error(why), .data = {}};
  running_.reset();
}

Instant ConfigureCommand::next_wake() const {
  if (configurator_.objects().requested()) {
    return Instant{};
  }
  return running_ ? earlier(running_->deadline, running_->tell_at) : kNever;
}

std::optional<Reply> ConfigureCommand::take_reply() {
  return std::exchange(reply_, std::nullopt);
}

}  // namespace linegate::line

// SPDX-License-Identifier: Apache-2.0
// The passing of time in a line with its own node.
#include <algorithm>

#include "stack/line/node_line.h"

namespace linegate::line {

[[gnu::hot]] bool NodeLine::advance(Instant now) {
  advanced_to_ = now;
  const bool idle = is_idle(now);
  if (!idle) {
    advance_all(now);
    rest_until_ = {};
  }
  if (load_.is_due(now)) {
    can::Traffic seen = node_.counters().sent;
    seen += node_.counters().received;
    seen += services_.lss.sent();
    load_.advance(seen, now);
  }
  return !idle;
}

void NodeLine::advance_all(Instant now) {
  events_.advance(now);
  node_.advance(now);
  if (!services_.sleep.may_transmit()) [[unlikely]] {
    node_.transmit().clear();  // what it sends by itself
  }
  if (services_.flying.is_passive()) [[unlikely]] {
    change_role(now);  // the reaction of a watchdog that is due was the active master's
  }
  services_.outputs.expire_watchdogs(now);
  if (is_dirty() || now >= services_due_) {
    advance_services(now);
  }
}

[[gnu::hot]] bool NodeLine::is_idle(Instant now) const {
  return now < rest_until_ && !is_dirty() && node_.served() == rest_served_ &&
         now < node_.pdos().next_wake() && now < services_.outputs.next_watchdog();
}

[[gnu::hot]] Instant NodeLine::next_wake() const {
  const bool known = rest_until_ != Instant{} && !is_dirty() && node_.served() == rest_served_;
  if (!known) {
    rest_until_ = earlier(earlier(node_.next_service(), events_.next_wake()),
                          is_dirty() ? services_wake() : services_due_);
    rest_served_ = node_.served();
  }
  return earlier(rest_until_, earlier(node_.pdos().next_wake(), services_.outputs.next_watchdog()));
}

// The time of the node is not updated while the line is idle.
void NodeLine::mark_dirty(Instant now) {
  dirty_ = true;
  node_.pass_time(std::max(now, advanced_to_));
}

// Every input of the services arrives in one of these ways: from outside, as an event of the own
// node or of a PDO, or as a write to the dictionary.
[[gnu::hot]] bool NodeLine::is_dirty() const {
  return dirty_ || services_.pdo_request.active() || events_.emitted() != events_seen_ ||
         node_.dictionary().writes_reported() != writes_seen_;
}

// Changes that services cause in each other are processed in the next round at the latest.
void NodeLine::advance_services(Instant now) {
  dirty_ = false;
  events_seen_ = events_.emitted();
  writes_seen_ = node_.dictionary().writes_reported();
  if (!services_.sleep.may_transmit()) {
    services_.sleep.advance(now);
    services_.local.advance(now);
    services_due_ = services_wake();
    return;
  }
  heartbeats_.advance(now);
  sdo_.advance(now);
  process_completions(now);
  services_.flying.advance(now);  // so that the role is that of its state in the same round
  change_role(now);
  startup_.advance(now);
  manager_.advance(now);
  nmt_.advance(now);
  for (Service* service : services()) {
    service->advance(now);
  }
  expire_sendings(now);
  services_due_ = services_wake();
}

Instant NodeLine::services_wake() const {
  if (!services_.sleep.may_transmit()) {
    return services_.sleep.next_wake();
  }
  if (running_ && !sleeps() && wants_manager() != manages_) {
    return Instant{};
  }
  Instant wake = earlier(heartbeats_.next_wake(), earlier(sdo_.next_wake(), manager_.next_wake()));
  wake = earlier(wake, earlier(startup_.next_wake(), nmt_.next_wake()));
  for (const Service* service : services()) {
    wake = earlier(wake, service->next_wake());
  }
  return earlier(wake, under_way_.next_deadline());
}

}  // namespace linegate::line

// SPDX-License-Identifier: Apache-2.0
// What time does to a line with a node of its own.
#include <algorithm>

#include "stack/line/line_impl.h"

namespace linegate::line {

[[gnu::hot]] void Line::Impl::advance(Instant now) {
  advanced_to = now;
  if (!rests(now)) {
    advance_all(now);
    rest_until = {};
  }
  if (load.is_due(now)) {
    can::Traffic seen = node.counters().sent;
    seen += node.counters().received;
    seen += lss.sent();
    load.advance(seen, now);
  }
}

void Line::Impl::advance_all(Instant now) {
  events.advance(now);
  node.advance(now);
  while (const Outputs::Group* group = outputs.expire(now)) {
    react(*group, now);
  }
  if (is_stirred() || now >= services_due) {
    advance_services(now);
  }
}

[[gnu::hot]] bool Line::Impl::rests(Instant now) const {
  return now < rest_until && !is_stirred() && node.served() == rest_served &&
         now < node.pdos().next_wake() && now < outputs.next_wake();
}

[[gnu::hot]] Instant Line::Impl::next_wake() const {
  const bool known = rest_until != Instant{} && !is_stirred() && node.served() == rest_served;
  if (!known) {
    rest_until = earlier(earlier(node.next_service(), events.next_wake()),
                         is_stirred() ? services_wake() : services_due);
    rest_served = node.served();
  }
  return earlier(rest_until, earlier(node.pdos().next_wake(), outputs.next_wake()));
}

// While the line rests the node is not told of time.
void Line::Impl::stir(Instant now) {
  stirred = true;
  node.pass_time(std::max(now, advanced_to));
}

// Whatever the services go by comes in one of these ways: from outside, as an event of the own
// node or of a PDO, or written to the dictionary.
[[gnu::hot]] bool Line::Impl::is_stirred() const {
  return stirred || pdo_requests.active() || events.emitted() != events_seen ||
         node.dictionary().writes_told() != writes_seen;
}

// What they tell each other in here is followed up in the next round at the latest.
void Line::Impl::advance_services(Instant now) {
  stirred = false;
  events_seen = events.emitted();
  writes_seen = node.dictionary().writes_told();
  heartbeats.advance(now);
  sdo.advance(now);
  take_completions(now);
  change_role(now);
  startup.advance(now);
  manager.advance(now);
  nmt.advance(now);
  ask_for_updated(now);
  for (Service* service : services) {
    service->advance(now);
  }
  expire_commands(now);
  finish_local_writes();
  repeat_lost_starts(now);
  follow_own_state(now);
  follow_receivers();
  if (!scanned_outputs.empty()) {
    follow_scanned();
  }
  services_due = services_wake();
}

Instant Line::Impl::services_wake() const {
  if (running && startup.wants_manager() != manages_) {
    return Instant{};
  }
  Instant wake = earlier(heartbeats.next_wake(), earlier(sdo.next_wake(), manager.next_wake()));
  wake = earlier(wake, earlier(startup.next_wake(), nmt.next_wake()));
  for (const Service* service : services) {
    wake = earlier(wake, service->next_wake());
  }
  return earlier(wake, earlier(updates.next_wake(), next_command_deadline()));
}

}  // namespace linegate::line

// SPDX-License-Identifier: Apache-2.0
#include "stack/manager/connections.h"

#include <algorithm>
#include <utility>

#include "stack/base/assert.h"
#include "stack/base/byte_order.h"
#include "stack/can/cob_id.h"

namespace linegate::manager {
namespace {

constexpr std::uint8_t kPartnerSub = 3;  // a byte; the others are COB-IDs
constexpr Duration kFullQueue = std::chrono::milliseconds(10);

bool is_node(std::uint8_t id) {
  return id >= can::kMinNodeId && id <= can::kMaxNodeId;
}

Instant end_of(const Connections::Request& request, Instant now) {
  const bool limited =
      request.timeout > Duration::zero() && request.timeout < Connections::kLongest;
  return deadline(now, limited ? request.timeout : Connections::kLongest);
}

}  // namespace

std::string_view name(ConnectionState state) {
  switch (state) {
    case ConnectionState::opening:
      return "opening";
    case ConnectionState::open:
      return "open";
    case ConnectionState::closing:
      return "closing";
    case ConnectionState::stale:
      return "stale";
  }
  return "unknown";
}

Connections::Connections(const Options& options, sdo::Arbiter& sdo, EventLog& events,
                         ConnectionHost& host)
    : options_(options), sdo_(sdo), events_(events), host_(host), heard_(options.pool.pairs() * 2) {
}

std::uint8_t Connections::node_of(const Connection& connection, End end) {
  return end == End::server ? connection.server : connection.client;
}

std::uint16_t Connections::record_of(const Connection& connection, End end) {
  return end == End::server ? connection.server_record : connection.client_record;
}

Connections::Entry* Connections::entry(std::uint32_t number) {
  const auto found =
      std::ranges::find(table_, number, [](const Entry& each) { return each.value.number; });
  return found == table_.end() ? nullptr : &*found;
}

// The connection of the request under way.
Connections::Entry& Connections::current() {
  Entry* const of_task = task_ ? entry(task_->request.number) : nullptr;
  LINEGATE_ASSERT(of_task != nullptr, "the connection of the request under way is in the table");
  return *of_task;
}

void Connections::erase(std::uint32_t number) {
  std::erase_if(table_, [number](const Entry& each) { return each.value.number == number; });
}

const Connection* Connections::find(std::uint32_t number) const {
  const auto found =
      std::ranges::find(table_, number, [](const Entry& each) { return each.value.number; });
  return found == table_.end() ? nullptr : &found->value;
}

std::vector<Connection> Connections::table() const {
  std::vector<Connection> out;
  out.reserve(table_.size());
  for (const Entry& each : table_) {
    out.push_back(each.value);
  }
  return out;
}

std::uint32_t Connections::open(std::uint8_t client, std::uint8_t server, Request request,
                                Instant now) {
  LINEGATE_ASSERT(is_node(client) && is_node(server) && client != server,
                  "a connection has two nodes");
  if (waiting_.size() >= kMostWaiting) {
    return 0;
  }
  const std::uint32_t number = ++numbers_;
  table_.push_back({.value = {.number = number, .client = client, .server = server},
                    .requested = true,
                    .queued = true});
  waiting_.push_back({.number = number,
                      .opens = true,
                      .deadline = end_of(request, now),
                      .client = request.client});
  return number;
}

bool Connections::close(std::uint32_t number, Request request, Instant now) {
  Entry* const wanted = entry(number);
  if (wanted == nullptr || wanted->queued || waiting_.size() >= kMostWaiting) {
    return false;
  }
  const bool stale = wanted->value.state == ConnectionState::stale;
  wanted->requested = true;
  queue_release(*wanted, stale ? event::ConnectionResult::cleared : event::ConnectionResult::closed,
                request, now);
  return true;
}

void Connections::queue_release(Entry& entry, event::ConnectionResult result, Request request,
                                Instant now) {
  entry.queued = true;
  waiting_.push_back({.number = entry.value.number,
                      .deadline = entry.requested ? end_of(request, now) : kNever,
                      .result = result});
}

void Connections::boot_up(std::uint8_t node, Instant now) {
  const auto restored = [node](Entry& each) {
    bool any = false;
    for (const End end : {End::server, End::client}) {
      const bool is_lost = node_of(each.value, end) == node && each.was_valid[place(end)];
      each.valid[place(end)] = each.valid[place(end)] || is_lost;
      any = any || is_lost;
    }
    return any;
  };
  const bool is_of_task =
      task_ && (current().value.client == node || current().value.server == node);
  for (Entry& each : table_) {
    const bool is_current = task_ && each.value.number == task_->request.number;
    if (restored(each) && !each.queued && !is_current) {
      const bool stale = each.value.state == ConnectionState::stale;
      queue_release(each, stale ? event::ConnectionResult::cleared : event::ConnectionResult::lost,
                    {}, now);
    }
  }
  revive(node, now);
  if (!is_of_task) {
    return;
  }
  drop_transfer();
  if (task_->phase != Phase::release) {
    fail(AbortCode::device_state, now);
  } else {
    constexpr unsigned kMostRestarts = 3;
    if (++task_->restarts > kMostRestarts) {
      task_->refused.fill(AbortCode::device_state);
      released(now);
    } else {
      begin_release(now);
    }
  }
}

// The records of released connections that the node may have restored. Both ends of one may be.
void Connections::revive(std::uint8_t node, Instant now) {
  for (const Entry& past : past_) {
    const End end = past.valid[place(End::server)] ? End::server : End::client;
    const std::uint32_t number = past.value.number;
    Entry* again = entry(number);
    if (node_of(past.value, end) != node ||
        (again == nullptr && is_watched(node, record_of(past.value, end)))) {
      continue;
    }
    if (again == nullptr) {
      const auto before = std::ranges::upper_bound(
          table_, number, {}, [](const Entry& each) { return each.value.number; });
      again = &*table_.insert(before, past);
    }
    again->valid[place(end)] = true;
    again->was_valid[place(end)] = true;
    if (!again->queued && (!task_ || task_->request.number != number)) {
      queue_release(*again, event::ConnectionResult::cleared, {}, now);
    }
  }
}

// Whether a connection in the table has made the record valid.
bool Connections::is_watched(std::uint8_t node, std::uint16_t record) const {
  return std::ranges::any_of(table_, [=](const Entry& each) {
    const auto is_of = [&](End end) {
      return each.was_valid[place(end)] && node_of(each.value, end) == node &&
             record_of(each.value, end) == record;
    };
    return is_of(End::server) || is_of(End::client);
  });
}

void Connections::remember(const Connection& connection, End end) {
  std::erase_if(past_, [&](const Entry& each) {
    return each.valid[place(end)] && node_of(each.value, end) == node_of(connection, end) &&
           record_of(each.value, end) == record_of(connection, end);
  });
  Entry past{.value = connection, .is_past = true};
  past.value.state = ConnectionState::closing;
  past.valid[place(end)] = true;
  past.was_valid[place(end)] = true;
  past_.push_back(past);
}

void Connections::recovered(std::uint8_t node, Instant now) {
  for (Entry& each : table_) {
    const bool is_of_node = each.value.client == node || each.value.server == node;
    if (is_of_node && each.value.state == ConnectionState::stale && !each.queued) {
      queue_release(each, event::ConnectionResult::cleared, {}, now);
    }
  }
}

void Connections::heard(std::uint32_t id, Instant now) {
  if (options_.pool.has(id) && id - options_.pool.first < heard_.size() &&
      !is_assigned(static_cast<std::uint16_t>(id))) {
    heard_[id - options_.pool.first] = now;
  }
}

// Requests that wait are not started any more.
void Connections::release_all(Instant now) {
  for (const Waiting& each : std::exchange(waiting_, {})) {
    Entry& of_request = *entry(each.number);
    of_request.queued = false;
    of_request.requested = false;
    if (each.opens) {
      report(of_request.value, event::ConnectionResult::failed, AbortCode::local_control, now);
      erase(each.number);
    }
  }
  for (Entry& each : table_) {
    each.requested = false;
    if (!each.queued) {
      queue_release(each, event::ConnectionResult::closed, {}, now);
    }
  }
  if (task_ && task_->phase != Phase::release) {
    drop_transfer();
    fail(AbortCode::local_control, now);
  }
}

void Connections::abandon(Instant now) {
  if (task_) {
    drop_transfer();
    task_.reset();
  }
  waiting_.clear();
  for (Entry& each : table_) {
    each.requested = false;
    each.queued = false;
    const bool remains = each.valid[0] || each.valid[1];
    if (each.value.state != ConnectionState::stale) {
      each.value.abort = AbortCode::local_control;
      report(each.value, remains ? event::ConnectionResult::stale : event::ConnectionResult::failed,
             AbortCode::local_control, now);
    }
    each.value.state = ConnectionState::stale;
  }
  std::erase_if(table_, [](const Entry& each) { return !each.valid[0] && !each.valid[1]; });
}

void Connections::advance(Instant now) {
  expire_waiting(now);
  if (task_ && task_->request.deadline <= now) {
    expire(now);
  }
  if (task_ && task_->retry_at <= now) {
    continue_task(now);
  }
  // A request that ends at once makes way for the next one.
  while (!task_ && !waiting_.empty()) {
    start_next(now);
  }
}

Instant Connections::next_wake() const {
  if (!task_) {
    return waiting_.empty() ? kNever : Instant{};
  }
  Instant wake = earlier(task_->request.deadline, task_->retry_at);
  for (const Waiting& each : waiting_) {
    wake = earlier(wake, each.deadline);
  }
  return wake;
}

void Connections::expire_waiting(Instant now) {
  for (Waiting& each : waiting_) {
    if (each.deadline <= now) {
      each.deadline = kNever;
      answer(*entry(each.number), AbortCode::none, true, now);
    }
  }
  std::erase_if(waiting_, [&](const Waiting& each) {
    const bool is_over = each.opens && each.deadline == kNever;
    if (is_over) {
      report(entry(each.number)->value, event::ConnectionResult::failed, AbortCode::timeout, now);
      erase(each.number);
    }
    return is_over;
  });
}

// A release goes on without the one who requested it.
void Connections::expire(Instant now) {
  task_->request.deadline = kNever;
  answer(current(), AbortCode::none, true, now);
  if (task_->phase != Phase::release) {
    drop_transfer();
    fail(AbortCode::timeout, now);
  }
}

void Connections::start_next(Instant now) {
  task_ = Task{.request = waiting_.front()};
  waiting_.pop_front();
  if (!task_->request.opens) {
    begin_release(now);
    return;
  }
  task_->taken.resize(heard_.size());
  if (free_pair(task_->taken, now)) {
    begin_search(End::server, now);
  } else {
    fail(AbortCode::sdo_connection, now);
  }
}

void Connections::continue_task(Instant now) {
  task_->retry_at = kNever;
  if (task_->phase == Phase::search) {
    read_next(now);
  } else {
    write_next(now);
  }
}

// The transfers have the priority of boot processes, whose aborts are not events.
void Connections::submit(od::Address address, std::optional<Step> write, Instant now) {
  const std::uint64_t number = ++transfers_;
  sdo::Request request{.owner = this,
                       .number = number,
                       .node = task_->node,
                       .address = address,
                       .write = write.has_value(),
                       .timeout = options_.sdo_timeout,
                       .priority = sdo::Priority::boot,
                       .client = task_->phase == Phase::release ? 0 : task_->request.client};
  if (write) {
    request.data.resize(write->sub == kPartnerSub ? 1 : sizeof write->value);
    store_le(std::span(request.data), write->value);
  }
  if (sdo_.submit(std::move(request), now)) {
    task_->transfer = number;
  } else {
    task_->retry_at = now + kFullQueue;
  }
}

void Connections::drop_transfer() {
  if (const std::uint64_t number = std::exchange(task_->transfer, 0); number != 0) {
    sdo_.cancel(*this, task_->node, number);
  }
  task_->retry_at = kNever;
}

void Connections::completed(sdo::Completion& completion, Instant now) {
  if (!task_ || task_->transfer != completion.number) {
    return;  // of a transfer that was dropped
  }
  task_->transfer = 0;
  if (task_->phase == Phase::search) {
    read_completed(completion, now);
  } else {
    write_completed(completion, now);
  }
}

void Connections::answer(Entry& entry, AbortCode why, bool expired, Instant now) {
  if (std::exchange(entry.requested, false)) {
    host_.ended(entry.value.number, why, expired, now);
  }
}

void Connections::report(const Connection& connection, event::ConnectionResult result,
                         AbortCode why, Instant now) {
  events_.emit({.time = now,
                .node = connection.client,
                .data = event::SdoConnection{.number = connection.number,
                                             .abort = why,
                                             .client_record = connection.client_record,
                                             .server_record = connection.server_record,
                                             .request = connection.request,
                                             .response = connection.response,
                                             .client = connection.client,
                                             .server = connection.server,
                                             .result = result}});
}

}  // namespace linegate::manager

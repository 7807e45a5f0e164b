// SPDX-License-Identifier: Apache-2.0
// The writes that make the records of a connection valid, or not valid.
#include "stack/base/assert.h"
#include "stack/can/cob_id.h"
#include "stack/manager/connections.h"

namespace linegate::manager {
namespace {

constexpr std::uint8_t kToServerSub = 1;
constexpr std::uint8_t kToClientSub = 2;
constexpr std::uint8_t kOtherNodeSub = 3;
// CiA 301 7.5.2.33: bit 30 = assigned dynamically
constexpr std::uint32_t kDynamicBit = 0x4000'0000;

}  // namespace

// Both records are complete before the first one becomes valid; the client's is the last, so that
// its requests find a server.
void Connections::begin_writes(Instant now) {
  const Connection& connection = current().value;
  LINEGATE_ASSERT(
      !can::is_restricted(connection.request) && !can::is_restricted(connection.response),
      "an assigned CAN-ID is not restricted (CiA 301 7.3.5)");
  task_->phase = Phase::prepare;
  task_->steps.clear();
  for (const End end : {End::server, End::client}) {
    const std::uint8_t other = end == End::server ? connection.client : connection.server;
    task_->steps.push_back({end, kToServerSub, can::CobId::kInvalidBit});
    task_->steps.push_back({end, kToClientSub, can::CobId::kInvalidBit});
    task_->steps.push_back({end, kOtherNodeSub, other});
  }
  for (const End end : {End::server, End::client}) {
    task_->steps.push_back({end, kToServerSub, kDynamicBit | connection.request});
    task_->steps.push_back({end, kToClientSub, kDynamicBit | connection.response});
  }
  task_->step = 0;
  write_next(now);
}

// The client's record first, so that its requests end before those that are answered.
void Connections::begin_release(Instant now) {
  Entry& entry = current();
  entry.value.state = ConnectionState::closing;
  task_->phase = Phase::release;
  task_->refused.fill(AbortCode::none);
  task_->steps.clear();
  for (const End end : {End::client, End::server}) {
    if (entry.valid[place(end)]) {
      task_->steps.push_back({end, kToServerSub, can::CobId::kInvalidBit});
      task_->steps.push_back({end, kToClientSub, can::CobId::kInvalidBit});
    }
  }
  task_->step = 0;
  write_next(now);
}

void Connections::write_next(Instant now) {
  Entry& entry = current();
  if (task_->step >= task_->steps.size()) {
    if (task_->phase == Phase::release) {
      released(now);
    } else {
      opened(now);
    }
    return;
  }
  const Step& step = task_->steps[task_->step];
  const bool makes_valid = step.sub != kOtherNodeSub && (step.value & can::CobId::kInvalidBit) == 0;
  if (makes_valid) {
    entry.valid[place(step.end)] = true;
    entry.was_valid[place(step.end)] = true;
    remember(entry.value, step.end);
  }
  task_->node = node_of(entry.value, step.end);
  submit({record_of(entry.value, step.end), step.sub}, step, now);
}

void Connections::write_completed(const sdo::Completion& completion, Instant now) {
  const Step step = task_->steps[task_->step++];
  if (task_->phase == Phase::release) {
    release_completed(completion.abort, step);
  } else {
    // Sub-index 3 of a server is optional (CiA 301 7.5.2.33).
    const bool optional = step.end == End::server && step.sub == kOtherNodeSub &&
                          completion.abort == AbortCode::no_sub_index;
    if (completion.abort != AbortCode::none && !optional) {
      fail(completion.abort, now);
      return;
    }
  }
  write_next(now);
}

// After a time-out the other sub-index of the record is not tried.
void Connections::release_completed(AbortCode why, const Step& step) {
  Entry& entry = current();
  AbortCode& refused = task_->refused[place(step.end)];
  const bool is_last = step.sub == kToClientSub;
  if (why == AbortCode::no_object) {
    refused = AbortCode::none;
    entry.valid[place(step.end)] = false;
  } else if (why != AbortCode::none) {
    refused = why;
  } else if (is_last && refused == AbortCode::none) {
    entry.valid[place(step.end)] = false;
  }
  if (!is_last && (why == AbortCode::no_object || why == AbortCode::timeout)) {
    ++task_->step;
  }
}

// A connection that was being opened is released, as far as it was written.
void Connections::fail(AbortCode why, Instant now) {
  task_->failure = why;
  report(current().value, event::ConnectionResult::failed, why, now);
  begin_release(now);
}

void Connections::opened(Instant now) {
  Entry& entry = current();
  entry.queued = false;
  entry.value.state = ConnectionState::open;
  task_.reset();
  report(entry.value, event::ConnectionResult::opened, AbortCode::none, now);
  answer(entry, AbortCode::none, false, now);
}

void Connections::released(Instant now) {
  Entry& entry = current();
  const Task ended = *std::exchange(task_, std::nullopt);
  const bool was_stale = entry.value.abort != AbortCode::none;
  entry.queued = false;
  entry.value.abort = AbortCode::none;
  for (const End end : {End::client, End::server}) {
    if (entry.valid[place(end)]) {
      entry.value.abort = ended.refused[place(end)];
    }
  }
  const bool is_stale = entry.valid[0] || entry.valid[1];
  entry.value.state = is_stale ? ConnectionState::stale : ConnectionState::closing;
  if (is_stale && !was_stale) {
    report(entry.value, event::ConnectionResult::stale, entry.value.abort, now);
  } else if (!is_stale && ended.failure == AbortCode::none && (was_stale || !entry.is_past)) {
    report(entry.value, ended.request.result, AbortCode::none, now);
  }
  answer(entry, ended.failure != AbortCode::none ? ended.failure : entry.value.abort, false, now);
  if (!is_stale) {
    erase(ended.request.number);
  }
}

}  // namespace linegate::manager

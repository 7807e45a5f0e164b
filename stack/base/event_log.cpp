// SPDX-License-Identifier: Apache-2.0
#include "stack/base/event_log.h"

#include <algorithm>

#include "stack/base/assert.h"

namespace linegate {
namespace {

constexpr std::size_t kObjects = 256;  // objects with a repeat limit of their own

}  // namespace

EventLog::EventLog(std::size_t capacity) : ring_(capacity < 2 ? 2 : capacity) {
}

void EventLog::limit_repeats() {
  LINEGATE_ASSERT(line_ == nullptr, "only the log of a line limits events");
  for (const Limited which : {kMalformed, kBusError, kOutputs, kCommands, kUnanswered}) {
    limits_[which].emplace();
  }
  for (const Limited which : {kWritten, kAccepted, kOwner, kSafety}) {
    limits_[which] = RepeatLimit::that_keeps_newest(kObjects, kWritesAtOnce);
  }
}

// A master that configures its network transfers many different objects in a second.
void EventLog::limit_overheard() {
  LINEGATE_ASSERT(line_ == nullptr, "only the log of a line limits events");
  limits_[kTransfer].emplace(kObjects);
  limits_[kAbort].emplace(kObjects);
}

void EventLog::emit(Event event) {
  if (line_ != nullptr) {
    const bool own = event.node == 0 || event.node == own_node_;
    event.node = own ? device_ : event.node;
    line_->emit(event);
    return;
  }
  auto& limit = limits_[limit_of(event.kind())];
  if (!limit || limit->admit(event)) {
    number(event);
  } else {
    next_wake_ = earlier(next_wake_, limit->next_wake());
  }
}

void EventLog::advance(Instant now) {
  if (next_wake_ > now) {
    return;
  }
  next_wake_ = kNever;
  for (auto& limit : limits_) {
    if (!limit) {
      continue;
    }
    while (const auto event = limit->pop_due(now)) {
      number(*event);
    }
    next_wake_ = earlier(next_wake_, limit->next_wake());
  }
}

EventLog::Limited EventLog::limit_of(EventKind kind) {
  switch (kind) {
    case EventKind::malformed_frame:
      return kMalformed;
    case EventKind::bus_error:
      return kBusError;
    case EventKind::output_refused:
      return kOutputs;
    case EventKind::command_refused:
      return kCommands;
    case EventKind::sdo_transfer:
      return kTransfer;
    case EventKind::sdo_abort:
      return kAbort;
    case EventKind::object_written:
      return kWritten;
    case EventKind::command_accepted:
      return kAccepted;
    case EventKind::output_owner:
      return kOwner;
    case EventKind::routing_unanswered:
      return kUnanswered;
    case EventKind::srdo_state:
      return kSafety;
    default:
      return kFree;
  }
}

void EventLog::number(Event event) {
  event.number = next_number_++;
  if (listener_ != nullptr) {
    listener_->emitted(event);
    LINEGATE_ASSERT(next_number_ == event.number + 1, "a listener emits no event");
  }
  // The marker needs an entry of its own, so after a loss two entries must be free.
  const std::size_t needed = lost_first_ == 0 ? 1 : 2;
  if (ring_.size() - count_ < needed) {
    if (lost_first_ == 0) {
      lost_first_ = event.number;
    }
    lost_last_ = event.number;
    lost_time_ = event.time;
    ++lost_total_;
    return;
  }
  if (lost_first_ != 0) {
    append_loss_marker();
  }
  append(event);
}

std::size_t EventLog::take(std::span<Event> out) {
  std::size_t taken = 0;
  while (taken < out.size() && count_ > 0) {
    out[taken++] = ring_[head_];
    head_ = (head_ + 1) % ring_.size();
    --count_;
  }
  if (count_ == 0 && lost_first_ != 0) {
    append_loss_marker();
    if (taken < out.size()) {
      out[taken++] = ring_[head_];
      head_ = (head_ + 1) % ring_.size();
      --count_;
    }
  }
  return taken;
}

// An event stays in the ring until its entry is reused; an entry without a number was never used.
std::size_t EventLog::newest(std::span<Event> out) const {
  std::size_t given = 0;
  for (std::size_t back = std::min(out.size(), ring_.size()); back > 0; --back) {
    const Event& event = ring_[(head_ + count_ + ring_.size() - back) % ring_.size()];
    if (event.number != 0) {
      out[given++] = event;
    }
  }
  return given;
}

void EventLog::append(const Event& event) {
  LINEGATE_ASSERT(count_ < ring_.size(), "the ring has a free place");
  ring_[(head_ + count_) % ring_.size()] = event;
  ++count_;
}

void EventLog::append_loss_marker() {
  append({.number = lost_last_,
          .time = lost_time_,
          .data = event::EventsLost{.first = lost_first_, .last = lost_last_}});
  lost_first_ = 0;
}

}  // namespace linegate

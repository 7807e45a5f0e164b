// SPDX-License-Identifier: Apache-2.0
#include "stack/nmt/sleep.h"

#include <cstddef>
#include <utility>

#include "stack/base/assert.h"
#include "stack/can/cob_id.h"

namespace linegate::nmt {
namespace {

constexpr Duration kForever = Duration::max();

}  // namespace

void Sleep::set_master(bool master, Instant now) {
  if (std::exchange(master_, master) == master || phase_ != SleepPhase::check) {
    return;
  }
  then_prepare_ = false;
  enter(SleepPhase::awake, SleepCause::role, now);
}

void Sleep::acknowledged(Instant now) {
  if (!std::exchange(unacknowledged_, false)) {
    return;
  }
  if (phase_ == SleepPhase::check || phase_ == SleepPhase::prepare) {
    until_ = now + time_of(phase_);
  }
}

void Sleep::give_up(Instant now) {
  if (phase_ == SleepPhase::prepare && unacknowledged_) {
    wake(SleepCause::no_acknowledge, now);
  }
}

void Sleep::lose_bus(Instant now) {
  advance(now);
  if (phase_ == SleepPhase::check && master_) {
    then_prepare_ = false;
    enter(SleepPhase::awake, SleepCause::no_acknowledge, now);
  }
}

bool Sleep::check(bool then_prepare, Instant now) {
  advance(now);
  if (phase_ != SleepPhase::awake) {
    return false;
  }
  objections_.reset();
  objections_.set(own_node_, objects_);
  then_prepare_ = then_prepare;
  send(protocol_.check_byte);
  enter(SleepPhase::check, SleepCause::command, now);
  return true;
}

bool Sleep::prepare(Instant now) {
  advance(now);
  if (phase_ != SleepPhase::awake) {
    return false;
  }
  objections_.reset();
  send(protocol_.prepare_byte);
  enter(SleepPhase::prepare, SleepCause::command, now);
  return true;
}

bool Sleep::wake(Instant now) {
  advance(now);
  if (phase_ == SleepPhase::awake || (phase_ == SleepPhase::check && !master_)) {
    return false;
  }
  wake(SleepCause::command, now);
  return true;
}

bool Sleep::receive(const can::Frame& frame) {
  if (frame.remote()) {
    return true;
  }
  hear(frame.time);
  if (frame.length == 0 || frame.fd()) {
    return false;
  }
  const auto code = std::to_integer<std::uint8_t>(frame.data[0]);
  if (frame.id == protocol_.request) {
    receive_request(code, frame.time);
    return true;
  }
  const auto node =
      frame.length < 2 ? std::uint8_t{0} : std::to_integer<std::uint8_t>(frame.data[1]);
  if (code != protocol_.objection_byte || node < can::kMinNodeId || node > can::kMaxNodeId) {
    return false;
  }
  const bool counts = phase_ == SleepPhase::check || phase_ == SleepPhase::prepare;
  if (master_ && counts) {
    objections_.set(node);
    if (phase_ == SleepPhase::prepare) {
      wake(SleepCause::objection, frame.time, node);
    }
  }
  return true;
}

// Requests that are not defined are those of another version: they have no effect.
void Sleep::receive_request(std::uint8_t code, Instant now) {
  if (code == protocol_.wake_byte && sleeps()) {
    wake(SleepCause::wake, now);
    return;
  }
  if (master_ || phase_ > SleepPhase::check) {
    return;
  }
  if (code == protocol_.check_byte) {
    object();
    if (phase_ == SleepPhase::awake) {
      then_prepare_ = false;
      objections_.reset();
      enter(SleepPhase::check, SleepCause::master, now);
    }
  } else if (code == protocol_.prepare_byte) {
    object();
    unacknowledged_ = false;
    enter(SleepPhase::prepare, SleepCause::master, now);
  }
}

void Sleep::object() {
  if (!objects_) {
    return;
  }
  frames_.push_back(can::make_frame(protocol_.objection, {protocol_.objection_byte, own_node_}));
}

void Sleep::hear(Instant received) {
  if (next_wake() < received) {
    advance(received - Duration(1));
  }
  if (phase_ == SleepPhase::asleep) {
    wake(SleepCause::frame, received);
  }
}

void Sleep::advance(Instant now) {
  while (until_ <= now) {
    const Instant end = until_;
    switch (phase_) {
      case SleepPhase::check:
        end_check(master_ ? now : end);
        break;
      case SleepPhase::prepare:
        end_prepare(end, now);
        break;
      case SleepPhase::silent:
        enter(SleepPhase::asleep, SleepCause::time, end);
        break;
      case SleepPhase::awake:
      case SleepPhase::asleep:
        LINEGATE_ASSERT(false, "these phases have no end");
        return;
    }
  }
}

Instant Sleep::next_wake() const {
  return until_;
}

// Without an acknowledgement no other node may know of the sleep.
void Sleep::end_prepare(Instant end, Instant now) {
  if (unacknowledged_) {
    wake(SleepCause::no_acknowledge, now);
  } else {
    enter(SleepPhase::silent, SleepCause::time, end);
  }
}

// The prepare time of a master begins with its message, however late the thread is: else the
// message might wait until the master transmits nothing.
void Sleep::end_check(Instant now) {
  if (unacknowledged_) {
    then_prepare_ = false;
    enter(SleepPhase::awake, SleepCause::no_acknowledge, now);
    return;
  }
  if (objects_) {
    objections_.set(own_node_);
  }
  if (!master_ || objections_.none()) {
    if (std::exchange(then_prepare_, false)) {
      send(protocol_.prepare_byte);
      enter(SleepPhase::prepare, SleepCause::time, now);
    } else {
      enter(SleepPhase::awake, SleepCause::time, now);
    }
    return;
  }
  then_prepare_ = false;
  std::uint8_t first = can::kMinNodeId;
  while (!objections_[first]) {
    ++first;
  }
  enter(SleepPhase::awake, SleepCause::objection, now, first);
}

void Sleep::wake(SleepCause cause, Instant now, std::uint8_t node) {
  then_prepare_ = false;
  if (sleeps() && cause != SleepCause::wake) {
    send(protocol_.wake_byte);
  }
  enter(SleepPhase::awake, cause, now, node);
}

void Sleep::enter(SleepPhase phase, SleepCause cause, Instant now, std::uint8_t node) {
  changes_.push_back({.phase = phase, .before = phase_, .cause = cause, .node = node, .time = now});
  phase_ = phase;
  unacknowledged_ &= phase != SleepPhase::awake;
  until_ = time_of(phase) == kForever ? kNever : now + time_of(phase);
}

Duration Sleep::time_of(SleepPhase phase) const {
  switch (phase) {
    case SleepPhase::check:
      return protocol_.check_time;
    case SleepPhase::prepare:
      return protocol_.prepare_time;
    case SleepPhase::silent:
      return protocol_.silent_time;
    case SleepPhase::awake:
    case SleepPhase::asleep:
      break;
  }
  return kForever;
}

void Sleep::send(std::uint8_t code) {
  unacknowledged_ = true;
  frames_.push_back(can::make_frame(protocol_.request, {code}));
}

}  // namespace linegate::nmt

// SPDX-License-Identifier: Apache-2.0
#include "stack/nmt/flying_master.h"

#include <utility>

#include "stack/can/cob_id.h"

namespace linegate::nmt {

using Flying = FlyingMasterState;

std::optional<MasterRank> decode_active_master(const can::Frame& frame) {
  const MasterRank out{std::to_integer<std::uint8_t>(frame.data[0]),
                       std::to_integer<std::uint8_t>(frame.data[1])};
  const bool good = frame.standard_of(2) && out.priority <= kLowestMasterPriority &&
                    out.node >= can::kMinNodeId && out.node <= can::kMaxNodeId;
  return good ? std::optional(out) : std::nullopt;
}

void FlyingMaster::start(bool after_power_on, Instant now) {
  resets_ = after_power_on;
  search(Flying::detect, now);
}

void FlyingMaster::stop(Instant now) {
  enter(Flying::none, 0, kNever, now);
}

bool FlyingMaster::receive(const can::Frame& frame) {
  const Instant now = frame.time;
  if (state_ == Flying::none) {
    return true;
  }
  if (frame.id != kActiveMasterId && !frame.standard_of(0)) {
    return false;
  }
  switch (frame.id) {
    case kActiveMasterId:
      if (const auto other = decode_active_master(frame); other && other->node != own_node_) {
        active_master(*other, now);
        return true;
      }
      return false;
    case kStartNegotiationId:
      negotiate(now);
      return true;
    case kDetectMasterId:
      if (is_master()) {
        indicate(now);
      }
      return true;
    case kCapableQuestionId:
      send(kCapableAnswerId, now);
      return true;
    case kForceNegotiationId:
      resets_ = false;  // a master was active
      search(Flying::detect, now);
      return true;
    default:
      return true;
  }
}

// Another active master.
void FlyingMaster::active_master(const MasterRank& other, Instant now) {
  if (is_master()) {
    if (other < own_rank()) {
      follow(other.node, now);
    } else {
      force_others(now);
    }
    return;
  }
  if (other.priority <= times_.priority) {
    follow(other.node, now);
  } else if (state_ == Flying::negotiate || wait_ == Wait::answer) {
    force(now);
  }
  // Else it asks later: the other one may have been stopped meanwhile.
}

void FlyingMaster::node_control(const NodeControl& control, Instant now) {
  if (state_ == Flying::none) {
    return;
  }
  if (is_master()) {
    // Who sends NMT commands may be a second master, or believe that there is none.
    if (now - indicated_ >= times_.master_timeout) {
      indicate(now);
    }
  } else if (is_reset(control.command) && control.addresses(own_node_)) {
    start(false, now);
  }
}

void FlyingMaster::boot_up(Instant now) {
  if (is_master()) {
    indicate(now);
  }
}

void FlyingMaster::heartbeat_lost(std::uint8_t node, Instant now) {
  if (state_ == Flying::slave && node == active_) {
    start(true, now);
  }
}

void FlyingMaster::advance(Instant now) {
  if (deadline_ > now) {
    return;
  }
  switch (state_) {
    case Flying::none:
      return;
    case Flying::detect:
    case Flying::reset:
    case Flying::force:
      if (wait_ == Wait::delay) {
        ask(now);
      } else {
        found_none(now);
      }
      return;
    case Flying::negotiate:
      become_master(now);
      return;
    case Flying::master:
      deadline_ = now + times_.detect_cycle;
      send(detection_ == MasterDetection::ask ? kDetectMasterId : kForceNegotiationId, now);
      return;
    case Flying::slave:
      if (wait_ == Wait::delay) {
        ask(now);
      } else {
        master_is_silent(now);
      }
      return;
  }
}

// The slave has no answer. A master that sends no heartbeat either may be late: the loss of its
// heartbeat decides.
void FlyingMaster::master_is_silent(Instant now) {
  const bool monitored = heard_ != Instant{} && host_.monitors_master();
  if (!monitored) {
    start(false, now);
  } else if (heard_ <= asked_) {
    deadline_ = now + times_.master_timeout;
  } else if (++unanswered_ < kUnansweredQuestions) {
    ask(now);
  } else {
    start(false, now);
  }
}

void FlyingMaster::enter(Flying state, std::uint8_t active, Instant wake, Instant now) {
  wait_ = Wait::delay;
  deadline_ = wake;
  unanswered_ = 0;
  const bool other_master = std::exchange(active_, active) != active;
  const Flying before = std::exchange(state_, state);
  if (before != state || other_master) {
    heard_ = {};
    host_.flying_master_changed(before, now);
  }
}

void FlyingMaster::search(Flying state, Instant now) {
  enter(state, 0, now + times_.negotiation_delay, now);
}

void FlyingMaster::ask(Instant now) {
  wait_ = Wait::answer;
  asked_ = now;
  deadline_ = now + times_.master_timeout;
  send(kDetectMasterId, now);
}

void FlyingMaster::found_none(Instant now) {
  if (std::exchange(resets_, false) && host_.reset_all(now)) {
    search(Flying::reset, now);
    return;
  }
  send(kStartNegotiationId, now);
  negotiate(now);
}

void FlyingMaster::negotiate(Instant now) {
  resets_ = false;
  enter(Flying::negotiate, 0,
        now + times_.priority * times_.priority_slot + own_node_ * times_.device_slot, now);
}

void FlyingMaster::become_master(Instant now) {
  indicate(now);
  enter(Flying::master, own_node_, now + times_.detect_cycle, now);
}

void FlyingMaster::follow(std::uint8_t master, Instant now) {
  enter(Flying::slave, master, now + times_.detect_cycle, now);
}

// The active master has a lower priority.
void FlyingMaster::force(Instant now) {
  resets_ = false;
  send(kForceNegotiationId, now);
  search(Flying::force, now);
}

// A second master has to search again; this one remains. After a message that had no effect, it
// asks again before it repeats it.
void FlyingMaster::force_others(Instant now) {
  const Instant again = forced_ + times_.negotiation_delay + times_.master_timeout;
  if (forced_ != Instant{} && now < again) {
    deadline_ = earlier(deadline_, again);
    return;
  }
  forced_ = now;
  send(kForceNegotiationId, now);
}

void FlyingMaster::indicate(Instant now) {
  indicated_ = now;
  host_.send_master_message(can::make_frame(kActiveMasterId, {times_.priority, own_node_}), now);
}

void FlyingMaster::send(std::uint16_t id, Instant now) {
  host_.send_master_message(can::make_frame(id), now);
}

}  // namespace linegate::nmt

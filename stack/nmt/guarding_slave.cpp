// SPDX-License-Identifier: Apache-2.0
#include "stack/nmt/guarding_slave.h"

#include <utility>

#include "stack/nmt/heartbeat_consumer.h"
#include "stack/nmt/heartbeat_producer.h"
#include "stack/od/objects.h"

namespace linegate::nmt {

GuardingSlave::GuardingSlave(const od::Dictionary& dictionary, can::TransmitQueue& transmit,
                             EventLog& events, LifeGuardingListener& listener, std::uint8_t node_id)
    : dictionary_(dictionary),
      transmit_(transmit),
      events_(events),
      listener_(listener),
      node_id_(node_id) {
}

void GuardingSlave::configure() {
  toggle_ = std::byte{0};
  lost_ = false;
  deadline_ = kNever;
}

void GuardingSlave::request(Instant now) {
  if (state_ == State::initialising || has_heartbeat()) {
    return;
  }
  if (now > deadline_) {
    lose();
  }
  const auto answer = toggle_ | static_cast<std::byte>(state_);
  if (transmit_.push(can::TransmitClass::error_control,
                     can::make_frame(can::kErrorControlBase + node_id_, {&answer, 1}))) {
    toggle_ ^= kToggleBit;
  }
  const Duration life = life_time();
  deadline_ = life > Duration::zero() && !suspended_ ? now + life : kNever;
  if (std::exchange(lost_, false)) {
    recover(now);
  }
}

void GuardingSlave::advance(Instant now) {
  if (deadline_ <= now) {
    lose();
  }
}

void GuardingSlave::written(od::Address /*address*/) {
  deadline_ = kNever;
}

bool GuardingSlave::has_heartbeat() const {
  return dictionary_.number({od::objects::kProducerHeartbeatTime, 0}).value_or(0) != 0;
}

Duration GuardingSlave::life_time() const {
  const std::uint64_t guard_time =
      dictionary_.number({od::objects::kGuardTime, 0}).value_or(0) & 0xFFFFU;
  const std::uint64_t factor =
      dictionary_.number({od::objects::kLifeTimeFactor, 0}).value_or(0) & 0xFFU;
  return std::chrono::milliseconds(guard_time * factor);
}

void GuardingSlave::lose() {
  const Instant deadline = std::exchange(deadline_, kNever);
  if (has_heartbeat()) {
    return;  // the error control was changed meanwhile
  }
  lost_ = true;
  events_.emit({.time = deadline,
                .node = node_id_,
                .data = event::HeartbeatLost{
                    .by = event::ErrorControl::life_guarding,
                    .time = std::chrono::duration_cast<std::chrono::milliseconds>(life_time())}});
  listener_.life_guarding_lost(deadline);
}

void GuardingSlave::recover(Instant now) {
  events_.emit({.time = now, .node = node_id_, .data = event::HeartbeatRecovered{state_}});
  listener_.life_guarding_recovered(now);
}

}  // namespace linegate::nmt

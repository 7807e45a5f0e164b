// SPDX-License-Identifier: Apache-2.0
#include "stack/time/service.h"

#include "stack/base/assert.h"
#include "stack/base/byte_order.h"
#include "stack/base/time.h"
#include "stack/can/cob_id.h"
#include "stack/od/objects.h"

namespace linegate::time {
namespace {

constexpr std::uint32_t kIdentifierBits = 0x3FFF'FFFF;  // with the frame format

// Without bits 30 and 31, whose meaning depends on the object.
can::CobId identifier(can::CobId cob_id) {
  return {cob_id.raw & kIdentifierBits};
}

}  // namespace

Service::Service(const od::Dictionary& dictionary, can::Dispatch& dispatch,
                 can::TransmitQueue& transmit)
    : dictionary_(dictionary), dispatch_(dispatch), transmit_(transmit) {
}

Service::~Service() {
  register_cob_id(false);
}

void Service::configure() {
  const auto raw =
      static_cast<std::uint32_t>(dictionary_.number({od::objects::kTimeCobId, 0}).value_or(0));
  register_cob_id(false);
  cob_id_ = can::CobId{raw};
  if (!can::has_allowed_id(identifier(cob_id_))) {
    cob_id_ = can::CobId{0};
  }
  register_cob_id((cob_id_.raw & kConsumeBit) != 0);
  received_.reset();
  restart();
}

void Service::set_active(bool active) {
  if (active_ != active) {
    active_ = active;
    restart();
  }
}

void Service::produce_every(Duration period) {
  period_ = period;
  restart();
}

bool Service::send(const TimeOfDay& time) {
  return active_ && produces() &&
         transmit_.push(can::TransmitClass::time, encode(time, identifier(cob_id_)));
}

bool Service::receive(const can::Frame& frame) {
  if (!active_ || !is_registered_) {
    return true;
  }
  const std::optional<TimeOfDay> time = decode(frame);
  if (time) {
    received_ = Received{*time, frame.time};
  }
  return time.has_value();
}

std::optional<Duration> Service::network_utc(Instant now) const {
  if (!received_) {
    return std::nullopt;
  }
  return to_utc(received_->time) + (now - received_->at);
}

void Service::apply_writes(Instant now) {
  if (!anchored_) {
    anchored_ = true;
    next_ = now + period_;
  }
}

void Service::advance(Instant now) {
  apply_writes(now);
  if (next_ > now) {
    return;
  }
  LINEGATE_ASSERT(active_ && produces(), "only an active producer has a next TIME");
  next_ = next_after(next_, period_, now);
  if (!utc_offset_ || transmit_.queued(can::TransmitClass::time) != 0) {
    return;
  }
  if (const auto time = to_time_of_day(now.time_since_epoch() + *utc_offset_)) {
    send(*time);
  }
}

AbortCode Service::check_write(od::Address /*address*/, std::span<const std::byte> value) {
  const can::CobId wanted{static_cast<std::uint32_t>(load_le(value))};
  constexpr std::uint32_t kInUse = kConsumeBit | kProduceBit;
  const bool stays_in_use = (cob_id_.raw & kInUse) != 0 && (wanted.raw & kInUse) != 0;
  const bool changed = identifier(cob_id_) != identifier(wanted);
  if ((wanted.raw & kProduceBit) != 0 && !has_clock_ && period_ == Duration::zero()) {
    return AbortCode::invalid_value;
  }
  return (stays_in_use && changed) || !can::has_allowed_id(identifier(wanted))
             ? AbortCode::invalid_value
             : AbortCode::none;
}

void Service::written(od::Address /*address*/) {
  configure();
}

void Service::restart() {
  const bool runs = active_ && produces() && period_ > Duration::zero();
  anchored_ = !runs;
  next_ = runs ? Instant{} : kNever;
}

void Service::register_cob_id(bool wanted) {
  if (is_registered_) {
    dispatch_.remove(registered_.id(), registered_.extended(), can::Service::time, 0);
  }
  is_registered_ = wanted;
  if (wanted) {
    registered_ = identifier(cob_id_);
    dispatch_.add(registered_.id(), registered_.extended(), can::Service::time, 0);
  }
}

}  // namespace linegate::time

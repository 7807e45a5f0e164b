// SPDX-License-Identifier: Apache-2.0
#include "stack/nmt/heartbeat_producer.h"

#include "stack/base/assert.h"
#include "stack/base/time.h"
#include "stack/can/cob_id.h"
#include "stack/od/objects.h"

namespace linegate::nmt {

HeartbeatProducer::HeartbeatProducer(const od::Dictionary& dictionary, can::TransmitQueue& transmit,
                                     std::uint8_t node_id)
    : dictionary_(dictionary), transmit_(transmit), node_id_(node_id) {
}

void HeartbeatProducer::boot_up(Instant now) {
  LINEGATE_ASSERT(state_ == State::initialising, "the boot-up message ends the initialisation");
  read_period();
  restart_ = false;
  send(0x00);
  next_ = period_ > Duration{} ? now + period_ : kNever;
}

void HeartbeatProducer::apply_writes(Instant now) {
  if (restart_) {
    restart_ = false;
    send(static_cast<std::uint8_t>(state_));
    next_ = now + period_;
  }
}

void HeartbeatProducer::advance(Instant now) {
  apply_writes(now);
  if (next_ > now) {
    return;
  }
  if (transmit_.queued(can::TransmitClass::error_control) == 0) {
    send(static_cast<std::uint8_t>(state_));
  }
  next_ = next_after(next_, period_, now);
}

void HeartbeatProducer::written(od::Address) {
  if (state_ == State::initialising) {
    return;
  }
  read_period();
  restart_ = period_ > Duration{};
  next_ = restart_ ? Instant{} : kNever;
}

void HeartbeatProducer::read_period() {
  const std::uint64_t ms = dictionary_.number({od::objects::kProducerHeartbeatTime, 0}).value_or(0);
  period_ = std::chrono::milliseconds(ms);
}

void HeartbeatProducer::send(std::uint8_t content) {
  // A full queue means that the bus has been blocked for long; the next period retries.
  transmit_.push(can::TransmitClass::error_control,
                 can::make_frame(can::kErrorControlBase + node_id_, {content}));
}

}  // namespace linegate::nmt

// SPDX-License-Identifier: Apache-2.0
#include "stack/sync/producer.h"

#include "stack/base/assert.h"
#include "stack/base/time.h"

namespace linegate::sync {

Producer::Producer(can::TransmitQueue& transmit) : transmit_(transmit) {
}

void Producer::configure(const Parameters& parameters) {
  parameters_ = parameters;
  counter_ = 1;
  restart();
}

void Producer::set_active(bool active) {
  if (active_ != active) {
    active_ = active;
    counter_ = 1;
    restart();
  }
}

void Producer::apply_writes(Instant now) {
  if (!anchored_) {
    anchored_ = true;
    next_ = now + parameters_.period;
  }
}

std::optional<std::uint8_t> Producer::advance(Instant now) {
  apply_writes(now);
  if (next_ > now) {
    return std::nullopt;
  }
  LINEGATE_ASSERT(active_ && parameters_.is_producer(), "only an active producer has a next SYNC");
  next_ = next_after(next_, parameters_.period, now);
  if (transmit_.queued(can::TransmitClass::sync) != 0) {
    return std::nullopt;
  }
  const std::uint8_t counter = next_counter();
  can::Frame frame;
  frame.id = parameters_.cob_id.id();
  if (parameters_.cob_id.extended()) {
    frame.flags = can::Frame::kExtended;
  }
  frame.length = parameters_.length();
  frame.data[0] = std::byte{counter};
  transmit_.push(can::TransmitClass::sync, frame);
  return counter;
}

void Producer::restart() {
  const bool runs = active_ && parameters_.is_producer() && parameters_.period > Duration::zero();
  anchored_ = !runs;
  next_ = runs ? Instant{} : kNever;
}

std::uint8_t Producer::next_counter() {
  if (parameters_.overflow == 0) {
    return 0;
  }
  const std::uint8_t counter = counter_;
  counter_ =
      counter >= parameters_.overflow ? std::uint8_t{1} : static_cast<std::uint8_t>(counter + 1);
  return counter;
}

}  // namespace linegate::sync

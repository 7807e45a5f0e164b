#include "stack/sync/consumer.h"

#include <utility>

namespace linegate::sync {

Consumer::Consumer(can::Dispatch& dispatch, EventLog& events)
    : dispatch_(dispatch), events_(events) {
}

Consumer::~Consumer() {
  register_cob_id(false);
}

void Consumer::configure(const Parameters& parameters) {
  register_cob_id(false);
  parameters_ = parameters;
  register_cob_id(consumes());
  deadline_ = kNever;
  lost_ = false;
  length_was_wrong_ = false;
}

void Consumer::set_active(bool active) {
  active_ = active;
  deadline_ = kNever;
  lost_ = false;
}

Reception Consumer::receive(const can::Frame& frame) {
  if (!active_ || !consumes()) {
    return {};
  }
  Reception out;
  out.wrong_length = frame.length != parameters_.length();
  out.error_begins = !std::exchange(length_was_wrong_, out.wrong_length) && out.wrong_length;
  out.is_sync = frame.length <= 1;
  if (!out.is_sync) {
    return out;
  }
  if (!out.wrong_length && frame.length == 1) {
    const auto counter = std::to_integer<std::uint8_t>(frame.data[0]);
    out.wrong_counter = counter == 0 || counter > parameters_.overflow;
    out.counter = out.wrong_counter ? std::uint8_t{0} : counter;
  }
  if (frame.time > deadline_) {
    lose();
  }
  lost_ = false;
  if (parameters_.period > Duration::zero()) {
    deadline_ = frame.time + parameters_.period + parameters_.period / 2;
  }
  return out;
}

void Consumer::advance(Instant now) {
  if (deadline_ <= now) {
    lose();
  }
}

void Consumer::lose() {
  Event event;
  event.time = deadline_;
  event.kind = EventKind::sync_lost;
  event.value = static_cast<std::uint32_t>(
      std::chrono::duration_cast<std::chrono::microseconds>(parameters_.period).count());
  deadline_ = kNever;
  lost_ = true;
  events_.emit(event);
}

void Consumer::register_cob_id(bool wanted) {
  if (registered_ == wanted) {
    return;
  }
  registered_ = wanted;
  const can::CobId cob_id = parameters_.cob_id;
  if (wanted) {
    dispatch_.add(cob_id.id(), cob_id.extended(), can::Service::sync, 0);
  } else {
    dispatch_.remove(cob_id.id(), cob_id.extended(), can::Service::sync, 0);
  }
}

}  // namespace linegate::sync

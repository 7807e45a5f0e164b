// SPDX-License-Identifier: Apache-2.0
#include "stack/srdo/consumer.h"

#include <utility>

#include "stack/base/assert.h"

namespace linegate::srdo {
namespace {

// The target of a frame: twice the position of the source, one more for the inverted frame.
std::uint16_t target_of(std::size_t source, bool inverted) {
  return static_cast<std::uint16_t>(2 * source + (inverted ? 1U : 0U));
}

}  // namespace

Consumer::Consumer(can::Dispatch& dispatch, EventLog& events, Listener& listener,
                   std::vector<Source> sources)
    : events_(events), listener_(listener), sources_(std::move(sources)) {
  receivers_.reserve(sources_.size());
  for (std::size_t i = 0; i < sources_.size(); ++i) {
    const Source& source = sources_[i];
    receivers_.emplace_back(source.length, source.validation, source.cycle);
    dispatch.add(source.cob_id, false, can::Service::srdo, target_of(i, false));
    dispatch.add(source.inverted_cob_id, false, can::Service::srdo, target_of(i, true));
  }
}

bool Consumer::receive(std::uint16_t target, const can::Frame& frame) {
  const std::size_t source = source_of(target);
  LINEGATE_ASSERT(source < receivers_.size(), "the target is of this consumer");
  Receiver& receiver = receivers_[source];
  now_ = frame.time;
  expire(source, frame.time);
  const Fault before = receiver.fault();
  const bool complete = receiver.receive(frame, target % 2U != 0);
  if (complete) {
    ++counters_.pairs;
    listener_.srdo_received(source, receiver.normal());
  }
  follow(source, before, frame.time);
  return complete;
}

// A time that ended before the frame is reported, also if the frame completes a valid pair.
void Consumer::expire(std::size_t source, Instant received) {
  Receiver& receiver = receivers_[source];
  const Fault before = receiver.fault();
  if (receiver.next_wake() < received) {
    receiver.advance(received - Duration(1));
    follow(source, before, received);
  }
}

void Consumer::check_signature(std::size_t source, std::uint16_t found, Instant now) {
  const Fault before = receivers_[source].fault();
  receivers_[source].set_signature(sources_[source].signature.value_or(found) == found);
  follow(source, before, now);
}

void Consumer::advance(Instant now) {
  now_ = now;
  for (std::size_t i = 0; i < receivers_.size(); ++i) {
    const Fault before = receivers_[i].fault();
    receivers_[i].advance(now);
    follow(i, before, now);
  }
}

void Consumer::forget(std::size_t source) {
  const Fault before = receivers_[source].fault();
  receivers_[source].forget();
  follow(source, before, now_);
}

Instant Consumer::next_wake() const {
  Instant wake = kNever;
  for (const Receiver& receiver : receivers_) {
    wake = earlier(wake, receiver.next_wake());
  }
  return wake;
}

void Consumer::follow(std::size_t source, Fault before, Instant now) {
  const Fault fault = receivers_[source].fault();
  if (fault == before) {
    return;
  }
  if (before == Fault::none) {
    ++counters_.faults;
    listener_.srdo_unsafe(source);
  }
  events_.emit({.time = now,
                .node = sources_[source].node,
                .data = event::SrdoState{.fault = fault, .number = sources_[source].number}});
}

}  // namespace linegate::srdo

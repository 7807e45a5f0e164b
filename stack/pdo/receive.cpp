// RPDOs: from the frame to the values.
#include <chrono>

#include "stack/pdo/engine_impl.h"

namespace linegate::pdo {

[[gnu::always_inline]] inline void Engine::Impl::defer(std::uint16_t slot,
                                                       const can::Frame& frame) {
  Shadow& shadow = shadows[slot];
  std::memcpy(shadow.data.data(), frame.data.data(), shadow.data.size());
  shadow.time = frame.time;
  ++shadow.frames;
  deferred.set(slot);
  const bool attention = inputs->pdo(slot).attention > image::PdoState::kNotValid;
  if (attention || (rpdos[slot].flags & Rpdo::kLong) != 0) [[unlikely]] {
    defer_otherwise(slot, frame);
  }
}

// The ordinary frame comes first and calls nothing, so that it needs no stack; what is less
// frequent is called last.
void Engine::receive(std::uint16_t slot, const can::Frame& frame) {
  Impl& engine = *impl_;
  const Rpdo& pdo = engine.rpdos[slot];
  const std::uint16_t form = Rpdo::form(frame);
  if (form != pdo.at_once) {
    return form == pdo.deferred ? engine.defer(slot, frame) : engine.receive_otherwise(slot, frame);
  }
  image::Area& inputs = *engine.inputs;
  if (inputs.pdo(slot).attention != 0) [[unlikely]] {
    return engine.take(slot, frame.data.data(), frame.time, 1);
  }
  const auto word = load_le<std::uint64_t>(frame.data.data());
  inputs.merge(pdo.offset, pdo.to_image(word), pdo.mask);
  if ((pdo.flags & Rpdo::kMore) != 0) {
    return engine.take_rest(slot, frame);
  }
  inputs.touch(slot, frame.time);
  ++engine.counters.received;
  if (engine.listener != nullptr) {
    engine.listener->rpdo_received(static_cast<std::uint16_t>(slot + 1), frame.time);
  }
}

void Engine::Impl::take_rest(std::uint16_t slot, const can::Frame& frame) {
  copy_rest(slot, frame.data.data());
  finish(slot, frame.time, 1);
}

// data has room for a word at its begin.
inline void Engine::Impl::take(std::uint16_t slot, const std::byte* data, Instant time,
                               std::uint32_t frames) {
  const Rpdo& pdo = rpdos[slot];
  if (inputs->pdo(slot).attention != 0) [[unlikely]] {
    attend(slot, time);
  }
  inputs->merge(pdo.offset, pdo.to_image(load_le<std::uint64_t>(data)), pdo.mask);
  if ((pdo.flags & Rpdo::kMore) != 0) {
    copy_rest(slot, data);
  }
  finish(slot, time, frames);
}

void Engine::Impl::copy_rest(std::uint16_t slot, const std::byte* data) {
  const CopyPlan& plan = details[slot].plan;
  for (std::size_t i = 1; i < plan.runs.size(); ++i) {
    const Run& run = plan.runs[i];
    inputs->merge(run.offset, run.to_image(data), run.mask);
  }
  for (const ObjectRun& object : plan.objects) {
    object.to_object(data);
  }
}

inline void Engine::Impl::finish(std::uint16_t slot, Instant time, std::uint32_t frames) {
  inputs->touch(slot, time, frames);
  counters.received += frames;
  if (listener != nullptr) {
    listener->rpdo_received(static_cast<std::uint16_t>(slot + 1), time);
  }
}

void Engine::Impl::defer_otherwise(std::uint16_t slot, const can::Frame& frame) {
  attend_reception(slot, frame.time);
  if ((rpdos[slot].flags & Rpdo::kLong) != 0) {
    long_shadows[details[slot].long_shadow] = frame.data;
  }
}

// Values in the dictionary, lengths that are not the mapped one, and what is to be ignored.
void Engine::Impl::receive_otherwise(std::uint16_t slot, const can::Frame& frame) {
  const RpdoDetails& pdo = details[slot];
  if (!operational || !pdo.active || frame.remote()) {
    return;
  }
  if (frame.length < pdo.plan.bytes()) {
    ++counters.too_short;
    tell_length(slot, frame);
    return;
  }
  const std::size_t expected = frame.fd() ? can::fd_length(pdo.plan.bytes()) : pdo.plan.bytes();
  if (frame.length > expected) {
    ++counters.too_long;
    tell_length(slot, frame);
  }
  // Only a frame of the right length ends a wrong one.
  std::uint32_t& attention = inputs->pdo(slot).attention;
  const std::uint32_t told = frame.length > expected ? attention & kLengthTold : 0;
  attention &= ~told;
  if (is_synchronous(pdo.type)) {
    defer(slot, frame);
  } else {
    take(slot, frame.data.data(), frame.time, 1);
  }
  attention |= told;
}

void Engine::Impl::commit_rpdos() {
  deferred.take_all([this](std::uint16_t slot) {
    Shadow& shadow = shadows[slot];
    const bool is_long = (rpdos[slot].flags & Rpdo::kLong) != 0;
    const std::byte* data =
        is_long ? long_shadows[details[slot].long_shadow].data() : shadow.data.data();
    const std::uint64_t frames = std::exchange(shadow.frames, 0);
    take(slot, data, shadow.time, static_cast<std::uint32_t>(frames));
  });
}

// Validity begins when values are in place; all else concerns reception, which for synchronous
// RPDOs was earlier.
void Engine::Impl::attend(std::uint16_t slot, Instant time) {
  if ((inputs->pdo(slot).attention & image::PdoState::kNotValid) != 0) {
    const auto number = static_cast<std::uint16_t>(slot + 1);
    image.set_pdo_valid(image::Direction::inputs, number, true);
  }
  if (!is_synchronous(details[slot].type)) {
    attend_reception(slot, time);
  }
}

void Engine::Impl::attend_reception(std::uint16_t slot, Instant time) {
  std::uint32_t& attention = inputs->pdo(slot).attention;
  if ((attention & kTimedOut) != 0) {
    events.emit(event(EventKind::pdo_recovered, time, slot));
  }
  if ((attention & (kFirst | kTimedOut)) != 0 && details[slot].deadline > Duration::zero()) {
    timers.set(slot, time + details[slot].deadline);
  }
  const bool right_again = (attention & kLengthTold) != 0;
  attention &= image::PdoState::kNotValid;
  if (right_again) {
    tell_in_order(slot);
  }
}

void Engine::Impl::check_deadline(std::uint16_t slot, Instant now) {
  const RpdoDetails& pdo = details[slot];
  const Instant last = deferred.test(slot) ? shadows[slot].time : inputs->pdo(slot).last;
  const Instant due = last + pdo.deadline;
  if (due > now) {
    timers.set(slot, due);
    return;
  }
  inputs->pdo(slot).attention |= kTimedOut;
  Event timeout = event(EventKind::pdo_timeout, now, slot);
  timeout.value = static_cast<std::uint32_t>(
      std::chrono::duration_cast<std::chrono::milliseconds>(pdo.deadline).count());
  events.emit(timeout);
  if (listener != nullptr) {
    listener->rpdo_deadline(static_cast<std::uint16_t>(slot + 1));
  }
}

// Once until a frame of the right length comes: a device that is configured wrongly sends for ever.
void Engine::Impl::tell_length(std::uint16_t slot, const can::Frame& frame) {
  std::uint32_t& attention = inputs->pdo(slot).attention;
  if ((attention & kLengthTold) != 0) {
    return;
  }
  attention |= kLengthTold;
  const auto mapped = static_cast<unsigned>(details[slot].plan.bytes());
  Event told = event(EventKind::pdo_length, frame.time, slot);
  told.value = mapped;
  told.length = 1;
  told.data[0] = std::byte{frame.length};
  events.emit(told);
  if (listener != nullptr) {
    listener->rpdo_wrong_length(static_cast<std::uint16_t>(slot + 1), mapped, frame.length);
  }
}

void Engine::Impl::tell_in_order(std::uint16_t slot) {
  if (listener != nullptr) {
    listener->rpdo_in_order(static_cast<std::uint16_t>(slot + 1));
  }
}

Event Engine::Impl::event(EventKind kind, Instant time, std::uint16_t slot) const {
  Event out;
  out.time = time;
  out.kind = kind;
  out.code = slot + 1U;
  out.node = image.node_of(image::Direction::inputs, static_cast<std::uint16_t>(out.code));
  return out;
}

}  // namespace linegate::pdo

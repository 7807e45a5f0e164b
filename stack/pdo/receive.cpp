// RPDOs: from the frame to the values.
#include <chrono>

#include "stack/pdo/engine_impl.h"

namespace linegate::pdo {

void Engine::receive(std::uint16_t slot, const can::Frame& frame) {
  Impl& engine = *impl_;
  const Rpdo& pdo = engine.rpdos[slot];
  const std::uint16_t form = Rpdo::form(frame);
  if (form == pdo.at_once) {
    engine.take(slot, pdo, frame.data.data(), frame.time, 1);
  } else if (form == pdo.deferred) {
    engine.defer(slot, frame);
  } else {
    engine.receive_otherwise(slot, frame);
  }
}

inline void Engine::Impl::take(std::uint16_t slot, const Rpdo& pdo, const std::byte* data,
                               Instant time, std::uint32_t frames) {
  if (inputs->pdo(slot).attention != 0) [[unlikely]] {
    attend(slot, time);
  }
  inputs->merge(pdo.first.offset, pdo.first.to_image(data), pdo.first.mask);
  for (std::uint32_t i = pdo.more; i < pdo.more + pdo.more_count; ++i) {
    inputs->merge(runs[i].offset, runs[i].to_image(data), runs[i].mask);
  }
  inputs->touch(slot, time, frames);
  counters.received += frames;
  if (listener != nullptr) {
    listener->rpdo_received(static_cast<std::uint16_t>(slot + 1), time);
  }
}

inline void Engine::Impl::defer(std::uint16_t slot, const can::Frame& frame) {
  if ((inputs->pdo(slot).attention & ~image::PdoState::kNotValid) != 0) [[unlikely]] {
    attend_reception(slot, frame.time);
  }
  Shadow& shadow = shadows[slot];
  shadow.time = frame.time;
  shadow.word = load_le<std::uint64_t>(frame.data.data());
  ++shadow.frames;
  if (shadow.long_data != Shadow::kNone) [[unlikely]] {
    long_shadows[shadow.long_data] = frame.data;
  }
  deferred.set(slot);
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
    for (const ObjectRun& object : pdo.plan.objects) {
      object.to_object(frame.data.data());
    }
    take(slot, rpdos[slot], frame.data.data(), frame.time, 1);
  }
  attention |= told;
}

void Engine::Impl::commit_rpdos() {
  deferred.take_all([this](std::uint16_t slot) {
    Shadow& shadow = shadows[slot];
    const CopyPlan& plan = details[slot].plan;
    std::array<std::byte, sizeof shadow.word> word;
    store_le(word.data(), shadow.word);
    const std::byte* data =
        plan.bytes() > word.size() ? long_shadows[shadow.long_data].data() : word.data();
    for (const ObjectRun& object : plan.objects) {
      object.to_object(data);
    }
    take(slot, rpdos[slot], data, shadow.time, std::exchange(shadow.frames, 0));
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
  attention &= image::PdoState::kNotValid;
}

void Engine::Impl::check_deadline(std::uint16_t slot, Instant now) {
  const RpdoDetails& pdo = details[slot];
  const Instant last = std::max(inputs->pdo(slot).last, shadows[slot].time);
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

Event Engine::Impl::event(EventKind kind, Instant time, std::uint16_t slot) const {
  Event out;
  out.time = time;
  out.kind = kind;
  out.code = slot + 1U;
  out.node = image.node_of(image::Direction::inputs, static_cast<std::uint16_t>(out.code));
  return out;
}

}  // namespace linegate::pdo

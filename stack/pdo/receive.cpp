// SPDX-License-Identifier: Apache-2.0
// RPDOs: from the frame to the values.
#include <chrono>

#include "stack/pdo/engine_impl.h"

namespace linegate::pdo {

// Like receive_series(), but without its fixed cost, which exceeds that of a frame. Each of the two
// forms has a function of its own, which saves only the registers that it needs.
[[gnu::hot]] bool Engine::receive_alone(std::uint16_t slot, const can::Frame& frame,
                                        can::Traffic& traffic) {
  const std::uint8_t form = Rpdo::form(frame);
  const Rpdo& pdo = impl_->rpdos[slot];
  if (form == pdo.at_once) {
    return impl_->copy_alone(slot, frame, traffic);
  }
  return form == pdo.deferred && impl_->keep_alone(slot, frame, traffic);
}

[[gnu::hot, gnu::noinline]] bool Engine::Impl::copy_alone(std::uint16_t slot,
                                                          const can::Frame& frame,
                                                          can::Traffic& traffic) {
  if (inputs->pdo(slot).attention != 0 || hears_frames) {
    return false;
  }
  const Rpdo& pdo = rpdos[slot];
  traffic.add_standard(frame.length);
  ++counters.received;
  const auto word = load_le<std::uint64_t>(frame.data.data());
  inputs->receive(pdo.offset, pdo.to_image(word), pdo.mask, slot, frame.time);
  return true;
}

[[gnu::hot, gnu::noinline]] bool Engine::Impl::keep_alone(std::uint16_t slot,
                                                          const can::Frame& frame,
                                                          can::Traffic& traffic) {
  if (inputs->pdo(slot).attention > image::PdoState::kNotValid || hears_frames) {
    return false;
  }
  traffic.add_standard(frame.length);
  shadows.keep(slot, load_le<std::uint64_t>(frame.data.data()), frame.time);
  return true;
}

[[gnu::hot]] std::size_t Engine::receive_ordinary(std::span<const can::Frame> frames,
                                                  can::Traffic& traffic) {
  Impl& engine = *impl_;
  if (engine.hears_frames) {
    return 0;
  }
  const bool alone = frames.size() == 1 || !engine.is_for_rpdo(frames[1]);
  if (alone && !frames.front().extended()) {
    const can::Target* const target = engine.dispatch.find_standard(frames.front().id);
    return target != nullptr && target->alone_of(can::Service::rpdo) &&
                   receive_alone(target->index, frames.front(), traffic)
               ? 1
               : 0;
  }
  return engine.receive_series(frames, traffic);
}

// This loop makes no calls and changes only marks and values, so that everything else stays in
// registers; other cases are left to receive(). Aligned to a cache line: at other addresses a frame
// costs up to a fifth more.
[[gnu::hot, gnu::noinline, gnu::aligned(64)]] std::size_t Engine::Impl::receive_series(
    std::span<const can::Frame> frames, can::Traffic& traffic) {
  Shadows::Series waiting(shadows);
  image::Area::Series series(*inputs);
  can::Traffic taken;
  for (const can::Frame& frame : frames) {
    const can::Target* const target = dispatch.find(frame);
    if (target == nullptr || !target->alone_of(can::Service::rpdo)) {
      break;
    }
    const std::uint16_t slot = target->index;
    const Rpdo& pdo = rpdos[slot];
    const std::uint8_t form = Rpdo::form(frame);
    const std::uint32_t attention = series.pdo(slot).attention;
    const auto word = load_le<std::uint64_t>(frame.data.data());
    if (form == pdo.at_once && attention == 0) {
      series.merge(pdo.offset, pdo.to_image(word), pdo.mask);
      series.touch(slot, frame.time);
    } else if (form == pdo.deferred && attention <= image::PdoState::kNotValid) {
      waiting.keep(slot, word, frame.time);
    } else {
      break;
    }
    taken.add(frame.flags, frame.length);
  }
  traffic += taken;
  counters.received += series.touches();
  return taken.frames;
}

void Engine::receive(std::uint16_t slot, const can::Frame& frame) {
  Impl& engine = *impl_;
  const RpdoDetails& pdo = engine.details[slot];
  if (!pdo.active || frame.remote()) {
    return;
  }
  if (!engine.operational) {
    if (!pdo.is_srdo) {  // it may be unsafe at the entry into Operational
      engine.receive_early(slot, frame);
    }
    return;
  }
  if (pdo.mpdo != MpdoMode::none) {
    engine.receive_mpdo(slot, frame);
    return;
  }
  const std::size_t mapped = pdo.plan.bytes();
  const std::size_t expected = frame.fd() ? can::fd_length(mapped) : mapped;
  if (frame.length != expected) {
    engine.receive_wrong_length(slot, frame);
  } else if (is_synchronous(pdo.type)) {
    engine.defer(slot, frame);
  } else {
    engine.queue_reception(slot, frame);
    engine.take(slot, frame.data.data(), frame.time, 1);
  }
}

// Precondition: 8 bytes of data are readable.
void Engine::Impl::take(std::uint16_t slot, const std::byte* data, Instant time,
                        std::uint32_t frames) {
  const Rpdo& pdo = rpdos[slot];
  if (inputs->pdo(slot).attention != 0) [[unlikely]] {
    attend(slot, time);
  }
  inputs->merge(pdo.offset, pdo.to_image(load_le<std::uint64_t>(data)), pdo.mask);
  if ((pdo.flags & Rpdo::kMore) != 0) {
    copy_rest(slot, data);
  }
  inputs->touch(slot, time, frames);
  counters.received += frames;
  const bool watched = (pdo.flags & Rpdo::kWatched) != 0;
  if (hears_frames) {
    listener->rpdo_received(static_cast<std::uint16_t>(slot + 1), time);
  }
  if (watched) [[unlikely]] {
    notify_watched(slot);
  }
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

void Engine::Impl::defer(std::uint16_t slot, const can::Frame& frame) {
  if (frame.time > window_end) {
    ++counters.after_window;
    return;
  }
  keep(slot, frame);
  if (inputs->pdo(slot).attention > image::PdoState::kNotValid) {
    attend_reception(slot, frame.time);
  }
}

void Engine::Impl::keep(std::uint16_t slot, const can::Frame& frame) {
  queue_reception(slot, frame);
  const auto word = load_le<std::uint64_t>(frame.data.data());
  shadows.keep(slot, word, frame.time);
  if ((rpdos[slot].flags & Rpdo::kLong) != 0) {
    long_shadows[details[slot].long_shadow] = frame.data;
  }
}

void Engine::Impl::receive_wrong_length(std::uint16_t slot, const can::Frame& frame) {
  const bool too_short = frame.length < details[slot].plan.bytes();
  ++(too_short ? counters.too_short : counters.too_long);
  const can::CobId cob_id = details[slot].cob_id;
  const auto unchanged = [&] {  // whether the listener left the RPDO unchanged
    return slot < details.size() && details[slot].active && details[slot].cob_id == cob_id;
  };
  report_length(slot, frame);
  if (too_short || !unchanged()) {
    return;
  }
  // Only a frame of the right length clears the mark of a wrong length.
  const std::uint32_t mark = inputs->pdo(slot).attention & kLengthReported;
  inputs->pdo(slot).attention &= ~mark;
  if (is_synchronous(details[slot].type)) {
    defer(slot, frame);
  } else {
    queue_reception(slot, frame);
    take(slot, frame.data.data(), frame.time, 1);
  }
  if (unchanged()) {
    inputs->pdo(slot).attention |= mark;
  }
}

// Like commit_ordinary(), see receive_alone(). The shadow is read before anything is stored, field
// by field: one load over fields that were just stored separately would stall.
inline bool Engine::Impl::commit_one(const Shadow& shadow) {
  const std::uint32_t frames = shadow.frames;
  const std::uint16_t slot = shadow.slot;
  const Rpdo& pdo = rpdos[slot];
  if (frames == 0 || (pdo.flags & ~Rpdo::kQueued) != 0 || hears_frames ||
      inputs->pdo(slot).attention != 0) {
    return false;
  }
  counters.received += frames;
  inputs->receive(pdo.offset, pdo.to_image(shadow.word), pdo.mask, slot, shadow.time, frames);
  return true;
}

[[gnu::hot]] void Engine::Impl::commit_rpdos() {
  if (shadows.size() == 1 && commit_one(shadows[0])) {
    shadows.clear();
  } else {
    commit_each();
  }
}

[[gnu::hot, gnu::noinline]] void Engine::Impl::commit_each() {
  for (std::size_t next = commit_ordinary(0); next < shadows.size();
       next = commit_ordinary(next + 1)) {
    commit(Shadow(shadows[next]));  // a copy: the listener may change PDOs
  }
  shadows.clear();
}

// Like receive_series(). Returns the place where it stopped.
[[gnu::hot, gnu::aligned(64)]] std::size_t Engine::Impl::commit_ordinary(std::size_t from) {
  if (hears_frames || from >= shadows.size()) {  // the listener may have called configure()
    return from;
  }
  const std::span<const Shadow> waiting = shadows.from(from);
  const Rpdo* const pdos = rpdos.data();
  image::Area::Series series(*inputs);
  std::size_t taken = 0;
  for (const Shadow& shadow : waiting) {
    const Rpdo& pdo = pdos[shadow.slot];
    if (shadow.frames == 0 || (pdo.flags & ~Rpdo::kQueued) != 0 ||
        series.pdo(shadow.slot).attention != 0) {
      break;
    }
    series.merge(pdo.offset, pdo.to_image(shadow.word), pdo.mask);
    series.touch(shadow.slot, shadow.time, shadow.frames);
    ++taken;
  }
  counters.received += series.touches();
  return from + taken;
}

void Engine::Impl::commit(const Shadow& shadow) {
  if (shadow.frames == 0) {
    return;
  }
  std::array<std::byte, sizeof shadow.word> word{};
  store_le(word.data(), shadow.word);
  const bool is_long = (rpdos[shadow.slot].flags & Rpdo::kLong) != 0;
  take(shadow.slot, is_long ? long_shadows[details[shadow.slot].long_shadow].data() : word.data(),
       shadow.time, shadow.frames);
}

// Validity begins when the values are written; everything else concerns reception, which precedes
// that for synchronous RPDOs.
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
    report(slot, time, event::PdoRecovered{static_cast<std::uint16_t>(slot + 1)});
    if (listener != nullptr) {
      listener->rpdo_recovered(static_cast<std::uint16_t>(slot + 1));
    }
  }
  if ((attention & (kFirst | kTimedOut)) != 0 && details[slot].deadline > Duration::zero()) {
    timers.set(slot, time + details[slot].deadline);
  }
  const bool right_again = (attention & kLengthReported) != 0;
  attention &= image::PdoState::kNotValid;
  if (right_again) {
    report_valid_length(slot);
  }
}

void Engine::Impl::check_deadline(std::uint16_t slot, Instant now) {
  const RpdoDetails& pdo = details[slot];
  const Shadow* const shadow = shadows.find(slot);
  const Instant last = shadow != nullptr ? shadow->time : inputs->pdo(slot).last;
  const Instant due = last + pdo.deadline;
  if (due > now) {
    timers.set(slot, due);
    return;
  }
  inputs->pdo(slot).attention |= kTimedOut;
  report(slot, now,
         event::PdoTimeout{
             .number = static_cast<std::uint16_t>(slot + 1),
             .deadline = std::chrono::duration_cast<std::chrono::milliseconds>(pdo.deadline)});
  if (listener != nullptr) {
    listener->rpdo_deadline(static_cast<std::uint16_t>(slot + 1));
  }
}

[[gnu::hot]] bool Engine::timed_out(std::uint16_t rpdo) const {
  const image::Area& inputs = *impl_->inputs;
  return rpdo != 0 && rpdo <= inputs.pdos() && (inputs.pdo(rpdo - 1U).attention & kTimedOut) != 0;
}

// Reports a wrong length once until a frame of the right length arrives, because a misconfigured
// device sends continuously.
void Engine::Impl::report_length(std::uint16_t slot, const can::Frame& frame) {
  std::uint32_t& attention = inputs->pdo(slot).attention;
  if ((attention & kLengthReported) != 0) {
    return;
  }
  attention |= kLengthReported;
  const auto mapped = static_cast<unsigned>(details[slot].plan.bytes());
  report(slot, frame.time,
         event::PdoLength{.number = static_cast<std::uint16_t>(slot + 1),
                          .mapped = static_cast<std::uint16_t>(mapped),
                          .received = frame.length});
  if (listener != nullptr) {
    listener->rpdo_wrong_length(static_cast<std::uint16_t>(slot + 1), mapped, frame.length);
  }
}

void Engine::Impl::report_valid_length(std::uint16_t slot) {
  if (listener != nullptr) {
    listener->rpdo_in_order(static_cast<std::uint16_t>(slot + 1));
  }
}

void Engine::Impl::report(std::uint16_t slot, Instant time, const EventData& data) {
  const auto number = static_cast<std::uint16_t>(slot + 1);
  events.emit(
      {.time = time, .node = image.node_of(image::Direction::inputs, number), .data = data});
}

}  // namespace linegate::pdo

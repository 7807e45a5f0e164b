// SPDX-License-Identifier: Apache-2.0
// TPDOs: from the values to the frame.
//
// A TPDO is sampled when it is requested, into its only frame: always the newest sample is sent.
// rank is its position in the order of bus priority, so the lowest set bit is sent first.
#include "stack/base/assert.h"
#include "stack/can/cob_id.h"
#include "stack/image/network_variables.h"
#include "stack/pdo/engine_impl.h"

namespace linegate::pdo {
namespace {

// Bytes beyond the length of a frame are 0.
bool has_data(const can::Frame& frame, const std::array<std::byte, can::kMaxFdData>& data) {
  return frame.length <= can::kMaxClassicData
             ? load_le<std::uint64_t>(frame.data.data()) == load_le<std::uint64_t>(data.data())
             : frame.data == data;
}

}  // namespace

void Engine::set_auto_notify(std::uint16_t number, bool wanted) {
  if (number != 0 && number <= kMaxPdo) {
    impl_->auto_notify.set(number - 1U, wanted);
    impl_->follow_sources();
  }
}

void Engine::set_auto_notify(bool wanted) {
  impl_->auto_notify = wanted ? ~std::bitset<kMaxPdo>() : std::bitset<kMaxPdo>();
  impl_->follow_sources();
}

[[gnu::hot]] inline std::uint64_t Engine::Impl::gather_word(const Tpdo& pdo) const {
  std::uint64_t word = 0;
  for (const Run& run : std::span(pdo.runs, pdo.run_count)) {
    word |= run.to_frame(load_le<std::uint64_t>(outputs->data() + run.offset));
  }
  for (const ObjectRun& object : std::span(pdo.objects, pdo.object_count)) {
    word |= object.word() << object.frame_bit;
  }
  return word;
}

// Precondition: the engine and the TPDO are direct. Its other values are read, too: they may have
// changed without a request.
[[gnu::hot, gnu::always_inline]] inline void Engine::Impl::change(Tpdo& pdo) {
  __builtin_prefetch(&pdo.near_objects);
  std::uint64_t word = 0;
  for (const ObjectRun& object : std::span(pdo.objects, pdo.object_count)) {
    word |= load_le<std::uint64_t>(object.data) << object.frame_bit;
  }
  std::byte* const last = pdo.frame.data.data();
  ++pdo.samples;
  if (load_le<std::uint64_t>(last) != word || !pdo.sampled) {
    pdo.sampled = true;
    store_le(last, word);
    if (!pending.set(pdo.rank)) [[unlikely]] {
      ++counters.coalesced;
    }
  }
}

// The most frequent case makes no call, so that no registers have to be saved.
[[gnu::hot]] void Engine::Impl::changed(od::Address address, od::FollowMark mark) {
  if (operational && mark != od::kSharedMark) [[likely]] {
    Tpdo& pdo = tpdos[mark - 1U];
    if (direct && pdo.direct) [[likely]] {
      change(pdo);
      return;
    }
  }
  changed_otherwise(address, mark);
}

// Changes within before_tpdo() do not request that TPDO: it is being sampled, and its sample
// includes them.
[[gnu::noinline]] void Engine::Impl::changed_otherwise(od::Address address, od::FollowMark mark) {
  if (!operational) {
    return;
  }
  if (mark != od::kSharedMark) {
    const auto slot = static_cast<std::uint16_t>(mark - 1U);
    if (!tpdos[slot].asking) {
      source_changed(slot, false);
    }
    return;
  }
  object_sources.for_each(address, [this](std::uint16_t slot) {
    if (auto_notify[slot] && !tpdos[slot].asking) {
      source_changed(slot, false);
    }
  });
  if (!sources.empty()) {
    output_variable_changed(address);
  }
  if (source_tpdo && auto_notify[*source_tpdo] && scanner_list.contains(address)) {
    scanned_changed(address);
  }
}

[[gnu::hot]] bool Engine::set(const TpdoValue& value, std::uint64_t number) {
  Impl& engine = *impl_;
  const std::uint64_t word = number & value.mask_;
  if (value.revision_ != engine.direct_handles) [[unlikely]] {
    return engine.set_otherwise(value, word);
  }
  if (load_le<std::uint64_t>(value.data_) != word) {
    store_le(value.data_, word);
    engine.change(*value.pdo_);
  }
  return true;
}

bool Engine::Impl::set_otherwise(const TpdoValue& value, std::uint64_t word) {
  if (value.revision_ / 2 != revision) {
    return false;
  }
  if (load_le<std::uint64_t>(value.data_) != word) {
    store_le(value.data_, word);
    if (operational && !value.pdo_->asking) {
      source_changed(slot_of(*value.pdo_), false);
    }
  }
  return true;
}

void Engine::value_changed(od::Address address, Instant /*now*/) {
  if (!impl_->operational) {
    return;
  }
  impl_->object_sources.for_each(
      address, [this](std::uint16_t slot) { impl_->source_changed(slot, false); });
  if (impl_->source_tpdo && impl_->scanner_list.contains(address)) {
    impl_->scanned_changed(address);
  }
}

[[gnu::hot]] void Engine::Impl::mark_affected(std::uint32_t bit_offset, std::uint32_t bits) {
  constexpr std::uint32_t kLongest = 64;
  const std::uint32_t from = bit_offset < kLongest ? 0 : bit_offset - kLongest;
  auto it = std::ranges::lower_bound(sources, from, {}, &Source::begin);
  for (; it != sources.end() && it->begin < bit_offset + bits; ++it) {
    if (it->end > bit_offset) {
      affected.set(it->slot);
    }
  }
}

// A network variable (CiA 302-4) that shows bytes of the output area was written.
void Engine::Impl::output_variable_changed(od::Address address) {
  const std::optional<image::VariablePlace> place = image::variable_place(address);
  if (!place || place->direction != image::Direction::outputs) {
    return;
  }
  mark_affected(place->bit_offset, place->bit_length);
  affected.drain([this](std::uint16_t slot) {
    if (auto_notify[slot] && !tpdos[slot].asking) {
      source_changed(slot, false);
    }
  });
}

[[gnu::hot]] void Engine::outputs_written(std::uint32_t bit_offset, std::uint32_t bits, bool always,
                                          Instant /*now*/) {
  if (!impl_->operational) {
    return;
  }
  impl_->mark_affected(bit_offset, bits);
  impl_->affected.drain(
      [this, always](std::uint16_t slot) { impl_->source_changed(slot, always); });
}

[[gnu::hot]] void Engine::output_written(std::uint32_t entry, std::uint32_t bits, bool always,
                                         Instant now) {
  const image::Entry& place = impl_->image.layout(image::Direction::outputs).entries[entry];
  if (place.local_pdo == 0 || impl_->shares_outputs) {
    outputs_written(place.bit_offset, bits, always, now);
  } else if (impl_->operational) {
    impl_->source_changed(static_cast<std::uint16_t>(place.local_pdo - 1U), always);
  }
}

bool Engine::trigger(std::uint16_t number, Instant /*now*/) {
  const auto slot = static_cast<std::uint16_t>(number - 1U);
  if (!impl_->operational || number == 0 || number > impl_->tpdos.size() ||
      !impl_->tpdos[slot].active || impl_->tpdos[slot].mpdo != MpdoMode::none) {
    return false;
  }
  impl_->source_changed(slot, true);
  return true;
}

void Engine::hold() {
  impl_->held = true;
  impl_->follow_mode();
}

void Engine::release(Instant /*now*/) {
  impl_->release_held();
}

void Engine::Impl::release_held() {
  if (!std::exchange(held, false)) {
    return;
  }
  follow_mode();
  const auto release = [this](Bitmap& slots, bool always) {
    slots.drain([this, always](std::uint16_t slot) {
      if (tpdos[slot].mpdo != MpdoMode::none) {
        release_mpdos(tpdos[slot]);
      } else if (tpdos[slot].active) {
        source_changed(slot, always);
      }
    });
  };
  release(held_always, true);
  release(held_changed, false);
}

[[gnu::hot]] void Engine::Impl::source_changed(std::uint16_t slot, bool always) {
  Tpdo& pdo = tpdos[slot];
  if (!pdo.active || pdo.mpdo != MpdoMode::none) {  // for an MPDO each value is an event of its own
    return;
  }
  if (held) {
    (always ? held_always : held_changed).set(slot);
    return;
  }
  if (is_event_driven(pdo.type)) {
    request(slot, always);
  } else if (pdo.type == kSyncAcyclic) {
    pdo.event = true;
  }
}

[[gnu::hot]] bool Engine::Impl::held_back(std::uint16_t slot) const {
  return tpdos[slot].linked &&
         (!image.pdo_known(image::Direction::outputs, static_cast<std::uint16_t>(slot + 1)) ||
          receivers[tpdos[slot].node] == Receiver::unlike);
}

[[gnu::hot]] void Engine::Impl::ask(std::uint16_t slot) {
  if (hears_frames && !std::exchange(tpdos[slot].asking, true)) {
    listener->before_tpdo(static_cast<std::uint16_t>(slot + 1));
    tpdos[slot].asking = false;
  }
}

Engine::Impl::FrameData Engine::Impl::gather(const Tpdo& pdo) const {
  FrameData data{};
  if (pdo.is_word()) {
    store_le(data.data(), gather_word(pdo));
    return data;
  }
  for (const Run& run : pdo.plan.runs) {
    std::byte* const word = data.data() + run.frame_byte;
    const auto image_word = load_le<std::uint64_t>(outputs->data() + run.offset);
    store_le(word, load_le<std::uint64_t>(word) | run.to_frame(image_word));
  }
  for (const ObjectRun& object : pdo.plan.objects) {
    object.to_frame(data.data());
  }
  return data;
}

void Engine::Impl::replace_sample(std::uint16_t slot, const FrameData& data) {
  Tpdo& pdo = tpdos[slot];
  pdo.frame.data = data;
  if (unacknowledged.test(slot)) {
    under_way[slot].sampled(data, pdo.plan.bytes());
  }
}

[[gnu::hot]] bool Engine::Impl::sample(std::uint16_t slot) {
  ask(slot);
  Tpdo& pdo = tpdos[slot];
  ++pdo.samples;
  const bool fresh = !std::exchange(pdo.sampled, true);
  if (pdo.is_word() && awaiting == 0) [[likely]] {
    const std::uint64_t word = gather_word(pdo);
    std::byte* const last = pdo.frame.data.data();
    if (!fresh && load_le<std::uint64_t>(last) == word) {
      return false;
    }
    store_le(last, word);
  } else {
    const FrameData data = gather(pdo);
    if (!fresh && has_data(pdo.frame, data)) {
      return false;
    }
    replace_sample(slot, data);
  }
  counters.coalesced += pending.test(pdo.rank) ? 1U : 0U;
  return true;
}

[[gnu::hot]] void Engine::Impl::request(std::uint16_t slot, bool always) {
  if (!held_back(slot) && (sample(slot) || always)) {
    pending.set(tpdos[slot].rank);
  }
}

void Engine::Impl::sample_tpdos(std::uint8_t counter) {
  for (const std::uint16_t slot : sync_tpdos) {
    Tpdo& pdo = tpdos[slot];
    if (pdo.type == kRtrOnSync) {
      sample(slot);
      pdo.of_sync = true;
    } else if (due_at_sync(pdo, counter)) {
      request(slot, true);
      pdo.of_sync = pdo.sampled;
    } else if (pending.test(pdo.rank) && !held_back(slot)) {
      sample(slot);  // waiting since an earlier SYNC
    }
  }
}

// Events since the SYNC was queued belong to this SYNC.
void Engine::Impl::sample_again() {
  for (const std::uint16_t slot : sync_tpdos) {
    Tpdo& pdo = tpdos[slot];
    if (pdo.type == kRtrOnSync) {
      sample(slot);
    } else if (pdo.type == kSyncAcyclic && std::exchange(pdo.event, false)) {
      request(slot, true);
      pdo.of_sync = pdo.sampled;
    } else if (pending.test(pdo.rank) && !held_back(slot)) {
      sample(slot);
    }
  }
}

// With a SYNC start value, the SYNC that carries it is the first one counted.
bool Engine::Impl::due_at_sync(Tpdo& pdo, std::uint8_t counter) const {
  if (pdo.type == kSyncAcyclic) {
    return std::exchange(pdo.event, false);
  }
  pdo.counting = pdo.counting || pdo.sync_start == 0 || counter == 0 || counter == pdo.sync_start;
  if (!pdo.counting || ++pdo.syncs < pdo.type) {
    return false;
  }
  pdo.syncs = 0;
  return true;
}

void Engine::Impl::on_event_timer(std::uint16_t slot, Instant now) {
  request(slot, true);
  timers.set(event_timer(slot), now + tpdos[slot].event_timer);
}

// Ends inhibit times that have passed.
void Engine::Impl::release(Instant now) {
  next_release = kNever;
  for_each_bit(inhibited.words(), [this, now](std::size_t rank) {
    const Instant until = tpdos[by_rank[rank]].inhibited_until;
    if (until <= now) {
      inhibited.clear(rank);
    } else {
      next_release = earlier(next_release, until);
    }
  });
}

inline std::size_t Engine::Impl::first_ready() const {
  return pending.first_except(inhibited);
}

// Ends inhibit times and the window after SYNC.
[[gnu::hot]] inline void Engine::Impl::end_times(Instant now) {
  if (now >= next_release || (window_open && now >= window_end)) [[unlikely]] {
    close_window(now);
    release(now);
  }
}

[[gnu::hot, gnu::always_inline]] inline bool Engine::Impl::send_plain(const Tpdo& pdo,
                                                                      can::Frame& out,
                                                                      can::Traffic& sent) {
  const can::Header header{pdo.frame.id, pdo.frame.length, pdo.frame.flags};
  out.id = header.id;
  out.length = header.length;
  out.flags = header.flags;
  store_le(out.data.data(), load_le<std::uint64_t>(pdo.frame.data.data()));
  sent.add_standard(header.length);
  ++counters.sent;
  return true;
}

[[gnu::hot, gnu::noinline]] bool Engine::Impl::send(std::size_t rank, can::Frame& out, Instant now,
                                                    std::uint64_t number, can::Traffic& sent) {
  const std::uint16_t slot = by_rank[rank];
  Tpdo& pdo = tpdos[slot];
  const can::Header header = can::copy_content(pdo.frame, out);
  sent.add(header.flags, header.length);
  ++counters.sent;
  outputs->touch(slot, now);
  if (has_untransmitted(slot, pdo)) {
    frame_number = number;
    note_transmission(slot);
  }
  if (pdo.timed) {
    start_times(slot, now);
  }
  if (pdo.mpdo != MpdoMode::none) {
    next_mpdo(slot, number);
  }
  return true;
}

[[gnu::hot]] bool Engine::next_frame(can::Frame& out, Instant now, std::uint64_t number) {
  can::Traffic ignored;
  return next_frame(out, now, number, ignored);
}

// The most frequent case is handled inline; a call is only the last step.
[[gnu::hot]] bool Engine::next_frame(can::Frame& out, Instant now, std::uint64_t number,
                                     can::Traffic& sent) {
  Impl& engine = *impl_;
  const bool in_order = now < engine.next_release && !engine.window_open && asking_ == 0 &&
                        engine.pending.one_to_one();
  if (!in_order) [[unlikely]] {
    return engine.next_frame_in_turn(out, now, number, sent);
  }
  const std::size_t rank = engine.pending.pop_first_except(engine.inhibited);
  if (rank == Impl::kNoRank) {
    return false;
  }
  const Tpdo& pdo = *engine.ranked[rank];
  return pdo.plain ? engine.send_plain(pdo, out, sent) : engine.send(rank, out, now, number, sent);
}

[[gnu::noinline]] bool Engine::Impl::next_frame_in_turn(can::Frame& out, Instant now,
                                                        std::uint64_t number, can::Traffic& sent) {
  end_times(now);
  const std::size_t rank = first_ready();
  if (asked.any() && next_remote_frame(out, rank)) {
    sent.add(out);
    return true;
  }
  if (rank == kNoRank) {
    return false;
  }
  pending.clear(rank);
  return send(rank, out, now, number, sent);
}

bool Engine::Impl::peek(can::Frame& out, Instant now) {
  end_times(now);
  const std::size_t rank = first_ready();
  const bool asks = asked.any();
  if (asks) {
    (void)first_remote_frame(out);
  }
  if (rank == kNoRank) {
    return asks;
  }
  const can::Frame& frame = tpdos[by_rank[rank]].frame;
  if (!asks || can::wins_arbitration(frame, out)) {
    out.id = frame.id;
    out.flags = frame.flags;
  }
  return true;
}

// Starts the times that begin with a frame.
void Engine::Impl::start_times(std::uint16_t slot, Instant now) {
  Tpdo& pdo = tpdos[slot];
  if (pdo.inhibit > Duration::zero()) {
    pdo.inhibited_until = now + pdo.inhibit;
    inhibited.set(pdo.rank);
    next_release = earlier(next_release, pdo.inhibited_until);
  }
  if (has_event_timer(pdo)) {
    timers.set(event_timer(slot), now + pdo.event_timer);
  }
}

// A value written after the last sample is not in the frame.
bool Engine::Impl::is_newest(std::uint16_t slot) const {
  const Tpdo& pdo = tpdos[slot];
  return pdo.active && !held_back(slot) && has_data(pdo.frame, gather(pdo));
}

bool Engine::Impl::shows_newest(std::uint16_t slot) const {
  return tpdos[slot].linked && is_newest(slot);
}

// Whether the receiver counts as taking the frame.
[[gnu::hot]] bool Engine::Impl::is_taken(std::uint16_t slot) const {
  const Receiver state = receivers[tpdos[slot].node];
  return state == Receiver::unknown || state == Receiver::started;
}

// Of a TPDO that is not linked the listener knows.
[[gnu::hot]] inline bool Engine::Impl::has_untransmitted(std::uint16_t slot,
                                                         const Tpdo& pdo) const {
  return pdo.linked ? (outputs->pdo(slot).attention & image::PdoState::kNotValid) != 0
                    : reports_transmission && pdo.mpdo == MpdoMode::none;
}

void Engine::Impl::forget_transmission() {
  for (std::size_t slot = 0; reports_transmission && slot < tpdos.size(); ++slot) {
    if (!tpdos[slot].linked) {
      unacknowledged.clear(slot);
      under_way[slot].clear();
    }
  }
  mpdos_under_way.clear();
}

// Precondition: has_untransmitted().
[[gnu::hot]] void Engine::Impl::note_transmission(std::uint16_t slot) {
  const Tpdo& pdo = tpdos[slot];
  if (!is_taken(slot) || held_back(slot)) {
    return;
  }
  if (frame_number != 0) {
    under_way[slot].handed_out(frame_number, pdo.frame.data);
    unacknowledged.set(slot);
    return;
  }
  FrameData differs = gather(pdo);
  for (std::size_t i = 0; i < differs.size(); ++i) {
    differs[i] ^= pdo.frame.data[i];
  }
  confirm(slot, differs);
}

// The receivers have the present values except those bits of the frame.
[[gnu::hot]] void Engine::Impl::confirm(std::uint16_t slot, const FrameData& differs) {
  const auto number = static_cast<std::uint16_t>(slot + 1);
  if (!tpdos[slot].linked) {
    if (listener != nullptr) {
      listener->tpdo_transmitted(number, differs);
    }
    return;
  }
  if (differs == FrameData{}) {
    image.set_pdo_valid(image::Direction::outputs, number, true);
    return;
  }
  const std::vector<image::Entry>& entries = image.layout(image::Direction::outputs).entries;
  const auto range = image.entries_of(image::Direction::outputs, number);
  for (std::uint32_t entry = range.first; entry < range.first + range.count; ++entry) {
    if (!tpdos[slot].plan.reaches(differs.data(), entries[entry].bit_offset,
                                  entries[entry].bit_length)) {
      image.set_entry_valid(image::Direction::outputs, entry, true);
    }
  }
}

[[gnu::hot]] void Engine::Impl::acknowledged(std::uint64_t number) {
  for_each_bit(unacknowledged.words(), [&](std::size_t bit) {
    const auto slot = static_cast<std::uint16_t>(bit);
    const Tpdo& pdo = tpdos[slot];
    if (pdo.mpdo != MpdoMode::none) {
      mpdos_acknowledged(number);
      if (mpdos_under_way.empty()) {
        unacknowledged.clear(bit);
      }
      return;
    }
    FrameData differs;
    const bool had_some = under_way[slot].acknowledged(number, gather(pdo), differs);
    if (!under_way[slot].any()) {
      unacknowledged.clear(bit);
    }
    if (!had_some) {
      return;
    }
    if (pdo.active && is_taken(slot) && !held_back(slot)) {
      confirm(slot, differs);
    }
  });
}

void Engine::Impl::lost(std::uint64_t first, std::uint64_t last) {
  for_each_bit(unacknowledged.words(), [&](std::size_t bit) {
    const auto slot = static_cast<std::uint16_t>(bit);
    const Tpdo& pdo = tpdos[slot];
    if (pdo.mpdo != MpdoMode::none) {
      mpdos_lost(first, last);
      return;
    }
    if (!under_way[slot].any_of(first, last)) {
      return;
    }
    unacknowledged.clear(bit);
    under_way[slot].clear();
    if (operational && pdo.active && receivers[pdo.node] != Receiver::waiting) {
      source_changed(slot, true);
    }
  });
}

[[gnu::hot]] void Engine::acknowledged(std::uint64_t number) {
  if (impl_->awaiting != 0) {
    impl_->acknowledged(number);
  }
}

void Engine::lost(std::uint64_t first, std::uint64_t last) {
  impl_->lost(first, last);
}

void Engine::Impl::set_receiver(std::uint8_t node, Receiver state) {
  const Receiver before = std::exchange(receivers[node], state);
  if (before == state) {
    return;
  }
  for (const LinkedPdo& link : linked_tpdos) {
    const auto slot = static_cast<std::uint16_t>(link.parameters.number - 1U);
    const bool own = link.node == node;
    const bool kept_from_others = own && before == Receiver::unlike && !link.also.empty();
    if (own && slot < tpdos.size()) {
      under_way[slot].clear();
    }
    if (own && state == Receiver::unlike && slot < tpdos.size() && tpdos[slot].active) {
      pending.clear(tpdos[slot].rank);
    }
    if (own && state != Receiver::unknown && state != Receiver::started) {
      image.set_pdo_valid(image::Direction::outputs, link.parameters.number, false);
    }
    const bool receives = own || std::ranges::find(link.also, node) != link.also.end();
    if ((kept_from_others || (receives && state == Receiver::started)) && operational &&
        slot < tpdos.size() && tpdos[slot].active) {
      source_changed(slot, true);
    }
  }
}

void Engine::set_receiver(std::uint8_t node, Receiver state) {
  LINEGATE_ASSERT(node >= can::kMinNodeId && node <= can::kMaxNodeId, "the node-ID is 1..127");
  impl_->set_receiver(node, state);
}

Engine::Receiver Engine::receiver(std::uint8_t node) const {
  return impl_->receivers[node];
}

}  // namespace linegate::pdo

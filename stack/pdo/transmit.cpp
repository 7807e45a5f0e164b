// SPDX-License-Identifier: Apache-2.0
// TPDOs: from the values to the frame.
//
// A TPDO is sampled when it is requested, into its one frame: what is sent is always the newest
// sample. rank is its place in the order of the bus, so the lowest set bit goes first.
#include "stack/base/assert.h"
#include "stack/can/cob_id.h"
#include "stack/image/network_variables.h"
#include "stack/pdo/engine_impl.h"

namespace linegate::pdo {
namespace {

// What is beyond the length of a frame is 0.
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

// A TPDO whose values the listener refreshes is being sampled: they are in it.
void Engine::Impl::changed(od::Address address) {
  if (!operational) {
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

// A network variable of CiA 302-4, which shows bytes of the output area.
void Engine::Impl::output_variable_changed(od::Address address) {
  const std::optional<image::VariablePlace> place = image::variable_place(address);
  if (!place || place->direction != image::Direction::outputs) {
    return;
  }
  mark_affected(place->bit_offset, place->bit_length);
  affected.take_all([this](std::uint16_t slot) {
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
  impl_->affected.take_all(
      [this, always](std::uint16_t slot) { impl_->source_changed(slot, always); });
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

void Engine::remote_request(std::uint16_t slot, Instant /*now*/) {
  if (!impl_->operational || slot >= impl_->tpdos.size()) {
    return;
  }
  const Tpdo& pdo = impl_->tpdos[slot];
  const bool rtr_allowed = (pdo.cob_id.raw & can::CobId::kNoRtrBit) == 0;
  if (!pdo.active || pdo.mpdo != MpdoMode::none || !rtr_allowed || impl_->held_back(slot)) {
    return;
  }
  // What is sampled at SYNC answers with the sample of the last one; before the first SYNC there is
  // none.
  const bool at_sync = is_synchronous(pdo.type) || pdo.type == kRtrOnSync;
  if (!at_sync || !pdo.of_sync) {
    impl_->sample(slot);
  }
  impl_->pending.set(pdo.rank);
}

void Engine::hold() {
  impl_->held = true;
}

void Engine::release(Instant /*now*/) {
  impl_->release_held();
}

bool Engine::request_rpdo(std::uint16_t number) {
  const auto slot = static_cast<std::uint16_t>(number - 1U);
  if (!impl_->operational || number == 0 || number > impl_->details.size()) {
    return false;
  }
  const RpdoDetails& pdo = impl_->details[slot];
  const bool rtr_allowed =
      pdo.mpdo == MpdoMode::none && (pdo.cob_id.raw & can::CobId::kNoRtrBit) == 0;
  if (!pdo.active || !rtr_allowed || impl_->max_bytes > can::kMaxClassicData) {
    return false;
  }
  impl_->asked.set(slot);
  return true;
}

void Engine::Impl::release_held() {
  if (!std::exchange(held, false)) {
    return;
  }
  const auto take = [this](Bitmap& slots, bool always) {
    slots.take_all([this, always](std::uint16_t slot) {
      if (tpdos[slot].mpdo != MpdoMode::none) {
        release_mpdos(tpdos[slot]);
      } else if (tpdos[slot].active) {
        source_changed(slot, always);
      }
    });
  };
  take(held_always, true);
  take(held_changed, false);
}

[[gnu::hot]] void Engine::Impl::source_changed(std::uint16_t slot, bool always) {
  Tpdo& pdo = tpdos[slot];
  if (pdo.mpdo != MpdoMode::none) {
    return;  // has an event for each of its values
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

bool Engine::Impl::held_back(std::uint16_t slot) const {
  return tpdos[slot].linked &&
         !image.pdo_known(image::Direction::outputs, static_cast<std::uint16_t>(slot + 1));
}

void Engine::Impl::ask(std::uint16_t slot) {
  if (listener != nullptr && !std::exchange(tpdos[slot].asking, true)) {
    listener->before_tpdo(static_cast<std::uint16_t>(slot + 1));
    tpdos[slot].asking = false;
  }
}

[[gnu::hot]] inline Engine::Impl::FrameData Engine::Impl::gather(const Tpdo& pdo) const {
  FrameData data{};
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

[[gnu::hot]] bool Engine::Impl::sample(std::uint16_t slot) {
  ask(slot);
  Tpdo& pdo = tpdos[slot];
  const FrameData data = gather(pdo);
  const bool fresh = !std::exchange(pdo.sampled, true);
  ++pdo.samples;
  const bool different = fresh || !has_data(pdo.frame, data);
  if (different) {
    pdo.frame.data = data;
    if (unacknowledged.test(slot)) {
      under_way[slot].sampled(data, pdo.plan.bytes());
    }
    counters.coalesced += pending.test(pdo.rank) ? 1U : 0U;
  }
  return different;
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
      sample(slot);  // it waits since an earlier SYNC
    }
  }
}

// What came up since the SYNC was queued belongs to it.
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

// Ends inhibit times that are over.
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
  for (std::size_t word = 0; word < pending.words().size(); ++word) {
    const std::uint64_t ready = pending.words()[word] & ~inhibited.words()[word];
    if (ready != 0) {
      return 64 * word + static_cast<std::size_t>(std::countr_zero(ready));
    }
  }
  return kNoRank;
}

// Inhibit times and the window after SYNC.
[[gnu::hot]] inline void Engine::Impl::end_times(Instant now) {
  if (now >= next_release || (window_open && now >= window_end)) [[unlikely]] {
    close_window(now);
    release(now);
  }
}

[[gnu::hot]] bool Engine::Impl::next_frame(can::Frame& out, Instant now) {
  end_times(now);
  const std::size_t rank = first_ready();
  return (rank != kNoRank || asked.any()) && send_one(rank, out, now);
}

[[gnu::hot]] bool Engine::Impl::send_one(std::size_t rank, can::Frame& out, Instant now) {
  if (asked.any() && next_remote_frame(out, rank)) {
    return true;
  }
  if (rank == kNoRank) {
    return false;
  }
  send(rank, out, now);
  return true;
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

// The most urgent one; gives the slot of its RPDO. Precondition: asked.any().
std::size_t Engine::Impl::first_remote_frame(can::Frame& out) const {
  LINEGATE_ASSERT_HOT(asked.any(), "a PDO is to be requested");
  std::size_t first = kNoRank;
  for_each_bit(asked.words(), [&](std::size_t slot) {
    const can::Frame frame = remote_frame(static_cast<std::uint16_t>(slot));
    if (first == kNoRank || can::wins_arbitration(frame, out)) {
      first = slot;
      out = frame;
    }
  });
  return first;
}

// If it goes before the TPDO of that rank.
bool Engine::Impl::next_remote_frame(can::Frame& out, std::size_t rank) {
  const std::size_t first = first_remote_frame(out);
  if (rank != kNoRank && can::wins_arbitration(tpdos[by_rank[rank]].frame, out)) {
    return false;
  }
  asked.clear(first);
  ++counters.asked;
  return true;
}

can::Frame Engine::Impl::remote_frame(std::uint16_t slot) const {
  const RpdoDetails& pdo = details[slot];
  can::Frame frame;
  frame.id = pdo.cob_id.id();
  frame.flags = can::Frame::kRemote;
  if (pdo.cob_id.extended()) {
    frame.flags |= can::Frame::kExtended;
  }
  frame.length = static_cast<std::uint8_t>(pdo.plan.bytes());
  return frame;
}

[[gnu::hot]] void Engine::Impl::send(std::size_t rank, can::Frame& out, Instant now) {
  const std::uint16_t slot = by_rank[rank];
  Tpdo& pdo = tpdos[slot];
  out = pdo.frame;
  pending.clear(rank);
  if (pdo.mpdo != MpdoMode::none) {
    next_mpdo(pdo);
  }
  ++counters.sent;
  outputs->touch(slot, now);
  if (pdo.linked && (outputs->pdo(slot).attention & image::PdoState::kNotValid) != 0) {
    note_transmission(slot);
  }
  if (pdo.inhibit > Duration::zero()) {
    pdo.inhibited_until = now + pdo.inhibit;
    inhibited.set(rank);
    next_release = earlier(next_release, pdo.inhibited_until);
  }
  if (has_event_timer(pdo)) {
    timers.set(event_timer(slot), now + pdo.event_timer);
  }
}

// A value that was written after the sample was taken is not in the frame.
bool Engine::Impl::is_newest(std::uint16_t slot) const {
  const Tpdo& pdo = tpdos[slot];
  return pdo.active && !held_back(slot) && has_data(pdo.frame, gather(pdo));
}

bool Engine::Impl::shows_newest(std::uint16_t slot) const {
  return tpdos[slot].linked && is_newest(slot);
}

// It is transmitted to a node that takes it.
bool Engine::Impl::is_taken(std::uint16_t slot) const {
  const Receiver state = receivers[tpdos[slot].node];
  return state == Receiver::unknown || state == Receiver::started;
}

// Not all of its values are valid.
void Engine::Impl::note_transmission(std::uint16_t slot) {
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

// The receivers have the values as they are but those bits of the frame.
void Engine::Impl::confirm(std::uint16_t slot, const FrameData& differs) {
  const auto number = static_cast<std::uint16_t>(slot + 1);
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

void Engine::Impl::acknowledged(std::uint64_t number) {
  for_each_bit(unacknowledged.words(), [&](std::size_t bit) {
    const auto slot = static_cast<std::uint16_t>(bit);
    const Tpdo& pdo = tpdos[slot];
    FrameData differs;
    const bool had_some = under_way[slot].acknowledged(number, gather(pdo), differs);
    if (!under_way[slot].any()) {
      unacknowledged.clear(bit);
    }
    if (!had_some) {
      return;
    }
    if (pdo.active && pdo.linked && is_taken(slot) && !held_back(slot)) {
      confirm(slot, differs);
    }
  });
}

void Engine::Impl::lost(std::uint64_t first, std::uint64_t last) {
  for_each_bit(unacknowledged.words(), [&](std::size_t bit) {
    const auto slot = static_cast<std::uint16_t>(bit);
    const Tpdo& pdo = tpdos[slot];
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

std::uint16_t Engine::first_tpdo(od::Address address) const {
  std::uint16_t first = 0;
  impl_->object_sources.for_each(address, [&first](std::uint16_t slot) {
    first = first == 0 ? static_cast<std::uint16_t>(slot + 1) : first;
  });
  return first;
}

std::uint64_t Engine::samples(std::uint16_t number) const {
  return number == 0 || number > impl_->tpdos.size() ? 0 : impl_->tpdos[number - 1U].samples;
}

bool Engine::carries_newest(std::uint16_t number, const can::Frame& frame,
                            std::uint64_t samples) const {
  const auto slot = static_cast<std::uint16_t>(number - 1U);
  if (number == 0 || number > impl_->tpdos.size() || !impl_->tpdos[slot].active) {
    return false;
  }
  const Tpdo& pdo = impl_->tpdos[slot];
  return can::same_content(frame, pdo.frame) && (pdo.samples > samples || impl_->is_newest(slot));
}

bool Engine::Impl::comes_by_itself(std::uint16_t slot) const {
  const Tpdo& pdo = tpdos[slot];
  if (is_event_driven(pdo.type)) {
    return has_event_timer(pdo);
  }
  return pdo.type != kSyncAcyclic || pdo.event || pending.test(pdo.rank);
}

bool Engine::awaits_trigger(std::uint16_t number, std::uint32_t bit_offset,
                            std::uint32_t bits) const {
  const auto slot = static_cast<std::uint16_t>(number - 1U);
  if (number == 0 || number > impl_->tpdos.size()) {
    return false;
  }
  const Tpdo& pdo = impl_->tpdos[slot];
  const bool held = impl_->held_changed.test(slot) || impl_->held_always.test(slot);
  if (!pdo.active || pdo.mpdo != MpdoMode::none || held || impl_->comes_by_itself(slot)) {
    return false;
  }
  if (!impl_->pending.test(pdo.rank) && !impl_->unacknowledged.test(slot)) {
    return true;
  }
  Impl::FrameData differs = impl_->gather(pdo);
  for (std::size_t i = 0; i < differs.size(); ++i) {
    differs[i] ^= pdo.frame.data[i];
  }
  return pdo.plan.reaches(differs.data(), bit_offset, bits);
}

void Engine::Impl::set_receiver(std::uint8_t node, Receiver state) {
  if (std::exchange(receivers[node], state) == state) {
    return;
  }
  for (const LinkedPdo& link : linked_tpdos) {
    const auto slot = static_cast<std::uint16_t>(link.parameters.number - 1U);
    const bool own = link.node == node;
    if (own && slot < tpdos.size()) {
      under_way[slot].clear();
    }
    if (own && (state == Receiver::waiting || state == Receiver::unheard)) {
      image.set_pdo_valid(image::Direction::outputs, link.parameters.number, false);
    }
    const bool receives = own || std::ranges::find(link.also, node) != link.also.end();
    if (receives && state == Receiver::started && operational && slot < tpdos.size() &&
        tpdos[slot].active) {
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

bool Engine::Impl::wants_to_send(Instant now) const {
  bool wants = asked.any();
  const bool closed = window_open && now >= window_end;  // as close_window() will find
  for_each_bit(pending.words(), [this, now, closed, &wants](std::size_t rank) {
    const Tpdo& pdo = tpdos[by_rank[rank]];
    const bool too_late = closed && is_synchronous(pdo.type);
    wants = wants || (!too_late && (!inhibited.test(rank) || pdo.inhibited_until <= now));
  });
  return wants;
}

// The end of the first inhibit time that holds up a request.
[[gnu::hot]] Instant Engine::Impl::next_sending() const {
  Instant first = kNever;
  for_each_bit(pending.words(), [this, &first](std::size_t rank) {
    if (inhibited.test(rank)) {
      first = earlier(first, tpdos[by_rank[rank]].inhibited_until);
    }
  });
  return first;
}

}  // namespace linegate::pdo

// SPDX-License-Identifier: Apache-2.0
// Multiplexed PDOs: from the frame to the addressed object, and back.
#include "stack/base/byte_order.h"
#include "stack/pdo/engine_impl.h"

namespace linegate::pdo {
namespace {

// The object of an MPDO in source address mode.
od::Address source_of(const MpdoData& data) {
  return {load_le<std::uint16_t>(data.data() + 1), std::to_integer<std::uint8_t>(data[3])};
}

}  // namespace

void Engine::Impl::receive_mpdo(std::uint16_t slot, const can::Frame& frame) {
  const std::optional<Mpdo> mpdo = decode_mpdo(frame);
  if (!mpdo || mpdo->mode != details[slot].mpdo) {
    ++counters.mpdos_malformed;
    if (listener != nullptr) {
      listener->mpdo_malformed(frame);
    }
    return;
  }
  const bool to_address = mpdo->mode == MpdoMode::destination;
  if (to_address && mpdo->node != 0 && mpdo->node != node_id) {
    return;
  }
  if (inputs->pdo(slot).attention != 0) {
    attend_reception(slot, frame.time);
  }
  inputs->touch(slot, frame.time, 1);
  ++counters.received;
  ++counters.mpdos_received;
  if (to_address) {
    store_mpdo(slot, *mpdo, mpdo->address, frame.time);
    return;
  }
  // A write may change the list.
  std::vector<od::Address>& places = mpdo_places;
  places.clear();
  dispatcher_list.for_each(mpdo->node, mpdo->address,
                           [&places](od::Address place) { places.push_back(place); });
  for (std::size_t i = 0; i < places.size(); ++i) {
    store_mpdo(slot, *mpdo, places[i], frame.time);
  }
}

void Engine::Impl::store_mpdo(std::uint16_t slot, const Mpdo& mpdo, od::Address place,
                              Instant time) {
  const auto number = static_cast<std::uint16_t>(slot + 1);
  AbortCode why = check_mpdo_object(dictionary, true, place);
  if (why == AbortCode::none) {
    const std::size_t size = od::byte_size(dictionary.find(place)->type);
    why = dictionary.write(place, std::span(mpdo.value).first(size));
  }
  if (why != AbortCode::none) {
    ++counters.mpdos_refused;
    details[slot].refused = mpdo.mode == MpdoMode::destination;
  }
  if (listener == nullptr) {
    return;
  }
  if (why != AbortCode::none) {
    listener->mpdo_refused(number, mpdo.mode, place, why);
  } else {
    details[slot].refused = false;
    listener->mpdo_received(number, place, time);
  }
}

AbortCode Engine::send_mpdo(std::uint16_t number, std::uint8_t consumer, od::Address destination) {
  const auto slot = static_cast<std::uint16_t>(number - 1U);
  if (!impl_->operational) {
    return AbortCode::device_state;
  }
  if (number == 0 || number > impl_->tpdos.size() ||
      impl_->tpdos[slot].mpdo != MpdoMode::destination) {
    return AbortCode::no_object;
  }
  if (consumer > can::kMaxNodeId) {
    return AbortCode::invalid_value;
  }
  return impl_->queue_mpdo(
      slot, {.mode = MpdoMode::destination, .node = consumer, .address = destination},
      impl_->tpdos[slot].sent_object);
}

AbortCode Engine::send_mpdo(od::Address source) {
  if (!impl_->source_tpdo || !impl_->scanner_list.contains(source)) {
    return AbortCode::no_object;
  }
  if (!impl_->operational) {
    return AbortCode::device_state;
  }
  return impl_->queue_mpdo(*impl_->source_tpdo,
                           {.mode = MpdoMode::source, .node = impl_->node_id, .address = source},
                           source);
}

// The queue has space for each object once, with its newest value, so no change is refused.
void Engine::Impl::scanned_changed(od::Address address) {
  (void)queue_mpdo(*source_tpdo, {.mode = MpdoMode::source, .node = node_id, .address = address},
                   address, std::max(kMpdosWaiting, scanned_objects));
}

AbortCode Engine::Impl::queue_mpdo(std::uint16_t slot, Mpdo mpdo, od::Address source,
                                   std::size_t most) {
  if (const AbortCode why = check_mpdo_object(dictionary, false, source); why != AbortCode::none) {
    return why;
  }
  ask(slot);
  const od::Variable variable = *dictionary.find(source);
  std::copy_n(variable.data, variable.size, mpdo.value.begin());
  Tpdo& pdo = tpdos[slot];
  if (held) {
    held_changed.set(slot);
    return put_mpdo(pdo.held_mpdos, pdo, encode(mpdo), most);
  }
  const AbortCode why = put_mpdo(pdo.mpdos, pdo, encode(mpdo), most);
  show_first_mpdo(pdo);
  return why;
}

// Replaces an older value for the same destination or from the same source.
AbortCode Engine::Impl::put_mpdo(std::vector<MpdoData>& waiting, const Tpdo& pdo,
                                 const MpdoData& data, std::size_t most) {
  constexpr std::size_t kHead = 4;  // bytes before the value
  const auto same = std::ranges::find_if(waiting, [&data](const MpdoData& other) {
    return std::equal(data.begin(), data.begin() + kHead, other.begin());
  });
  if (same != waiting.end()) {
    counters.coalesced += *same != data ? 1U : 0U;
    *same = data;
  } else if (pdo.mpdos.size() + pdo.held_mpdos.size() < most) {
    waiting.push_back(data);
  } else {
    return AbortCode::out_of_memory;
  }
  return AbortCode::none;
}

// There is space for all: held MPDOs count towards the limit.
void Engine::Impl::release_mpdos(Tpdo& pdo) {
  while (!pdo.held_mpdos.empty()) {
    const MpdoData data = pdo.held_mpdos.front();
    pdo.held_mpdos.erase(pdo.held_mpdos.begin());
    (void)put_mpdo(pdo.mpdos, pdo, data, SIZE_MAX);
  }
  show_first_mpdo(pdo);
}

void Engine::Impl::show_first_mpdo(Tpdo& pdo) {
  if (!pdo.mpdos.empty()) {
    std::ranges::copy(pdo.mpdos.front(), pdo.frame.data.begin());
    pdo.sampled = true;
    pending.set(pdo.rank);
  }
}

void Engine::drop_mpdos(std::span<const od::Address> sources) {
  for (Tpdo& pdo : impl_->tpdos) {
    const auto is_dropped = [&](const MpdoData& data) {
      return pdo.mpdo == MpdoMode::destination ||
             std::ranges::find(sources, source_of(data)) != sources.end();
    };
    const std::size_t dropped = std::erase_if(pdo.mpdos, is_dropped);
    (void)std::erase_if(pdo.held_mpdos, is_dropped);
    if (dropped != 0 && pdo.mpdos.empty()) {
      pdo.sampled = false;
      impl_->pending.clear(pdo.rank);
    } else if (dropped != 0) {
      impl_->show_first_mpdo(pdo);
    }
  }
  std::erase_if(impl_->mpdos_under_way, [&](const Impl::MpdoUnderWay& mpdo) {
    return std::ranges::find(sources, source_of(mpdo.data)) != sources.end();
  });
}

void Engine::Impl::next_mpdo(std::uint16_t slot, std::uint64_t number) {
  Tpdo& pdo = tpdos[slot];
  const MpdoData data = pdo.mpdos.front();
  pdo.mpdos.erase(pdo.mpdos.begin());
  show_first_mpdo(pdo);
  if (!reports_transmission || pdo.mpdo != MpdoMode::source) {
    return;
  }
  if (number == 0) {
    confirm_mpdo(data);
    return;
  }
  const auto older =
      std::ranges::find(mpdos_under_way, source_of(data),
                        [](const MpdoUnderWay& mpdo) { return source_of(mpdo.data); });
  if (older != mpdos_under_way.end()) {
    if (older->data != data) {  // otherwise the older frame suffices
      *older = {data, number};
    }
  } else {
    mpdos_under_way.push_back({data, number});
  }
  unacknowledged.set(slot);
}

std::optional<MpdoData> Engine::Impl::present_mpdo(od::Address source) const {
  const std::optional<od::Variable> variable = dictionary.find(source);
  if (!variable || check_mpdo_object(dictionary, false, source) != AbortCode::none) {
    return std::nullopt;
  }
  Mpdo mpdo{.mode = MpdoMode::source, .node = node_id, .address = source};
  std::copy_n(variable->data, variable->size, mpdo.value.begin());
  return encode(mpdo);
}

// The listener may request MPDOs.
void Engine::Impl::confirm_mpdo(const MpdoData& data) {
  if (listener != nullptr && present_mpdo(source_of(data)) == data) {
    listener->mpdo_transmitted(source_of(data));
  }
}

void Engine::Impl::mpdos_acknowledged(std::uint64_t number) {
  for (std::size_t i = 0; i < mpdos_under_way.size();) {
    const MpdoUnderWay mpdo = mpdos_under_way[i];
    if (mpdo.number > number) {
      ++i;
      continue;
    }
    mpdos_under_way[i] = mpdos_under_way.back();
    mpdos_under_way.pop_back();
    confirm_mpdo(mpdo.data);
  }
}

void Engine::Impl::mpdos_lost(std::uint64_t first, std::uint64_t last) {
  for (std::size_t i = 0; i < mpdos_under_way.size();) {
    const MpdoUnderWay mpdo = mpdos_under_way[i];
    if (mpdo.number < first || mpdo.number > last) {
      ++i;
      continue;
    }
    mpdos_under_way[i] = mpdos_under_way.back();
    mpdos_under_way.pop_back();
    if (operational) {
      scanned_changed(source_of(mpdo.data));
    }
  }
}

std::uint16_t Engine::scanning_tpdo() const {
  return impl_->source_tpdo ? static_cast<std::uint16_t>(*impl_->source_tpdo + 1)
                            : std::uint16_t{0};
}

can::CobId Engine::scanning_cob_id() const {
  return impl_->source_tpdo ? impl_->tpdos[*impl_->source_tpdo].cob_id
                            : can::CobId{can::CobId::kInvalidBit};
}

bool Engine::scans(od::Address source) const {
  return impl_->source_tpdo && impl_->scanner_list.contains(source) &&
         check_mpdo_object(impl_->dictionary, false, source) == AbortCode::none;
}

bool Engine::awaits_trigger(od::Address source) const {
  if (!scans(source)) {
    return false;
  }
  const MpdoData present = impl_->present_mpdo(source).value_or(MpdoData{});
  const Tpdo& pdo = impl_->tpdos[*impl_->source_tpdo];
  // The frame that is sent last decides.
  for (const std::vector<MpdoData>* const waiting : {&pdo.held_mpdos, &pdo.mpdos}) {
    const auto newest = std::ranges::find(*waiting, source, source_of);
    if (newest != waiting->end()) {
      return *newest != present;
    }
  }
  return std::ranges::find(impl_->mpdos_under_way, present, &Impl::MpdoUnderWay::data) ==
         impl_->mpdos_under_way.end();
}

}  // namespace linegate::pdo

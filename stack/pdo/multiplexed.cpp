// SPDX-License-Identifier: Apache-2.0
// Multiplexed PDOs: from the frame to the addressed object, and back.
#include "stack/base/byte_order.h"
#include "stack/pdo/engine_impl.h"

namespace linegate::pdo {

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
      const od::Address source{load_le<std::uint16_t>(data.data() + 1),
                               std::to_integer<std::uint8_t>(data[3])};
      return pdo.mpdo == MpdoMode::destination ||
             std::ranges::find(sources, source) != sources.end();
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
}

// The first waiting MPDO was sent.
void Engine::Impl::next_mpdo(Tpdo& pdo) {
  pdo.mpdos.erase(pdo.mpdos.begin());
  show_first_mpdo(pdo);
}

}  // namespace linegate::pdo

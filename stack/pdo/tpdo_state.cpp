// SPDX-License-Identifier: Apache-2.0
// Which TPDO sends a value, and which values are still to be sent.
#include "stack/pdo/engine_impl.h"

namespace linegate::pdo {

std::optional<TpdoValue> Engine::value(od::Address address) const {
  Impl& engine = *impl_;
  const std::optional<od::Variable> variable = engine.dictionary.find(address);
  std::size_t senders = 0;
  TpdoValue out;
  engine.object_sources.for_each(address, [&](std::uint16_t slot) {
    ++senders;
    out.pdo_ = &engine.tpdos[slot];
  });
  if (senders != 1 || !variable || !od::has_fixed_size(variable->type) ||
      variable->size > sizeof(std::uint64_t) || variable->hook != nullptr || variable->elsewhere ||
      (engine.source_tpdo && engine.scanner_list.contains(address))) {
    return std::nullopt;
  }
  out.data_ = variable->data;
  out.mask_ = ~std::uint64_t{0} >> (64 - 8 * variable->size);
  out.revision_ = engine.handles_of_direct_tpdos() + (out.pdo_->direct ? 0U : 1U);
  return out;
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

std::optional<Engine::Impl::FrameData> Engine::Impl::unrequested(std::uint16_t number) const {
  const auto slot = static_cast<std::uint16_t>(number - 1U);
  if (number == 0 || number > tpdos.size()) {
    return std::nullopt;
  }
  const Tpdo& pdo = tpdos[slot];
  const bool waits = held_changed.test(slot) || held_always.test(slot);
  if (!pdo.active || pdo.mpdo != MpdoMode::none || waits || comes_by_itself(slot)) {
    return std::nullopt;
  }
  FrameData differs;
  if (!pending.test(pdo.rank) && !unacknowledged.test(slot)) {
    differs.fill(std::byte{0xFF});
    return differs;
  }
  differs = gather(pdo);
  for (std::size_t i = 0; i < differs.size(); ++i) {
    differs[i] ^= pdo.frame.data[i];
  }
  return differs;
}

bool Engine::awaits_trigger(std::uint16_t number, std::uint32_t bit_offset,
                            std::uint32_t bits) const {
  const auto differs = impl_->unrequested(number);
  return differs && impl_->tpdos[number - 1U].plan.reaches(differs->data(), bit_offset, bits);
}

bool Engine::awaits_trigger(const SentObject& object) const {
  const auto differs = impl_->unrequested(object.tpdo);
  return differs && object.has_bit(*differs);
}

bool Engine::SentObject::has_bit(std::span<const std::byte> frame) const {
  for (unsigned bit = frame_bit; bit < frame_bit + unsigned{bits}; ++bit) {
    if ((frame[bit / 8] >> bit % 8 & std::byte{1}) != std::byte{}) {
      return true;
    }
  }
  return false;
}

std::vector<Engine::SentObject> Engine::sent_objects() const {
  std::vector<SentObject> out;
  for (std::size_t slot = 0; slot < impl_->tpdos.size(); ++slot) {
    const Tpdo& pdo = impl_->tpdos[slot];
    if (!pdo.active || pdo.linked || pdo.mpdo != MpdoMode::none) {
      continue;
    }
    const auto number = static_cast<std::uint16_t>(slot + 1);
    std::uint16_t bit = 0;
    for (const Mapping& mapping : read_mapping(impl_->dictionary, PdoKind::tpdo, number)) {
      if (!is_dummy(mapping)) {
        out.push_back({mapping.address, number, pdo.cob_id, bit, mapping.bits});
      }
      bit = static_cast<std::uint16_t>(bit + mapping.bits);
    }
  }
  return out;
}

bool Engine::Impl::wants_to_send(Instant now) const {
  bool wants = asked.any();
  const bool closed = window_open && now >= window_end;  // as close_window() will determine
  for_each_bit(pending.words(), [this, now, closed, &wants](std::size_t rank) {
    const Tpdo& pdo = tpdos[by_rank[rank]];
    const bool too_late = closed && is_synchronous(pdo.type);
    wants = wants || (!too_late && (!inhibited.test(rank) || pdo.inhibited_until <= now));
  });
  return wants;
}

// Returns the earliest end of an inhibit time that delays a request.
[[gnu::hot]] Instant Engine::Impl::next_sending() const {
  Instant first = kNever;
  if (!pending.any()) {
    return first;
  }
  for_each_bit(pending.words(), [this, &first](std::size_t rank) {
    if (inhibited.test(rank)) {
      first = earlier(first, tpdos[by_rank[rank]].inhibited_until);
    }
  });
  return first;
}

}  // namespace linegate::pdo

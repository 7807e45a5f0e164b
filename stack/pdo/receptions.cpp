// SPDX-License-Identifier: Apache-2.0
// The engine's part in queued receptions: see Engine::pop_reception().
#include "stack/pdo/engine_impl.h"

namespace linegate::pdo {
namespace {

// Copies `bits` bits (up to 512) of `from`, from bit `begin` on, to bit `to` of `out`.
// Precondition: all bits of `out` from there on are 0.
void append_bits(std::span<const std::byte> from, std::uint32_t begin, std::uint32_t bits,
                 std::span<std::byte> out, std::uint32_t to) {
  for (std::uint32_t i = 0; i < bits; ++i) {
    const bool set = (from[(begin + i) / 8] & std::byte{1} << ((begin + i) % 8)) != std::byte{};
    if (set) {
      out[(to + i) / 8] |= std::byte{1} << ((to + i) % 8);
    }
  }
}

}  // namespace

void Engine::Impl::assign_queues() {
  std::vector<ReceptionQueues::Wanted> wanted;
  for (const LinkedPdo& pdo : linked_rpdos) {
    if (pdo.queue != 0) {
      wanted.push_back({static_cast<std::uint16_t>(pdo.parameters.number - 1U), pdo.queue});
    }
  }
  receptions.assign(wanted);
  counters.receptions_lost = receptions.lost();
}

bool Engine::Impl::pop_reception(Reception& out) {
  ReceptionQueues::Raw raw;
  if (!receptions.pop(raw)) {
    return false;
  }
  const LinkedPdo& pdo = *linked(PdoKind::rpdo, static_cast<std::uint16_t>(raw.slot + 1U));
  const auto entries = image.entries_of(image::Direction::inputs, pdo.parameters.number);
  out.layout_id = image.layout(image::Direction::inputs).id;
  out.time = raw.time;
  out.first_entry = entries.first;
  out.entries = static_cast<std::uint16_t>(entries.count);
  out.local_pdo = pdo.parameters.number;
  out.remote_pdo = pdo.remote_pdo;
  out.node = pdo.node;
  out.lost = raw.lost;
  out.values.fill({});
  std::uint32_t bit = 0;
  for (const LinkTarget& target : pdo.targets) {
    append_bits(raw.data, target.frame_bit, target.bits, out.values, bit);
    bit += target.bits;
  }
  return true;
}

}  // namespace linegate::pdo

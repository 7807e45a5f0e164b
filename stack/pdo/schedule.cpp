// SPDX-License-Identifier: Apache-2.0
// Data derived from all PDOs together, and the beginning and end of Operational.
#include <numeric>

#include "stack/pdo/engine_impl.h"

namespace linegate::pdo {

void Engine::Impl::lay_out() {
  renew_revision();
  lay_out_rpdos();
  rank_tpdos();
  lay_out_objects();
  index_sources();
  open_rpdos();
}

void Engine::Impl::lay_out_rpdos() {
  for (std::size_t slot = 0; slot < rpdos.size(); ++slot) {
    const CopyPlan& plan = details[slot].plan;
    Rpdo& pdo = rpdos[slot];
    pdo = {};
    const bool more = plan.runs.size() > 1 || !plan.objects.empty();
    const bool is_long = plan.bytes() > can::kMaxClassicData;
    pdo.flags = static_cast<std::uint8_t>((more ? Rpdo::kMore : 0) | (is_long ? Rpdo::kLong : 0) |
                                          (details[slot].watched.empty() ? 0 : Rpdo::kWatched));
    const LinkedPdo* const link = linked(PdoKind::rpdo, static_cast<std::uint16_t>(slot + 1));
    if (link != nullptr && link->queue != 0 && details[slot].mpdo == MpdoMode::none) {
      pdo.flags |= Rpdo::kQueued;
    }
    if (!plan.runs.empty()) {
      pdo.mask = plan.runs.front().mask;
      pdo.offset = plan.runs.front().offset;
      pdo.rotate = plan.runs.front().rotate;
    }
  }
}

// Requests are kept: they move with their TPDO to its new rank.
void Engine::Impl::rank_tpdos() {
  std::vector<bool> was_pending(tpdos.size());
  std::vector<bool> was_inhibited(tpdos.size());
  for (std::size_t rank = 0; rank < by_rank.size() && rank < tpdos.size(); ++rank) {
    if (by_rank[rank] < tpdos.size()) {
      was_pending[by_rank[rank]] = pending.test(rank);
      was_inhibited[by_rank[rank]] = inhibited.test(rank);
    }
  }
  by_rank.resize(tpdos.size());
  std::iota(by_rank.begin(), by_rank.end(), std::uint16_t{0});
  std::ranges::stable_sort(by_rank, [this](std::uint16_t a, std::uint16_t b) {
    return can::wins_arbitration(tpdos[a].frame, tpdos[b].frame);
  });
  ranked.clear();
  for (const std::uint16_t slot : by_rank) {
    ranked.push_back(&tpdos[slot]);
  }
  pending.reset(tpdos.size());
  inhibited.reset(tpdos.size());
  sync_tpdos.clear();
  for (std::uint16_t rank = 0; rank < by_rank.size(); ++rank) {
    const std::uint16_t slot = by_rank[rank];
    Tpdo& pdo = tpdos[slot];
    pdo.rank = rank;
    if (!pdo.active) {
      continue;
    }
    if (was_pending[slot] && pdo.sampled) {
      pending.set(rank);
    }
    const bool is_new = pdo.inhibited_until == Instant{};  // no inhibit time is running
    if (was_inhibited[slot] && pdo.inhibit > Duration::zero() && !is_new) {
      inhibited.set(rank);
    }
    if (is_synchronous(pdo.type) || pdo.type == kRtrOnSync) {
      sync_tpdos.push_back(slot);
    }
  }
}

// Copies the object runs of all plans into one array: TPDOs that are sent in turn use fewer cache
// lines than with an allocation each.
void Engine::Impl::lay_out_objects() {
  std::size_t count = 0;
  for (const Tpdo& pdo : tpdos) {
    count += pdo.plan.objects.size();
  }
  object_runs.clear();
  object_runs.reserve(count);
  for (Tpdo& pdo : tpdos) {
    if (pdo.plan.objects.size() <= Tpdo::kNear) {
      std::ranges::copy(pdo.plan.objects, pdo.near_objects.begin());
      pdo.objects = pdo.near_objects.data();
      continue;
    }
    pdo.objects = object_runs.data() + object_runs.size();
    object_runs.insert(object_runs.end(), pdo.plan.objects.begin(), pdo.plan.objects.end());
  }
}

// While PDOs are compiled, writes do not request the previous TPDOs.
void Engine::Impl::forget_sources() {
  sources.clear();
  object_sources.assign({});
  follow_sources();
}

void Engine::Impl::index_sources() {
  sources.clear();
  shares_outputs = false;
  std::vector<ObjectSource> of_objects;
  for (std::uint16_t slot = 0; slot < tpdos.size(); ++slot) {
    if (!tpdos[slot].active || tpdos[slot].mpdo != MpdoMode::none) {
      continue;
    }
    for (const Run& run : tpdos[slot].plan.runs) {
      const auto begin = static_cast<std::uint32_t>(std::countr_zero(run.mask));
      const auto end = static_cast<std::uint32_t>(64 - std::countl_zero(run.mask));
      sources.push_back({8 * run.offset + begin, 8 * run.offset + end, slot});
    }
    const auto number = static_cast<std::uint16_t>(slot + 1);
    if (!tpdos[slot].linked) {
      shares_outputs = shares_outputs || !tpdos[slot].plan.runs.empty();
      for (const Mapping& mapping : read_mapping(dictionary, PdoKind::tpdo, number)) {
        of_objects.push_back({mapping.address, slot});
      }
    }
  }
  std::ranges::sort(sources, {}, &Source::begin);
  object_sources.assign(std::move(of_objects));
  follow_sources();
}

void Engine::Impl::set_operational(bool on, Instant now) {
  if (on == operational) {
    return;
  }
  operational = on;
  follow_mode();
  latest = now;
  go_quiet();
  open_rpdos();
  for (std::uint16_t slot = 0; on && slot < rpdos.size(); ++slot) {
    begin(PdoKind::rpdo, slot);
  }
  for (std::uint16_t slot = 0; on && slot < tpdos.size(); ++slot) {
    begin(PdoKind::tpdo, slot);
  }
  if (on) {
    process_early();
  } else {
    shadows.clear();
  }
}

// Selects the RPDOs that receive_ordinary() processes.
void Engine::Impl::open_rpdos() {
  for (std::size_t slot = 0; slot < rpdos.size(); ++slot) {
    const RpdoDetails& pdo = details[slot];
    rpdos[slot].at_once = Rpdo::kNever;
    rpdos[slot].deferred = Rpdo::kNever;
    const std::uint8_t flags = rpdos[slot].flags;
    if (!operational || !pdo.active || pdo.mpdo != MpdoMode::none ||
        (flags & (Rpdo::kLong | Rpdo::kQueued)) != 0) {
      continue;
    }
    const auto form = static_cast<std::uint8_t>(pdo.plan.bytes());
    if (is_synchronous(pdo.type)) {
      // With a window (1007h) each frame is checked.
      rpdos[slot].deferred = window == Duration::zero() ? form : Rpdo::kNever;
    } else if ((flags & (Rpdo::kMore | Rpdo::kWatched)) == 0) {
      rpdos[slot].at_once = form;
    }
  }
}

void Engine::Impl::open_window(Instant sync) {
  if (window > Duration::zero()) {
    window_end = sync + window;
    window_open = !sync_tpdos.empty();
  }
}

// Drops the TPDOs of this SYNC that were not sent within the window. A TPDO of type 0 is sent after
// the next SYNC instead.
void Engine::Impl::drop_what_missed_the_window() {
  window_open = false;
  for (const std::uint16_t slot : sync_tpdos) {
    Tpdo& pdo = tpdos[slot];
    if (is_synchronous(pdo.type) && pending.test(pdo.rank)) {
      pending.clear(pdo.rank);
      pdo.event = pdo.type == kSyncAcyclic;
      ++counters.after_window;
    }
  }
}

void Engine::Impl::go_quiet() {
  forget_transmission();
  window_end = kNever;
  window_open = false;
  pending.clear_all();
  inhibited.clear_all();
  next_release = kNever;
  asked.clear_all();
  held_changed.clear_all();
  held_always.clear_all();
  timers.reset(rpdos.size() + tpdos.size());
  for (std::size_t slot = 0; slot < rpdos.size(); ++slot) {
    inputs->pdo(slot).attention &= ~std::uint32_t{kFirst};  // errors are not affected
  }
  for (Tpdo& pdo : tpdos) {
    pdo.event = false;
    pdo.sampled = false;
    pdo.of_sync = false;
    pdo.counting = false;
    pdo.syncs = 0;
    pdo.mpdos.clear();
    pdo.held_mpdos.clear();
  }
}

// Starts the PDO at the beginning of Operational.
void Engine::Impl::begin(PdoKind kind, std::uint16_t slot) {
  if (kind == PdoKind::rpdo) {
    const bool monitored = details[slot].deadline > Duration::zero();
    inputs->pdo(slot).attention |= monitored ? std::uint32_t{kFirst} : 0U;
    return;
  }
  if (!tpdos[slot].active) {
    return;
  }
  if (!tpdos[slot].linked || receivers[tpdos[slot].node] != Receiver::waiting) {
    source_changed(slot, true);
  }
  if (has_event_timer(tpdos[slot])) {
    timers.set(event_timer(slot), latest + tpdos[slot].event_timer);
  }
}

}  // namespace linegate::pdo

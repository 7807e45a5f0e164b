// SPDX-License-Identifier: Apache-2.0
#include "gateway/publish/line_history.h"

#include <algorithm>
#include <array>

namespace linegate::gateway {
namespace {

using line::Counters;

// Must list all counters: a missing one would decrease when its line is restarted.
constexpr std::array kCounters{&Counters::frames_received,
                               &Counters::frames_sent,
                               &Counters::frames_unused,
                               &Counters::frames_malformed,
                               &Counters::frames_lost,
                               &Counters::bus_errors,
                               &Counters::rpdos,
                               &Counters::tpdos,
                               &Counters::tpdos_coalesced,
                               &Counters::syncs,
                               &Counters::emcys,
                               &Counters::heartbeats_lost,
                               &Counters::sdo_transfers,
                               &Counters::sdo_aborts,
                               &Counters::commands,
                               &Counters::commands_refused,
                               &Counters::output_writes,
                               &Counters::output_writes_refused,
                               &Counters::events,
                               &Counters::events_lost,
                               &Counters::fd_frames_received,
                               &Counters::fd_frames_sent,
                               &Counters::usdo_transfers,
                               &Counters::usdo_aborts,
                               &Counters::receptions_lost};
static_assert(sizeof(Counters) == kCounters.size() * sizeof(std::uint64_t));

// The counters that never decrease.
constexpr std::array kRouted{&routing::Counters::opened,         &routing::Counters::finished,
                             &routing::Counters::aborted,        &routing::Counters::timed_out,
                             &routing::Counters::refused,        &routing::Counters::not_permitted,
                             &routing::Counters::forwarded,      &routing::Counters::unexpected,
                             &routing::Counters::emcy_forwarded, &routing::Counters::emcy_dropped};

}  // namespace

void LineHistory::correct(Event& event) {
  event.number += first_event_;
  if (auto* const lost = event.get<event::EventsLost>()) {
    lost->first += first_event_;
    lost->last += first_event_;
  }
  last_event_ = std::max(last_event_, event.number);
}

void LineHistory::correct(line::LineState& state) {
  for (const auto counter : kCounters) {
    state.counters.*counter += before_.*counter;
  }
  now_ = state.counters;
  for (const auto counter : kRouted) {
    state.routing.*counter += routed_before_.*counter;
  }
  routed_now_ = state.routing;
}

// The counter is the number of the newest event.
void LineHistory::begin_after(std::uint64_t number) {
  last_event_ = number;
  now_.events = number;
}

void LineHistory::restart() {
  first_event_ = last_event_;
  before_ = now_;
  routed_before_ = routed_now_;
}

}  // namespace linegate::gateway

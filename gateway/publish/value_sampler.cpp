// SPDX-License-Identifier: Apache-2.0
#include "gateway/publish/value_sampler.h"

#include <algorithm>
#include <utility>

namespace linegate::gateway {
namespace {

constexpr std::uint32_t kMostBits = 64;
constexpr Duration kRetryPeriod = std::chrono::milliseconds(250);  // without room

}  // namespace

ValueSampler::ValueSampler(const config::History& plan, const std::string& line,
                           const Layouts& layouts)
    : min_interval_(plan.min_interval) {
  for (const config::History::Entry& one : plan.entries) {
    Watched& made = watched_.emplace_back();
    made.entry =
        std::make_shared<const ValueEntry>(ValueEntry{line, one.direction, one.node, one.name});
  }
  use(layouts, Instant{});
}

void ValueSampler::use(const Layouts& layouts, Instant now) {
  for (Watched& one : watched_) {
    const auto& entries = layouts[static_cast<std::size_t>(one.entry->direction)].entries;
    const auto found = std::ranges::find(entries, one.entry->name, &image::Entry::name);
    if (found == entries.end() || found->bit_length == 0 || found->bit_length > kMostBits) {
      one.place.reset();
      change(one, std::nullopt, now);
    } else {
      one.place = Place{.entry = static_cast<std::size_t>(found - entries.begin()),
                        .bit_offset = found->bit_offset,
                        .bits = found->bit_length,
                        .type = found->type,
                        .scaling = found->scaling == od::Scaling{}
                                       ? nullptr
                                       : std::make_shared<const od::Scaling>(found->scaling)};
    }
  }
}

// Type and scaling of an invalid entry do not matter.
bool ValueSampler::is_same(const Value& a, const Value& b) {
  const auto has_same_scaling = [&] {
    return a.scaling == b.scaling || (a.scaling && b.scaling && *a.scaling == *b.scaling);
  };
  return a.value == b.value &&
         (!a.value || (a.type == b.type && a.bits == b.bits && has_same_scaling()));
}

std::optional<std::uint64_t> ValueSampler::value_of(const Place& of,
                                                    const image::Snapshot& snapshot) {
  if (of.entry / 64 >= snapshot.valid.size() || !snapshot.is_valid(of.entry) ||
      std::size_t{of.bit_offset} + of.bits > snapshot.bytes.size() * 8) {
    return std::nullopt;
  }
  std::uint64_t value = 0;
  for (std::size_t read = 0; read < of.bits;) {
    const std::size_t at = of.bit_offset + read;
    value |= std::to_integer<std::uint64_t>(snapshot.bytes[at / 8]) >> (at % 8) << read;
    read += 8 - at % 8;
  }
  return of.bits == kMostBits ? value : value & ((std::uint64_t{1} << of.bits) - 1);
}

void ValueSampler::change(Watched& of, std::optional<std::uint64_t> to, Instant time) {
  const Value next{time, of.place ? of.place->type : of.newest.type,
                   of.place ? of.place->bits : of.newest.bits, to,
                   of.place ? of.place->scaling : of.newest.scaling};
  if (is_same(next, of.newest)) {
    return;
  }
  if (!to && of.stored.value && !of.end) {
    of.last = is_same(of.newest, of.stored) ? std::nullopt : std::optional(of.newest);
    of.end = next;
  } else if (!to) {
    of.phase = Phase{.last = of.newest, .end = next};
  }
  of.newest = next;
  is_waiting_ = true;
}

void ValueSampler::add(const image::Snapshot& snapshot) {
  for (Watched& one : watched_) {
    if (one.entry->direction == snapshot.direction && one.place) {
      change(one, value_of(*one.place, snapshot), snapshot.acquired);
    }
  }
}

Instant ValueSampler::store_due(Instant now, const ClockMap& clock, const Store& store) {
  if (!is_waiting_) {
    return kNever;
  }
  Instant next = kNever;
  for (Watched& one : watched_) {
    next = earlier(next, store_due(one, now, clock, store));
  }
  is_waiting_ = next != kNever;
  return next;
}

Instant ValueSampler::store_due(Watched& of, Instant now, const ClockMap& clock,
                                const Store& store) {
  const auto stores = [&](const Value& value) {
    const bool done = store({of.entry, value.time + clock.offset, clock.quality, value.type,
                             value.bits, value.value, value.scaling});
    if (done) {
      of.stored = value;
      of.due = now + min_interval_;
    }
    return done;
  };
  const auto stores_ended = [&] {
    for (std::optional<Value>* const one : {&of.last, &of.end}) {
      if (*one && !stores(**one)) {
        return false;
      }
      one->reset();
    }
    return true;
  };
  if (!stores_ended()) {
    return now + kRetryPeriod;
  }
  if (of.phase) {
    if (now < of.due) {
      return of.due;
    }
    of.last = of.phase->last;
    of.end = of.phase->end;
    of.phase.reset();
    if (!stores_ended()) {
      return now + kRetryPeriod;
    }
  }
  if (is_same(of.newest, of.stored)) {
    return kNever;
  }
  if (now < of.due) {
    return of.due;
  }
  return stores(of.newest) ? kNever : now + kRetryPeriod;
}

void ValueSampler::repeat() {
  for (Watched& one : watched_) {
    one.stored = Value{};
    one.last.reset();
    one.end.reset();
    one.phase.reset();
    one.due = Instant{};
  }
  is_waiting_ = true;
}

bool ValueSampler::end(Instant now, const ClockMap& clock, const Store& store) {
  min_interval_ = Duration::zero();  // nothing follows that could be too much
  for (Watched& one : watched_) {
    one.place.reset();
    one.due = Instant{};
    change(one, std::nullopt, now);
  }
  return store_due(now, clock, store) == kNever;
}

}  // namespace linegate::gateway

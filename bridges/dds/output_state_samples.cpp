// SPDX-License-Identifier: Apache-2.0
#include "bridges/dds/output_state_samples.h"

#include <algorithm>
#include <string>

#include "stack/base/short_text.h"
#include "stack/base/time.h"

namespace linegate::dds {
namespace {

constexpr std::size_t kMostText = 64;

std::string bounded(const std::string& text) {
  return short_text(text, kMostText);
}

}  // namespace

void to_wire(const line::OutputState& from, const ClockMap& clock, Instant now,
             v1::OutputState& to) {
  to.group(from.group);
  to.time(clock.utc(now));
  to.clock(static_cast<std::uint8_t>(clock.quality));
  to.name(bounded(from.name));
  to.owner(bounded(from.owner));
  to.applied(from.applied);
  to.refused(from.refused);
  to.applied_time(clock.utc(from.applied_at));
  to.refused_time(clock.utc(from.refused_at));
  to.refusal(static_cast<std::uint8_t>(from.refusal));
  to.refused_client(bounded(from.refused_client));
  to.arming(from.arming);
  to.arming_wanted(from.arming_wanted);
  to.watchdog_ns(from.watchdog.count());
  const bool runs = from.deadline != kNever && from.deadline > now;
  to.watchdog_left_ns(runs ? (from.deadline - now).count() : 0);
  to.waiting_count(from.waiting);
  to.waiting().resize(std::min(from.waits.size(), line::OutputState::kMostWaits));
  for (std::size_t i = 0; i < to.waiting().size(); ++i) {
    to.waiting()[i].entry(from.waits[i].entry);
    to.waiting()[i].reason(static_cast<std::uint8_t>(from.waits[i].reason));
  }
}

void from_wire(const v1::OutputState& from, const ClockMap& clock, line::OutputState& to) {
  to.group = from.group();
  to.name = from.name().to_string();
  to.owner = from.owner().to_string();
  to.applied = from.applied();
  to.refused = from.refused();
  to.applied_at = clock.instant(from.applied_time());
  to.refused_at = clock.instant(from.refused_time());
  to.refusal = static_cast<line::OutputRefusal>(from.refusal());
  to.refused_client = from.refused_client().to_string();
  to.arming = from.arming();
  to.arming_wanted = from.arming_wanted();
  to.watchdog = Duration(from.watchdog_ns());
  const Instant taken = clock.instant(from.time());
  const bool runs = from.watchdog_left_ns() > 0 && taken >= Instant{};
  to.deadline = runs ? deadline(taken, Duration(from.watchdog_left_ns())) : kNever;
  to.waiting = from.waiting_count();
  to.waits.clear();
  for (const v1::OutputWaiting& wait : from.waiting()) {
    to.waits.push_back({wait.entry(), static_cast<line::OutputWait>(wait.reason())});
  }
}

}  // namespace linegate::dds

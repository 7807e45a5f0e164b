// SPDX-License-Identifier: Apache-2.0
#include "stack/manager/shared_id.h"

#include <algorithm>
#include <utility>

namespace linegate::manager {
namespace {

// A frame that a controller repeated is not a second heartbeat.
constexpr Duration kRepeatedHeartbeat = std::chrono::milliseconds(5);
// Largest distance of two heartbeats that one request started, if their period is not known.
constexpr Duration kOneMoment = std::chrono::milliseconds(1);
// Fractions of the sum of two consecutive times: how much the times of one device may vary, and how
// much those of two devices differ at least.
constexpr int kVaries = 16;
constexpr int kDiffers = 5;
// Fractions of a period: largest deviation of heartbeats that continue in their old rhythm, and
// least deviation of a rhythm that began again.
constexpr int kExact = 32;
constexpr int kApart = 8;

}  // namespace

SharedIds::Evidence SharedIds::heartbeat(std::uint8_t id, nmt::State state, Instant now,
                                         Duration producer_time) {
  Node& node = nodes_[id];
  if (node.producer_time != producer_time) {
    node.producer_time = producer_time;
    node.last = kNever;
    node.times = 0;
    node.steady = {};
  }
  const bool known = node.last != kNever;
  const Duration time = known ? now - node.last : Duration{};
  if (known && time < kRepeatedHeartbeat) {
    return report(node, repeat(node, time), now);
  }
  node.pairs = node.repeated ? node.pairs : std::uint8_t{0};
  node.repeated = false;
  if (known) {
    std::rotate(node.between.begin(), node.between.begin() + 1, node.between.end());
    node.between.back() = time;
    node.times = static_cast<std::uint8_t>(std::min<std::size_t>(node.times + 1U, kTimes));
    node.changes = node.state != state
                       ? static_cast<std::uint8_t>(std::min<unsigned>(node.changes + 1U, kChanges))
                       : std::uint8_t{0};
    const Duration period = steady_period(node);
    node.steady = period != Duration::zero() ? period : node.steady;
  }
  node.last = now;
  node.state = state;
  return report(node, evidence_of(node, state, now), now);
}

// A single controller does not repeat every frame. Heartbeats with a shorter period, or in batches,
// leave longer pauses between their pairs than those of two devices.
SharedIds::Evidence SharedIds::repeat(Node& node, Duration time) {
  if (!std::exchange(node.repeated, true)) {
    const bool known = node.producer_time != Duration::zero();
    const bool pair = known ? node.times != 0 && node.between.back() < node.producer_time * 3 / 2
                            : time < kOneMoment;
    node.pairs = pair ? static_cast<std::uint8_t>(std::min<std::size_t>(node.pairs + 1U, kTimes))
                      : std::uint8_t{0};
  }
  return node.pairs == kTimes ? Evidence::two_periods : Evidence::none;
}

SharedIds::Evidence SharedIds::report(Node& node, Evidence evidence, Instant now) {
  if (evidence == Evidence::none || (node.reported != kNever && now - node.reported < kQuiet)) {
    return Evidence::none;
  }
  node.reported = now;
  return evidence;
}

SharedIds::Evidence SharedIds::evidence_of(Node& node, nmt::State state, Instant now) {
  if (goes_on(node, state, now)) {
    return Evidence::unchanged_after_boot_up;
  }
  if (node.changes == kChanges) {
    return Evidence::two_states;
  }
  if (alternates(node)) {
    return Evidence::two_periods;
  }
  return too_many(node) ? Evidence::too_many_heartbeats : Evidence::none;
}

void SharedIds::boot_up(std::uint8_t id, Instant now) {
  const Node before = nodes_[id];
  Node& node = nodes_[id];
  node = {.reported = before.reported, .starts_itself = before.starts_itself, .commanded = false};
  node.booted = now;
  const Duration period = before.last != kNever ? steady_period(before) : Duration{};
  if (before.state != nmt::State::operational || before.starts_itself ||
      period == Duration::zero() || now - before.last > 2 * period) {
    return;
  }
  // A rhythm that begins again with the boot-up message must differ from the old one.
  const Duration phase = (now - before.last) % period;
  if (phase >= period / kApart && phase <= period - period / kApart) {
    node.period = period;
    node.heard = before.last;
  }
}

void SharedIds::begin(std::uint8_t id) {
  for (std::size_t each = 0; each < nodes_.size(); ++each) {
    if (id == 0 || each == id) {
      nodes_[each] = {.reported = nodes_[each].reported,
                      .starts_itself = nodes_[each].starts_itself};
    }
  }
}

// The average of the last three times; 0 if they are not known, or not steady.
Duration SharedIds::steady_period(const Node& node) {
  constexpr int kNewest = 3;
  if (node.times < kNewest) {
    return {};
  }
  const auto newest = node.between.end() - kNewest;
  const auto [least, most] = std::minmax_element(newest, node.between.end());
  return *most - *least <= *most / kExact ? (newest[0] + newest[1] + newest[2]) / kNewest
                                          : Duration{};
}

// Whether the heartbeats from before the boot-up message continue. The heartbeats of a device that
// enters Operational by itself begin again.
bool SharedIds::goes_on(Node& node, nmt::State state, Instant now) {
  constexpr std::uint8_t kOften = 2;
  if (node.commanded || state != nmt::State::operational) {
    return false;
  }
  if (node.period == Duration::zero()) {
    node.starts_itself = true;
    return false;
  }
  const Duration phase = (now - node.heard + node.period / 2) % node.period - node.period / 2;
  if (phase > node.period / kExact || -phase > node.period / kExact ||
      now - node.booted > 2 * kOften * node.period) {
    node.starts_itself = true;
    node.period = {};
    return false;
  }
  return ++node.goes_on == kOften;
}

// Whether long and short times alternate, both steady.
bool SharedIds::alternates(const Node& node) {
  if (node.times < kTimes) {
    return false;
  }
  std::array<Duration, 2> least{node.between[0], node.between[1]};
  std::array<Duration, 2> most = least;
  for (std::size_t i = 2; i < kTimes; ++i) {
    least[i % 2] = std::min(least[i % 2], node.between[i]);
    most[i % 2] = std::max(most[i % 2], node.between[i]);
  }
  const Duration sum = least[0] + least[1];
  const bool steady = most[0] - least[0] <= sum / kVaries && most[1] - least[1] <= sum / kVaries;
  const Duration gap = std::max(least[0], least[1]) - std::min(most[0], most[1]);
  return steady && gap >= sum / kDiffers && !is_average_of_one(node, sum / 2);
}

// Whether one device sends with this average time between its heartbeats. Two with the same period
// halve it.
bool SharedIds::is_average_of_one(const Node& node, Duration average) {
  if (node.producer_time != Duration::zero()) {
    return average * 4 >= node.producer_time * 3;
  }
  return average * 4 >= node.steady * 3 && average * 4 <= node.steady * 5;
}

// Whether eight heartbeats arrived in a time in which one device would send about half of them.
bool SharedIds::too_many(const Node& node) {
  if (node.times < kTimes || node.producer_time == Duration::zero() ||
      node.state != nmt::State::operational) {
    return false;
  }
  Duration sum{};
  for (const Duration time : node.between) {
    sum += time;
  }
  constexpr int kOfTen = 6;  // with one device it would be more than 9
  return sum * 10 <= node.producer_time * static_cast<int>(kTimes) * kOfTen;
}

}  // namespace linegate::manager

// SPDX-License-Identifier: Apache-2.0
#include "stack/node/indicators.h"

namespace linegate::node {
namespace {

using Milliseconds = std::chrono::milliseconds;

constexpr Milliseconds kFlash{200};
constexpr Milliseconds kPause{1000};
constexpr Milliseconds kFlicker{50};

unsigned flashes(Pattern pattern) {
  switch (pattern) {
    case Pattern::single_flash:
      return 1;
    case Pattern::double_flash:
      return 2;
    case Pattern::triple_flash:
      return 3;
    case Pattern::quadruple_flash:
      return 4;
    default:
      return 0;
  }
}

// Half the period of a symmetric pattern; 0 for others.
Duration half(Pattern pattern) {
  return pattern == Pattern::flickering ? kFlicker
         : pattern == Pattern::blinking ? kFlash
                                        : Milliseconds(0);
}

// A pause replaces the dark time of the last flash.
Duration period(Pattern pattern) {
  const unsigned count = flashes(pattern);
  return count == 0 ? 2 * half(pattern) : Duration((2 * count - 1) * kFlash + kPause);
}

Duration phase(Pattern pattern, Instant now) {
  return now.time_since_epoch() % period(pattern);
}

Pattern error_pattern(const Condition& condition) {
  if (condition.bus == can::BusState::bus_off) {
    return Pattern::on;
  }
  if (condition.event_timer_error) {
    return Pattern::quadruple_flash;
  }
  if (condition.sync_error) {
    return Pattern::triple_flash;
  }
  if (condition.error_control_event) {
    return Pattern::double_flash;
  }
  if (condition.bus == can::BusState::error_warning ||
      condition.bus == can::BusState::error_passive) {
    return Pattern::single_flash;
  }
  return condition.invalid_configuration ? Pattern::blinking : Pattern::off;
}

Pattern run_pattern(nmt::State state) {
  switch (state) {
    case nmt::State::stopped:
      return Pattern::single_flash;
    case nmt::State::pre_operational:
      return Pattern::blinking;
    case nmt::State::operational:
      return Pattern::on;
    case nmt::State::initialising:
    case nmt::State::unknown:
      break;
  }
  return Pattern::off;
}

}  // namespace

std::string_view name(Pattern pattern) {
  switch (pattern) {
    case Pattern::off:
      return "off";
    case Pattern::on:
      return "on";
    case Pattern::flickering:
      return "flickering";
    case Pattern::blinking:
      return "blinking";
    case Pattern::single_flash:
      return "single-flash";
    case Pattern::double_flash:
      return "double-flash";
    case Pattern::triple_flash:
      return "triple-flash";
    case Pattern::quadruple_flash:
      return "quadruple-flash";
  }
  return "unknown";
}

bool is_lit(Pattern pattern, Indicator indicator, Instant now) {
  if (period(pattern) == Duration::zero()) {
    return pattern == Pattern::on;
  }
  const Duration since = phase(pattern, now);
  if (const unsigned count = flashes(pattern); count != 0) {
    return since < (2 * count - 1) * kFlash && since / kFlash % 2 == 0;
  }
  return (since < half(pattern)) == (indicator == Indicator::run);
}

Instant next_change(Pattern pattern, Instant now) {
  if (period(pattern) == Duration::zero()) {
    return kNever;
  }
  const Duration since = phase(pattern, now);
  const unsigned count = flashes(pattern);
  if (count != 0 && since >= (2 * count - 1) * kFlash) {
    return now - since + period(pattern);
  }
  const Duration step = count != 0 ? Duration(kFlash) : half(pattern);
  return now - since + (since / step + 1) * step;
}

Indicators indicate(const Condition& condition) {
  return {run_pattern(condition.state), error_pattern(condition)};
}

}  // namespace linegate::node

// SPDX-License-Identifier: Apache-2.0
// The two indicators of CiA 303-3 as plain values: RUN (green) shows the NMT state, ERROR (red) the
// errors. Their light is a function of pattern and time only, on one time grid for all devices, and
// can be tested without a lamp.
#pragma once

#include <cstdint>
#include <string_view>

#include "stack/base/time.h"
#include "stack/can/bus_state.h"
#include "stack/nmt/state.h"

namespace linegate::node {

// Times in ms, lit and dark in turn. Only append: the numbers are published.
enum class Pattern : std::uint8_t {
  off,
  on,
  flickering,       // 50, 50
  blinking,         // 200, 200
  single_flash,     // 200, 1000
  double_flash,     // 200, 200, 200, 1000
  triple_flash,     // three times 200, 1000 after the last
  quadruple_flash,  // four times
};
// "single-flash" and so on.
std::string_view name(Pattern pattern);

enum class Indicator : std::uint8_t { run, error };

// Flickering and blinking alternate between the two indicators (for two-coloured lamps): ERROR
// begins dark.
bool is_lit(Pattern pattern, Indicator indicator, Instant now);
// Next time at which is_lit() may change; kNever for off and on.
Instant next_change(Pattern pattern, Instant now);

struct Indicators {
  Pattern run = Pattern::off;
  Pattern error = Pattern::off;

  friend bool operator==(const Indicators&, const Indicators&) = default;
};

// The conditions to show.
struct Condition {
  nmt::State state = nmt::State::initialising;
  can::BusState bus = can::BusState::unknown;
  bool event_timer_error = false;      // an RPDO missed its deadline
  bool sync_error = false;             // SYNC is missing
  bool error_control_event = false;    // a heartbeat or node guarding was lost
  bool invalid_configuration = false;  // a PDO cannot be used
};

// RUN: off while Initialising, single flash in Stopped, blinking in Pre-operational, on in
// Operational. ERROR, the first that applies: on at bus-off, quadruple flash for an event timer,
// triple flash for SYNC, double flash for error control, single flash above a warning limit,
// blinking for the configuration, else off.
Indicators indicate(const Condition& condition);

}  // namespace linegate::node

// SPDX-License-Identifier: Apache-2.0
// The TIME message (CiA 301, 7.2.6): TIME_OF_DAY, 6 bytes.
//   bits 0..27   ms after midnight; bits 28..31 reserved, 0
//   bits 32..47  days since 1984-01-01
#pragma once

#include <cstdint>
#include <optional>

#include "stack/base/time.h"
#include "stack/can/cob_id.h"
#include "stack/can/frame.h"

namespace linegate::time {

struct TimeOfDay {
  std::uint32_t milliseconds = 0;  // after midnight, 0..86'399'999
  std::uint16_t days = 0;          // since 1984-01-01

  friend bool operator==(const TimeOfDay&, const TimeOfDay&) = default;
};

// utc: since 1970-01-01. Returns nothing before 1984 or after 2163, when the day counter overflows.
std::optional<TimeOfDay> to_time_of_day(Duration utc);
Duration to_utc(const TimeOfDay& time);

can::Frame encode(const TimeOfDay& time, can::CobId cob_id);
// Returns nothing if the frame does not have 6 bytes or the time is 24 h or more after midnight.
// Reserved bits are ignored.
std::optional<TimeOfDay> decode(const can::Frame& frame);

}  // namespace linegate::time

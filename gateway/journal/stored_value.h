// SPDX-License-Identifier: Apache-2.0
// A value of the value history.
#pragma once

#include <compare>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "gateway/runtime/clock.h"
#include "stack/base/time.h"
#include "stack/image/layout.h"
#include "stack/od/data_type.h"
#include "stack/od/scaling.h"

namespace linegate::gateway {

// An entry of a process image with a value history.
struct ValueEntry {
  std::string line;
  image::Direction direction = image::Direction::inputs;
  std::uint8_t node = 0;
  std::string name;  // of the entry in its layout

  friend auto operator<=>(const ValueEntry&, const ValueEntry&) = default;
};

// A value from its time on, until the next one of the entry.
struct StoredValue {
  std::shared_ptr<const ValueEntry> entry;  // not nullptr
  Instant time{};                           // UTC
  ClockQuality clock{};                     // of time
  od::DataType type = od::DataType::none;
  std::uint16_t bits = 0;  // 1..64
  // Bits of the value, the first one is the lowest. Nothing: from that time on there is no valid
  // value, or none is known.
  std::optional<std::uint64_t> value;
  std::shared_ptr<const od::Scaling> scaling{};  // nullptr: none
};

}  // namespace linegate::gateway

// SPDX-License-Identifier: Apache-2.0
// A stored event.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "gateway/runtime/clock.h"
#include "stack/base/event.h"
#include "stack/base/time.h"

namespace linegate::gateway {

// The members of an Event sample (idl/linegate.idl) but `gateway`, and the stream of its number.
struct JournalEntry {
  std::uint64_t stream = 0;       // `event-stream` of GatewayState; not 0
  std::uint64_t incarnation = 0;  // numbers of clients in value and data are those of it
  std::string line;               // empty: the gateway itself
  std::uint64_t number = 0;       // unique per stream and line
  Instant time{};                 // UTC
  ClockQuality clock{};           // of time
  EventKind kind{};               // kinds that are unknown to this version keep their number
  EventSeverity severity{};
  std::uint8_t node = 0;
  std::uint32_t code = 0;
  std::uint32_t value = 0;
  std::vector<std::byte> data;  // up to 16 bytes
  std::string text;             // up to 256 bytes

  friend bool operator==(const JournalEntry&, const JournalEntry&) = default;
};

}  // namespace linegate::gateway

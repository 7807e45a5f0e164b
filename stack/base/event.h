// SPDX-License-Identifier: Apache-2.0
// The event type: something that happened on a line, with a time and a number.
//
// Logs, metrics and the DDS topic Event all render this value; there is no other report of what
// happened. It is plain and of fixed size, so that emitting an event never allocates.
#pragma once

#include <cstdint>
#include <string_view>
#include <type_traits>
#include <variant>

#include "stack/base/events.h"
#include "stack/base/time.h"

namespace linegate {

// Lower-case name with hyphens, e.g. "heartbeat-lost".
std::string_view name(EventKind kind);

enum class EventSeverity : std::uint8_t { info, warning, error };
EventSeverity severity(EventKind kind);
// "info", "warning", "error".
std::string_view name(EventSeverity severity);

struct Event {
  std::uint64_t number = 0;  // 1, 2, 3, ... per line and incarnation, without gaps
  Instant time{};
  std::uint8_t node = 0;  // 1..127, the node concerned; 0: the line itself
  EventData data{};

  EventKind kind() const { return linegate::kind(data); }
  // The parameters, e.g. get<event::HeartbeatLost>(). nullptr if the event is of another kind.
  template <class Data>
  Data* get() {
    return std::get_if<Data>(&data);
  }
  template <class Data>
  const Data* get() const {
    return std::get_if<Data>(&data);
  }
};
static_assert(std::is_trivially_copyable_v<Event>);
static_assert(sizeof(Event) <= 56, "lines keep thousands of events");

}  // namespace linegate

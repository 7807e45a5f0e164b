// SPDX-License-Identifier: Apache-2.0
// `linegate events`: past events in order, then new ones.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>

#include "bridges/console/commands.h"

namespace linegate::console {

struct EventsRequest {
  std::string line;         // empty = all
  std::uint64_t count = 0;  // print the newest `count` kept events, and at most that many; 0 = all
  bool once = false;        // stop after the kept events
  std::string since;        // see parse_since(); empty = all kept events
  std::string severity;  // "info", "warning" or "error": the least severity to print; empty = all
};

// "90s", "10min", "2h", "3d" before `now`; "today" or "yesterday": the begin of that day in local
// time; or "2026-11-21 12:34", optionally with seconds, or without a time, separated by T or a
// blank: local time, or UTC with a trailing Z. Returns nothing for other texts.
std::optional<Instant> parse_since(const std::string& text, Instant now);
// These forms, for messages.
inline constexpr const char* kTimes = "10min, 2h, 3d, today, yesterday, or 2026-11-21 12:34";
// An empty text is the lowest one. Returns nothing for other texts than the names.
std::optional<EventSeverity> severity_named(const std::string& text);

// Prints the kept events by time, then line and number; then new ones until `count` are printed or
// stopped() returns true. kIncomplete if not all kept events were received.
int events(Context& context, const EventsRequest& request, const std::function<bool()>& stopped);

}  // namespace linegate::console

// SPDX-License-Identifier: Apache-2.0
// `linegate events`: what happened, in the order in which it happened, and what happens.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>

#include "bridges/console/commands.h"

namespace linegate::console {

struct EventsRequest {
  std::string line;         // empty = all
  std::uint64_t count = 0;  // the newest of those that gateways keep, and so many at all; 0 = all
  bool once = false;        // ends after those that are kept
  std::string since;        // see parse_since(); empty = all that are kept
  std::string severity;     // "info", "warning" or "error": these and worse ones; empty = all
};

// "90s", "10min", "2h", "3d" before `now`; or "2026-11-21 12:34", with seconds or not, with T or a
// blank: local time, UTC with Z at the end. Nothing if it is none of them.
std::optional<Instant> parse_since(const std::string& text, Instant now);

// Those that are kept, by time, then line and number; then those that happen, until `count` are
// printed or stopped() says so. kIncomplete if not all that are kept were received.
int events(Context& context, const EventsRequest& request, const std::function<bool()>& stopped);

}  // namespace linegate::console

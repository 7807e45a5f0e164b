// SPDX-License-Identifier: Apache-2.0
// What a connection may do on the line that it enters (Config::access).
#pragma once

#include <cstdint>

#include "stack/base/byte_order.h"
#include "stack/routing/config.h"
#include "stack/routing/message.h"
#include "stack/routing/post.h"
#include "stack/routing/sdo_phase.h"

namespace linegate::routing {

struct Permissions {
  bool read = false;
  bool write = false;

  bool none() const { return !read && !write; }
  // For a frame that begins a transfer: none, or the abort code.
  AbortCode refusal(std::uint64_t word) const {
    if (SdoPhase::writes(word)) {
      return write ? AbortCode::none : AbortCode::read_only;
    }
    return read ? AbortCode::none : AbortCode::write_only;
  }
};

// Of the connection that `open` opens. A client of this process that acts for a device needs the
// permission of both.
inline Permissions permissions(const Config& config, const Message& open) {
  const std::uint16_t source = open.source;
  const bool of_process = open.of_process || source == 0;
  const Permissions process{!of_process || config.process_reads,
                            !of_process || config.process_writes};
  if (source == 0) {
    return process;
  }
  Permissions out;
  for (const AccessRule& rule : config.access) {
    if (source >= rule.first && source <= rule.last) {
      out.read = out.read || (rule.sdo_read && process.read);
      out.write = out.write || (rule.sdo_write && process.write);
    }
  }
  return out;
}

// The client of this process whose command opens the connection, see sdo::Pace; 0 = nobody's.
inline std::uint32_t client_of(const Message& open) {
  return open.of_process ? load_le<std::uint32_t>(open.data.data()) : 0;
}

// Counts and reports what the access rules do not permit. target: network and node of the request.
inline void note_not_permitted(EventLog& events, Counters& counters, std::uint16_t source,
                               const Indication& target, AbortCode why, Instant now) {
  ++counters.not_permitted;
  report_refused(events, RoutedService::sdo, source, target, why, now);
}

// Refuses a connection that may neither read nor write.
inline void refuse_entry(EventLog& events, Counters& counters, Post& post, const Message& open,
                         Instant now) {
  constexpr AbortCode kWhy = AbortCode::local_control;
  note_not_permitted(events, counters, open.source, {.network = open.network, .node = open.node},
                     kWhy, now);
  (void)post.send(refusal(open, kWhy));
}

}  // namespace linegate::routing

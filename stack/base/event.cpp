// SPDX-License-Identifier: Apache-2.0
#include "stack/base/event.h"

#include <array>
#include <cstddef>
#include <type_traits>
#include <variant>

#include "stack/base/assert.h"

namespace linegate {
namespace {

struct KindInfo {
  std::string_view name;
  EventSeverity severity;
};

constexpr std::array<KindInfo, kEventKinds> kInfo{{
    {"line-started", EventSeverity::info},
    {"line-stopped", EventSeverity::info},
    {"bus-state", EventSeverity::warning},
    {"bus-error", EventSeverity::warning},
    {"frames-lost", EventSeverity::error},
    {"interface-failed", EventSeverity::error},
    {"interface-ready", EventSeverity::info},
    {"manager-state", EventSeverity::info},
    {"own-state", EventSeverity::info},
    {"boot-up", EventSeverity::info},
    {"node-state", EventSeverity::info},
    {"heartbeat-lost", EventSeverity::error},
    {"heartbeat-recovered", EventSeverity::info},
    {"boot-result", EventSeverity::info},
    {"emcy", EventSeverity::warning},
    {"emcy-sent", EventSeverity::warning},
    {"configuration-error", EventSeverity::error},
    {"pdo-length", EventSeverity::warning},
    {"pdo-timeout", EventSeverity::error},
    {"pdo-recovered", EventSeverity::info},
    {"sync-lost", EventSeverity::error},
    {"malformed-frame", EventSeverity::warning},
    {"unexpected-node", EventSeverity::warning},
    {"foreign-sdo", EventSeverity::warning},
    {"sdo-abort", EventSeverity::warning},
    {"output-refused", EventSeverity::warning},
    {"output-armed", EventSeverity::info},
    {"output-watchdog", EventSeverity::error},
    {"command-refused", EventSeverity::warning},
    {"events-lost", EventSeverity::error},
    {"clock-step", EventSeverity::warning},
    {"queue-full", EventSeverity::error},
    {"duplicate-node-id", EventSeverity::error},
    {"nmt-command", EventSeverity::info},
    {"sdo-transfer", EventSeverity::info},
    {"pdo-mapping", EventSeverity::info},
    {"layout-changed", EventSeverity::info},
    {"routing-refused", EventSeverity::warning},
    {"emcy-routed", EventSeverity::warning},
    {"routing-opened", EventSeverity::info},
    {"routing-ended", EventSeverity::info},
    {"node-scanned", EventSeverity::info},
    {"command-progress", EventSeverity::info},
    {"lss-result", EventSeverity::info},
    {"foreign-manager", EventSeverity::warning},
    {"can-frame", EventSeverity::info},
    {"gateway-started", EventSeverity::info},
    {"gateway-reloaded", EventSeverity::info},
    {"gateway-reload-refused", EventSeverity::error},
    {"spontaneous-change", EventSeverity::warning},
    {"shared-node-id", EventSeverity::error},
    {"object-written", EventSeverity::info},
    {"own-reset", EventSeverity::info},
    {"time-received", EventSeverity::info},
    {"command-accepted", EventSeverity::info},
    {"output-owner", EventSeverity::warning},
    {"client-limited", EventSeverity::warning},
    {"journal-state", EventSeverity::info},
    {"dds-process-ended", EventSeverity::error},
    {"routing-unanswered", EventSeverity::warning},
    {"srdo-state", EventSeverity::warning},
    {"sdo-connection", EventSeverity::info},
    {"flying-master", EventSeverity::info},
    {"sleep-state", EventSeverity::info},
}};

}  // namespace

std::string_view name(EventKind kind) {
  const auto i = static_cast<std::size_t>(kind);
  return i < kInfo.size() ? kInfo[i].name : std::string_view("unknown");
}

EventSeverity severity(EventKind kind) {
  const auto i = static_cast<std::size_t>(kind);
  return i < kInfo.size() ? kInfo[i].severity : EventSeverity::error;
}

std::string_view name(EventSeverity severity) {
  switch (severity) {
    case EventSeverity::info:
      return "info";
    case EventSeverity::warning:
      return "warning";
    case EventSeverity::error:
      return "error";
  }
  return "unknown";
}

EventData empty_event_data(EventKind kind) {
  LINEGATE_ASSERT(static_cast<std::size_t>(kind) < kEventKinds, "the kind is one of EventKind");
  constexpr auto kMake = []<class... Kinds>(std::type_identity<std::variant<Kinds...>>) {
    return std::array<EventData (*)(), sizeof...(Kinds)>{[] { return EventData(Kinds{}); }...};
  }(std::type_identity<EventData>{});
  return kMake[static_cast<std::size_t>(kind)]();
}

}  // namespace linegate

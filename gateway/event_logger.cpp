#include "gateway/event_logger.h"

#include <algorithm>

#include <spdlog/spdlog.h>

#include "stack/line/event_severity.h"

namespace linegate::gateway {
namespace {

spdlog::level::level_enum level(EventSeverity severity) {
  switch (severity) {
    case EventSeverity::info:
      return spdlog::level::info;
    case EventSeverity::warning:
      return spdlog::level::warn;
    case EventSeverity::error:
      break;
  }
  return spdlog::level::err;
}

}  // namespace

bool EventLogger::admit(EventKind kind, Instant now, std::uint64_t& left_out) {
  return limits_[std::min(static_cast<std::size_t>(kind), kEventKinds - 1)].admit(now, left_out);
}

void EventLogger::write(std::string_view line, const Event& event, std::string_view text,
                        Instant now) {
  std::uint64_t left_out = 0;
  if (!admit(event.kind, now, left_out)) {
    return;
  }
  if (left_out > 0) {
    spdlog::log(level(line::severity_of(event)), "{}: {} (#{}; {} more events of kind {} left out)",
                line, text, event.number, left_out, name(event.kind));
  } else {
    spdlog::log(level(line::severity_of(event)), "{}: {} (#{})", line, text, event.number);
  }
}

}  // namespace linegate::gateway

// SPDX-License-Identifier: Apache-2.0
#include "gateway/publish/event_logger.h"

#include <algorithm>
#include <utility>

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include "stack/can/bus_state.h"
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

bool is_down(can::BusState bus) {
  return bus == can::BusState::stopped || bus == can::BusState::absent ||
         bus == can::BusState::bus_off;
}

}  // namespace

bool EventLogger::join(const Event& event, Instant now) {
  if (event.kind() == EventKind::interface_failed) {
    down_ = down_.empty() ? "interface failed" : down_;
  } else if (event.kind() == EventKind::interface_ready) {
    down_.clear();
  } else if (const auto* const bus = event.get<event::BusState>()) {
    down_ = is_down(bus->state) ? fmt::format("bus {}", can::name(bus->state)) : std::string();
  }
  if (event.kind() != EventKind::heartbeat_lost || down_.empty()) {
    due_ = down_.empty() && !nodes_.empty() ? now : due_;
    return false;
  }
  if (nodes_.empty()) {
    reason_ = down_;
    first_ = event.number;
    due_ = now + kJoined;
  }
  nodes_ += (nodes_.empty() ? "" : ", ") + std::to_string(event.node);
  last_ = event.number;
  return true;
}

std::string EventLogger::pop_joined(Instant now) {
  if (nodes_.empty() || now < due_) {
    return {};
  }
  due_ = kNever;
  const bool one = first_ == last_;
  std::string numbers = one ? fmt::format("#{}", first_) : fmt::format("#{} to #{}", first_, last_);
  return fmt::format("{}: the heartbeat of {} {} is lost because of it ({})", reason_,
                     one ? "node" : "nodes", std::exchange(nodes_, {}), numbers);
}

void EventLogger::advance(std::string_view line, Instant now) {
  if (const std::string text = pop_joined(now); !text.empty()) {
    spdlog::error("{}: {}", line, text);
  }
}

bool EventLogger::admit(EventKind kind, Instant now, std::uint64_t& left_out) {
  return limits_[std::min(static_cast<std::size_t>(kind), kEventKinds - 1)].admit(now, left_out);
}

void EventLogger::write(std::string_view line, const Event& event, std::string_view text,
                        Instant now) {
  if (join(event, now)) {
    return;
  }
  advance(line, now);
  std::uint64_t left_out = 0;
  if (!admit(event.kind(), now, left_out)) {
    return;
  }
  if (left_out > 0) {
    spdlog::log(level(line::severity_of(event.data)),
                "{}: {} (#{}; {} more events of kind {} left out)", line, text, event.number,
                left_out, name(event.kind()));
  } else {
    spdlog::log(level(line::severity_of(event.data)), "{}: {} (#{})", line, text, event.number);
  }
}

}  // namespace linegate::gateway

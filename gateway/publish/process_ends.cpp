// SPDX-License-Identifier: Apache-2.0
#include "gateway/publish/process_ends.h"

#include <algorithm>
#include <chrono>
#include <string_view>
#include <utility>

#include <fmt/format.h>

namespace linegate::gateway {
namespace {

std::string_view name_of(event::ProcessEnd cause) {
  using event::ProcessEnd;
  switch (cause) {
    case ProcessEnd::exited:
      return "exit";
    case ProcessEnd::signal:
      return "signal";
    case ProcessEnd::no_response:
      return "no response";
    case ProcessEnd::malformed:
      return "malformed messages";
    case ProcessEnd::memory:
      return "memory";
    case ProcessEnd::not_started:
      return "not started";
  }
  return "unknown";
}

}  // namespace

void ProcessEnds::note(event::ProcessEnd cause, std::uint32_t detail, Duration pause,
                       std::string words, Instant now) {
  const std::lock_guard lock(mutex_);
  newest_.cause = cause;
  newest_.detail = detail;
  newest_.pause_ms = static_cast<std::uint32_t>(
      std::chrono::duration_cast<std::chrono::milliseconds>(pause).count());
  ++newest_.ends;
  ++causes_[cause];
  words_ = std::move(words);
  ended_ = now;
}

std::optional<EdgeNotice> ProcessEnds::pop(Instant now) {
  const std::lock_guard lock(mutex_);
  if (newest_.ends == 0) {
    return std::nullopt;
  }
  if (reported_ && now - *reported_ < kPeriod) {
    waited_ = true;
    return std::nullopt;
  }
  EdgeNotice out{newest_, text(now)};
  reported_ = now;
  newest_.ends = 0;
  causes_.clear();
  waited_ = false;
  return out;
}

void ProcessEnds::set_condition(Condition condition, Instant start_due) {
  const std::lock_guard lock(mutex_);
  condition_ = condition;
  start_due_ = start_due;
}

std::string ProcessEnds::condition(Instant now) const {
  const std::lock_guard lock(mutex_);
  const bool is_of_routes = newest_.process == event::DdsProcess::routes;
  const std::string_view name = is_of_routes ? "DDS routes process" : "DDS process";
  switch (condition_) {
    case Condition::starting:
      return fmt::format("{} is starting", name);
    case Condition::working:
      return {};
    case Condition::hangs:
      return fmt::format("{} hangs, it is started again", name);
    case Condition::waits: {
      const Duration left = std::max(start_due_ - now, Duration::zero());
      return fmt::format("{} not running, started again in {} s", name,
                         std::chrono::ceil<std::chrono::seconds>(left).count());
    }
  }
  return {};
}

// The event has the time of the report. A start that failed would be another end.
std::string ProcessEnds::text(Instant now) const {
  const Duration ago = now - ended_;
  const std::chrono::milliseconds pause(newest_.pause_ms);
  const bool runs = waited_ && ago >= pause;
  const bool is_of_routes = newest_.process == event::DdsProcess::routes;
  std::string out = fmt::format("the DDS {}process {}", is_of_routes ? "routes " : "", words_);
  if (waited_) {
    out += fmt::format(", {} s ago", std::chrono::duration_cast<std::chrono::seconds>(ago).count());
  }
  out += runs ? "; it was started again" : "; it is started again";
  if (newest_.pause_ms != 0) {
    out += fmt::format(" {} {} ms", runs ? "after" : "in", newest_.pause_ms);
  }
  if (newest_.ends > 1) {
    std::string causes;
    for (const auto& [cause, ends] : causes_) {
      causes += fmt::format("{}{} {}", causes.empty() ? "" : ", ", name_of(cause), ends);
    }
    out += fmt::format("; {} ends since the last report: {}", newest_.ends, causes);
  }
  return out;
}

}  // namespace linegate::gateway

// SPDX-License-Identifier: Apache-2.0
// Single values in words: times, durations, codes and their meanings.
#include <array>
#include <chrono>
#include <cstdio>
#include <ctime>
#include <ostream>

#include "bridges/console/commands.h"
#include "bridges/console/tables.h"

namespace linegate::console {
namespace {

// Date, time and milliseconds.
std::string time_text(Instant utc, std::tm* (*split)(const std::time_t*, std::tm*)) {
  const std::int64_t ns = utc.time_since_epoch().count();
  const std::time_t seconds = ns / 1'000'000'000;
  std::tm parts{};
  split(&seconds, &parts);
  std::array<char, 40> text;
  const std::size_t length = std::strftime(text.data(), text.size(), "%F %T", &parts);
  std::snprintf(text.data() + length, text.size() - length, ".%03d",
                static_cast<int>(ns / 1'000'000 % 1000));
  return text.data();
}

}  // namespace

std::string date_text(Instant utc) {
  std::string text = time_text(utc, gmtime_r) + "Z";
  text[text.find(' ')] = 'T';
  return text;
}

std::string clock_text(Instant utc) {
  return utc == Instant{} ? "-" : date_text(utc).substr(11, 12);
}

std::string local_text(Instant utc) {
  return utc == Instant{} ? "-" : time_text(utc, localtime_r);
}

Stamp stamp_of(const Context& context) {
  return context.utc ? date_text : local_text;
}

std::string duration_text(Duration duration) {
  const auto tenths = duration / std::chrono::milliseconds(100);
  if (tenths < 100) {
    return std::to_string(tenths / 10) + '.' + std::to_string(tenths % 10) + 's';
  }
  const auto seconds = tenths / 10;
  if (seconds < 120) {
    return std::to_string(seconds) + 's';
  }
  if (seconds < 120 * 60) {
    return std::to_string(seconds / 60) + "min";
  }
  return seconds < 48 * 3600 ? std::to_string(seconds / 3600) + 'h'
                             : std::to_string(seconds / 86'400) + 'd';
}

std::string boot_text(char boot) {
  if (boot == manager::kBooted) {
    return "ok";
  }
  return boot == manager::kBootUnfinished ? "-" : printable(std::string(1, boot));
}

std::string boot_words(const NodeView& node) {
  for (const auto& [name, value] : node.properties) {
    if (name == "boot-text") {
      return printable(value);
    }
  }
  return printable(line::describe_boot(node.state.boot));
}

void print(std::ostream& out, const Text& text) {
  for (const std::string& line : text) {
    out << line << '\n';
  }
}

std::string event_text(const LineId& id, const EventView& event, Stamp stamp) {
  const std::string what = id.line.empty() ? "gateway " + id.gateway : id.line;
  return stamp(event.time) + ' ' + printable(what) + " #" + std::to_string(event.number) + ' ' +
         std::string(name(event.kind)) + ": " + printable(event.text);
}

std::string dropped_text(const Model& model) {
  std::string out;
  if (model.unreadable() > 0) {
    out += "   dropped, damaged: " + std::to_string(model.unreadable());
  }
  if (model.left_out() > 0) {
    out += "   dropped, too many lines: " + std::to_string(model.left_out());
  }
  return out;
}

Style style_of(const Model& model, const Line& line) {
  if (model.freshness(line) != Freshness::live) {
    return model.freshness(line) == Freshness::unheard ? Style::stale : Style::error;
  }
  switch (line.view->state.bus) {
    case can::BusState::error_active:
    case can::BusState::unknown:
      return Style::plain;
    case can::BusState::error_warning:
    case can::BusState::error_passive:
      return Style::warning;
    case can::BusState::bus_off:
    case can::BusState::stopped:
    case can::BusState::absent:
      return Style::error;
  }
  return Style::plain;
}

Style style_of(const NodeView& node) {
  if (node.state.presence == line::Presence::missing) {
    return Style::error;
  }
  return node.state.state == nmt::State::operational ? Style::good : Style::warning;
}

Style style_of(EventSeverity severity) {
  switch (severity) {
    case EventSeverity::info:
      return Style::plain;
    case EventSeverity::warning:
      return Style::warning;
    case EventSeverity::error:
      return Style::error;
  }
  return Style::plain;
}

}  // namespace linegate::console

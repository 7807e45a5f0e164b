// SPDX-License-Identifier: Apache-2.0
#include "bridges/can/virtual_faults.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <optional>
#include <string_view>
#include <vector>

namespace linegate::can_bridge {
namespace {

// Shortest interval between two bus-offs, and shortest period of a stuck node.
constexpr Duration kShortest = std::chrono::seconds(1);

// A number with that unit suffix, or a plain number if the unit is empty.
std::optional<double> number(std::string_view text, std::string_view unit) {
  if (!text.ends_with(unit)) {
    return std::nullopt;
  }
  text.remove_suffix(unit.size());
  double value = 0;
  const auto read = std::from_chars(text.data(), text.data() + text.size(), value);
  const bool good = read.ec == std::errc{} && read.ptr == text.data() + text.size();
  return good && std::isfinite(value) && value >= 0 ? std::optional(value) : std::nullopt;
}

bool read_share(std::string_view text, double& out) {
  const auto percent = number(text, "%");
  const auto share = percent ? *percent / 100 : number(text, "").value_or(-1);
  out = share;
  return share >= 0 && share <= 1;
}

bool read_time(std::string_view text, Duration& out, Duration more_than) {
  constexpr double kLongest = 86'400'000;  // ms: a day
  const auto milliseconds = number(text, "ms");
  const auto seconds = number(text, "s");
  const double time = milliseconds ? *milliseconds : seconds.value_or(0) * 1000;
  out = Duration(std::llround(std::min(time, kLongest) * 1e6));
  return out > more_than && time <= kLongest;
}

// "5@10s", "5@always".
bool read_stuck(std::string_view text, VirtualFaults& out) {
  const std::size_t at = std::min(text.find('@'), text.size());
  const auto read = std::from_chars(text.data(), text.data() + at, out.stuck);
  if (read.ec != std::errc{} || read.ptr != text.data() + at || out.stuck < 1 || out.stuck > 127 ||
      at == text.size()) {
    return false;
  }
  out.stuck_time = Duration{};
  return text.substr(at + 1) == "always" ||
         read_time(text.substr(at + 1), out.stuck_time, kShortest);
}

bool read_seed(std::string_view text, std::uint32_t& out) {
  const auto read = std::from_chars(text.data(), text.data() + text.size(), out);
  return read.ec == std::errc{} && read.ptr == text.data() + text.size();
}

bool read_option(const UriOption& option, VirtualFaults& out) {
  if (option.key == "lost") {
    return read_share(option.value, out.lost);
  }
  if (option.key == "disturbed") {
    return read_share(option.value, out.disturbed) && out.disturbed < 1;
  }
  if (option.key == "doubled") {
    return read_share(option.value, out.doubled);
  }
  if (option.key == "bus_off") {
    return read_time(option.value, out.bus_off, kShortest);
  }
  if (option.key == "restart") {
    out.restart = Duration{};
    return option.value == "never" || read_time(option.value, out.restart, Duration{});
  }
  if (option.key == "stuck") {
    return read_stuck(option.value, out);
  }
  return option.key == "seed" && read_seed(option.value, out.seed);
}

std::string not_an_option(const UriOption& option) {
  return "a virtual bus has the options lost, disturbed and doubled (0% to 100%, disturbed less), "
         "bus_off (a time longer than 1s), restart (a time, or never), stuck (a node and a time "
         "longer than 1s, as in 5@10s, or 5@always) and seed (a number), not \"" +
         option.key + "=" + option.value + "\"";
}

// Describes options that exclude each other; empty if there are none.
std::string contradiction(const VirtualFaults& faults) {
  if (faults.lost + faults.disturbed + faults.doubled > 1) {
    return "the faults of a virtual bus are more than 100% together";
  }
  if (faults.bus_off > Duration{} && faults.restart >= faults.bus_off) {
    return "restart is not shorter than bus_off";
  }
  return {};
}

// "lost=off". Returns false if there is no such option.
bool reset_fault(std::string_view key, FaultChange& out) {
  constexpr VirtualFaults kNone;
  VirtualFaults& faults = out.faults;
  if (key == "lost") {
    faults.lost = kNone.lost;
  } else if (key == "disturbed") {
    faults.disturbed = kNone.disturbed;
  } else if (key == "doubled") {
    faults.doubled = kNone.doubled;
  } else if (key == "stuck") {
    faults.stuck = kNone.stuck;
    faults.stuck_time = kNone.stuck_time;
  } else if (key == "bus_off") {
    faults.bus_off = kNone.bus_off;
    out.bus_off_ends = true;
  } else {
    return false;
  }
  return true;
}

bool change_option(const UriOption& option, FaultChange& out) {
  if (option.value == "off") {
    return reset_fault(option.key, out);
  }
  if (option.key == "bus_off" && option.value == "now") {
    out.bus_off_now = true;
    return true;
  }
  return read_option(option, out.faults);
}

std::string share_text(double share) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%g%%", share * 100);
  return text.data();
}

std::string time_text(Duration time) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.15gs", std::chrono::duration<double>(time).count());
  return text.data();
}

}  // namespace

ParsedFaults virtual_faults(const InterfaceUri& uri) {
  ParsedFaults parsed;
  for (const UriOption& option : uri.options) {
    if (!read_option(option, parsed.faults)) {
      parsed.error = not_an_option(option);
      return parsed;
    }
  }
  parsed.error = contradiction(parsed.faults);
  return parsed;
}

FaultChange change_faults(const VirtualFaults& faults, std::string_view text) {
  FaultChange change;
  change.faults = faults;
  if (text == "off") {
    change.faults = {};
    change.bus_off_ends = true;
    return change;
  }
  std::vector<UriOption> options;
  change.error = split_options(text, options);
  for (const UriOption& option : options) {
    if (change.error.empty() && !change_option(option, change)) {
      change.error = not_an_option(option) +
                     "; off ends a fault, a bus-off begins with "
                     "bus_off=now";
    }
  }
  if (change.error.empty()) {
    change.error = contradiction(change.faults);
  }
  return change;
}

std::string to_string(const VirtualFaults& faults) {
  std::string out;
  const auto add = [&](std::string_view key, const std::string& value) {
    out += (out.empty() ? "" : "&") + std::string(key) + '=' + value;
  };
  if (faults.lost > 0) {
    add("lost", share_text(faults.lost));
  }
  if (faults.disturbed > 0) {
    add("disturbed", share_text(faults.disturbed));
  }
  if (faults.doubled > 0) {
    add("doubled", share_text(faults.doubled));
  }
  if (faults.stuck != 0) {
    add("stuck", std::to_string(faults.stuck) + '@' +
                     (faults.stuck_time > Duration{} ? time_text(faults.stuck_time) : "always"));
  }
  if (faults.bus_off > Duration{}) {
    add("bus_off", time_text(faults.bus_off));
  }
  if (faults.restart != VirtualFaults{}.restart) {
    add("restart", faults.restart > Duration{} ? time_text(faults.restart) : "never");
  }
  if (faults.seed != VirtualFaults{}.seed) {
    add("seed", std::to_string(faults.seed));
  }
  return out.empty() ? "off" : out;
}

}  // namespace linegate::can_bridge

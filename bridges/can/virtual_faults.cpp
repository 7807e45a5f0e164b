#include "bridges/can/virtual_faults.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <optional>
#include <string_view>

namespace linegate::can_bridge {
namespace {

// Of the time from one bus-off to the next, and of a turn of a stuck node.
constexpr Duration kShortest = std::chrono::seconds(1);

// A number with that unit behind it, or without one if the unit is empty.
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

// "5@10s".
bool read_stuck(std::string_view text, VirtualFaults& out) {
  const std::size_t at = std::min(text.find('@'), text.size());
  const auto read = std::from_chars(text.data(), text.data() + at, out.stuck);
  return read.ec == std::errc{} && read.ptr == text.data() + at && out.stuck >= 1 &&
         out.stuck <= 127 && at < text.size() &&
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

}  // namespace

ParsedFaults virtual_faults(const InterfaceUri& uri) {
  ParsedFaults parsed;
  for (const UriOption& option : uri.options) {
    if (!read_option(option, parsed.faults)) {
      parsed.error =
          "a virtual bus has the options lost, disturbed and doubled (0% to 100%, disturbed less), "
          "bus_off (a time longer than 1s), restart (a time, or never), stuck (a node and a time "
          "longer than 1s, as in 5@10s) and seed (a number), not \"" +
          option.key + "=" + option.value + "\"";
      return parsed;
    }
  }
  if (parsed.faults.lost + parsed.faults.disturbed + parsed.faults.doubled > 1) {
    parsed.error = "the faults of a virtual bus are more than 100% together";
  }
  if (parsed.faults.bus_off > Duration{} && parsed.faults.restart >= parsed.faults.bus_off) {
    parsed.error = "restart is not shorter than bus_off";
  }
  return parsed;
}

}  // namespace linegate::can_bridge

// SPDX-License-Identifier: Apache-2.0
#include <charconv>
#include <cmath>
#include <optional>
#include <string_view>

#include "bridges/can/socketcan.h"

namespace linegate::can_bridge {
namespace {

constexpr std::uint32_t kFastestRate = 20'000'000;     // bit/s
constexpr std::uint32_t kLongestRestart = 86'400'000;  // ms: a day

bool read_number(std::string_view text, std::uint32_t lowest, std::uint32_t highest,
                 std::uint32_t& out) {
  const auto read = std::from_chars(text.data(), text.data() + text.size(), out);
  return read.ec == std::errc{} && read.ptr == text.data() + text.size() && out >= lowest &&
         out <= highest;
}

// "0.875" as per mille.
bool read_point(std::string_view text, std::uint32_t& out) {
  double value = 0;
  const auto read = std::from_chars(text.data(), text.data() + text.size(), value);
  if (read.ec != std::errc{} || read.ptr != text.data() + text.size() || !(value > 0) ||
      !(value < 1)) {
    return false;
  }
  out = static_cast<std::uint32_t>(std::lround(value * 1000));
  return true;
}

bool read_option(const UriOption& option, ControllerSetup& out) {
  if (option.key == "bitrate") {
    return read_number(option.value, 1, kFastestRate, out.bit_rate);
  }
  if (option.key == "dbitrate") {
    return read_number(option.value, 1, kFastestRate, out.data_bit_rate);
  }
  if (option.key == "sample-point") {
    return read_point(option.value, out.sample_point);
  }
  if (option.key == "dsample-point") {
    return read_point(option.value, out.data_sample_point);
  }
  if (option.key == "restart-ms") {
    return read_number(option.value, 0, kLongestRestart, out.restart_ms.emplace());
  }
  if (option.key != "listen-only" || (option.value != "on" && option.value != "off")) {
    return false;
  }
  out.listen_only = option.value == "on";
  return true;
}

}  // namespace

ParsedSetup controller_setup(const InterfaceUri& uri) {
  ParsedSetup parsed;
  for (const UriOption& option : uri.options) {
    if (!read_option(option, parsed.setup)) {
      parsed.error =
          "a socketcan interface has the options bitrate and dbitrate (bit/s), sample-point and "
          "dsample-point (as 0.875), restart-ms and listen-only (on or off), not \"" +
          option.key + "=" + option.value + "\"";
      return parsed;
    }
  }
  const ControllerSetup& setup = parsed.setup;
  if ((setup.sample_point != 0 && setup.bit_rate == 0) ||
      (setup.data_sample_point != 0 && setup.data_bit_rate == 0) ||
      (setup.data_bit_rate != 0 && setup.bit_rate == 0)) {
    parsed.error = "a sample point needs its bit rate, and dbitrate needs bitrate";
  }
  return parsed;
}

}  // namespace linegate::can_bridge

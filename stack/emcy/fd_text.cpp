// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <chrono>
#include <string>

#include "stack/base/byte_order.h"
#include "stack/emcy/message.h"

namespace linegate::emcy {
namespace {

constexpr std::uint32_t kMillisecondsOfDay = 86'400'000;

std::string padded(unsigned number, std::size_t digits) {
  const std::string text = std::to_string(number);
  return text.size() < digits ? std::string(digits - text.size(), '0') + text : text;
}

// TIME_OF_DAY (CiA 301 7.1.6.5): 28 bits of ms after midnight, 16 bits of days since 1984-01-01.
std::string time_text(const std::array<std::byte, 6>& time) {
  const std::uint32_t ms = load_le<std::uint32_t>(time.data()) & 0x0FFF'FFFFU;
  const std::chrono::sys_days first{std::chrono::year{1984} / 1 / 1};
  const std::chrono::year_month_day day{first +
                                        std::chrono::days(load_le<std::uint16_t>(time.data() + 4))};
  if (ms >= kMillisecondsOfDay) {
    return "an invalid time";
  }
  return padded(static_cast<unsigned>(static_cast<int>(day.year())), 4) + '-' +
         padded(static_cast<unsigned>(day.month()), 2) + '-' +
         padded(static_cast<unsigned>(day.day()), 2) + ' ' + padded(ms / 3'600'000, 2) + ':' +
         padded(ms / 60'000 % 60, 2) + ':' + padded(ms / 1000 % 60, 2) + '.' + padded(ms % 1000, 3);
}

}  // namespace

std::string fd_text(const event::FdEmcy& fields) {
  std::string out = ", logical device " +
                    (fields.logical_device == 0 ? "all" : std::to_string(fields.logical_device)) +
                    ", profile " + std::to_string(fields.profile) +
                    ((fields.status & kStatusActive) != 0 ? ", active" : ", not active");
  if ((fields.status & kStatusNeedsReset) != 0) {
    out += ", needs a reset";
  }
  if (const unsigned of_class = fields.status >> 4U; of_class != 0) {
    out += ", class " + std::to_string(of_class);
  }
  const auto is_zero = [](std::byte each) { return each == std::byte{0}; };
  if (!std::ranges::all_of(fields.time_of_day, is_zero)) {
    out += ", at " + time_text(fields.time_of_day);
  }
  return out;
}

}  // namespace linegate::emcy

// SPDX-License-Identifier: Apache-2.0
#include "stack/time/message.h"

#include "stack/base/byte_order.h"

namespace linegate::time {
namespace {

using Milliseconds = std::chrono::milliseconds;
using Days = std::chrono::days;

constexpr std::uint8_t kLength = 6;
constexpr std::uint32_t kMillisecondBits = 0x0FFF'FFFF;
constexpr std::int64_t kEpoch = 5113;  // 1984-01-01, in days since 1970-01-01
constexpr std::int64_t kMostDays = 0xFFFF;
constexpr std::uint32_t kMillisecondsPerDay = Milliseconds(Days(1)).count();

}  // namespace

std::optional<TimeOfDay> to_time_of_day(Duration utc) {
  const auto day = std::chrono::floor<Days>(utc);
  const std::int64_t days = day.count() - kEpoch;
  if (days < 0 || days > kMostDays) {
    return std::nullopt;
  }
  const auto rest = std::chrono::duration_cast<Milliseconds>(utc - day).count();
  return TimeOfDay{static_cast<std::uint32_t>(rest), static_cast<std::uint16_t>(days)};
}

Duration to_utc(const TimeOfDay& time) {
  return Days(kEpoch + time.days) + Milliseconds(time.milliseconds);
}

can::Frame encode(const TimeOfDay& time, can::CobId cob_id) {
  can::Frame frame;
  frame.id = cob_id.id();
  if (cob_id.extended()) {
    frame.flags = can::Frame::kExtended;
  }
  frame.length = kLength;
  store_le(frame.data.data(), time.milliseconds);
  store_le(frame.data.data() + sizeof time.milliseconds, time.days);
  return frame;
}

std::optional<TimeOfDay> decode(const can::Frame& frame) {
  TimeOfDay time;
  time.milliseconds = load_le<std::uint32_t>(frame.data.data()) & kMillisecondBits;
  time.days = load_le<std::uint16_t>(frame.data.data() + sizeof time.milliseconds);
  if (frame.length != kLength || time.milliseconds >= kMillisecondsPerDay) {
    return std::nullopt;
  }
  return time;
}

}  // namespace linegate::time

// SPDX-License-Identifier: Apache-2.0
#include "bridges/can/receive_clock.h"

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <ctime>

namespace linegate::can_bridge {
namespace {

// Slewing changes the difference by at most 500 us a second; the rest allows for the time between
// the two samples.
constexpr std::int64_t kStep = 10'000'000;
// No frame stays in a socket longer than this, even if the process was stopped meanwhile.
constexpr Duration kOldest = std::chrono::hours(1);
// Largest error of sampling two clocks one after the other.
constexpr Duration kSlack = std::chrono::milliseconds(1);

// Not by std::chrono: its clocks are functions of another library, which calls this one.
Duration read_clock(clockid_t id) {
  timespec time{};
  clock_gettime(id, &time);
  return std::chrono::seconds(time.tv_sec) + Duration(time.tv_nsec);
}

}  // namespace

[[gnu::hot]] void ReceiveClock::begin_batch() {
  const Duration wall = read_clock(CLOCK_REALTIME);
  begin_batch(Instant(read_clock(CLOCK_MONOTONIC)), wall.count());
}

[[gnu::hot]] void ReceiveClock::begin_batch(Instant monotonic, std::int64_t wall_ns) {
  const std::int64_t difference = wall_ns - monotonic.time_since_epoch().count();
  const bool stepped = started_ && std::abs(difference - difference_) > kStep;
  before_step_ = stepped ? difference_ : difference;
  difference_ = difference;
  started_ = true;
  sampled_ = monotonic;
}

// After a clock step only one of the two differences is right for a stamp. The wrong one yields a
// time in the future, or further in the past than the right one.
[[gnu::hot]] inline Instant ReceiveClock::of_wall_clock(std::int64_t stamp_ns) const {
  if (stamp_ns == 0) {
    return Instant::min();
  }
  const auto by = [&](std::int64_t difference) {
    const Instant time{Duration(stamp_ns - difference)};
    return time <= sampled_ + kSlack && time >= sampled_ - kOldest ? time : Instant::min();
  };
  const Instant time = by(difference_);
  return before_step_ == difference_ ? time : std::max(time, by(before_step_));
}

[[gnu::hot]] Instant ReceiveClock::instant(std::int64_t stamp_ns, std::int64_t hardware_ns) {
  Instant time = of_wall_clock(stamp_ns);
  if (time == Instant::min()) {
    time = sampled_;
  } else if (hardware_ns != 0) {
    time = hardware_.instant(hardware_ns, std::min(time, sampled_));
  }
  latest_ = std::max(latest_, std::min(time, sampled_));
  return latest_;
}

}  // namespace linegate::can_bridge

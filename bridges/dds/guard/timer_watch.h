// SPDX-License-Identifier: Apache-2.0
// Whether the thread that runs the timers of a participant makes progress. Heartbeats, repairs,
// announcements and leases depend on that thread, and no other thread notices when it loops or
// blocks. A timer of its own shows it.
#pragma once

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdint>

#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/rtps/resources/TimedEvent.h>
#include <sys/syscall.h>
#include <unistd.h>

#include "bridges/dds/guard/stall.h"
#include "stack/base/time.h"

namespace linegate::dds::guard {

class TimerWatch {
 public:
  static constexpr Duration kPeriod = std::chrono::milliseconds(50);

  // Must be destroyed before the participant is deleted.
  explicit TimerWatch(const eprosima::fastdds::dds::DomainParticipant& participant)
      : timer_(
            participant.get_resource_event(),
            [this] {
              thread_.store(static_cast<int>(syscall(SYS_gettid)), std::memory_order_relaxed);
              due_.store(now() + kPeriod.count(), std::memory_order_relaxed);
              return true;  // start it again
            },
            std::chrono::duration<double, std::milli>(kPeriod).count()) {
    timer_.restart_timer();
  }
  TimerWatch(const TimerWatch&) = delete;
  TimerWatch& operator=(const TimerWatch&) = delete;

  // Time since the timer was due. From any thread.
  Stall stall() const {
    const Duration late{now() - due_.load(std::memory_order_relaxed)};
    return {std::max(Duration::zero(), late), thread_.load(std::memory_order_relaxed)};
  }

 private:
  static std::int64_t now() {
    return Duration{std::chrono::steady_clock::now().time_since_epoch()}.count();
  }

  std::atomic<int> thread_{0};
  std::atomic<std::int64_t> due_{now() + kPeriod.count()};  // in ns of the steady clock
  eprosima::fastrtps::rtps::TimedEvent timer_;              // last: its destructor ends the calls
};

}  // namespace linegate::dds::guard

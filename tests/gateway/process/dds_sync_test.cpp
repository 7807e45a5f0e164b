// SPDX-License-Identifier: Apache-2.0
// SYNC of a line on a socket while the DDS process ends and hangs in each way.
#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <span>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <poll.h>

#include "bridges/can/udp.h"

#include "tests/gateway/process/dds_process_fixture.h"

namespace linegate::gateway {
namespace {

using namespace std::chrono_literals;

constexpr std::uint32_t kSync = 0x80;
constexpr Duration kPeriod = 20ms;

// Another station of that bus, which notes the times of all SYNCs as the kernel stamps them.
class SyncRecorder {
 public:
  explicit SyncRecorder(std::uint16_t port)
      : channel_(can_bridge::open_udp({.group = "239.74.163.12", .port = port})),
        thread_([this] { record(); }) {}
  ~SyncRecorder() { stop(); }
  SyncRecorder(const SyncRecorder&) = delete;
  SyncRecorder& operator=(const SyncRecorder&) = delete;

  bool receives() const { return count_ > 0; }
  // Ends the recording.
  const std::vector<Instant>& stop() {
    ending_ = true;
    if (thread_.joinable())
      thread_.join();
    return times_;
  }

 private:
  void record() {
    std::array<can::Frame, 16> frames;
    can_bridge::BusEvents events;
    while (!ending_) {
      events.clear();
      const std::size_t count = channel_->read(frames, events, monotonic_now());
      for (const can::Frame& frame : std::span(frames).first(count)) {
        if (frame.id == kSync)
          times_.push_back(frame.time);
      }
      count_ += count;
      pollfd socket{channel_->descriptor(), POLLIN, 0};
      if (count < frames.size())
        poll(&socket, 1, 20);
    }
  }

  const std::unique_ptr<can_bridge::Channel> channel_;
  std::vector<Instant> times_;  // of the thread
  std::atomic<std::size_t> count_{0};
  std::atomic<bool> ending_{false};
  std::thread thread_;
};

// The intervals of SYNCs in parts of the run.
struct SyncIntervals {
  std::vector<double> jitter;  // ms, the difference of each to the period
  int missing = 0;

  double quantile(double part) const {
    return jitter.empty() ? 0 : jitter[static_cast<std::size_t>(part * double(jitter.size() - 1))];
  }
  void print(const char* when) const {
    std::printf("SYNC %s: %zu, missing %d; jitter p50 %.2f ms, p95 %.2f ms, most %.2f ms\n", when,
                jitter.size(), missing, quantile(0.5), quantile(0.95), quantile(1));
  }
};

using Span = std::pair<Instant, Instant>;

// A SYNC is missing after an interval of almost two periods or more, since a late one only delays.
SyncIntervals intervals(const std::vector<Instant>& times, const std::vector<Span>& spans) {
  SyncIntervals out;
  for (const auto& [begin, end] : spans) {
    const auto last = std::lower_bound(times.begin(), times.end(), end);
    auto before = std::lower_bound(times.begin(), last, begin);
    for (auto time = before; time != last; before = time++) {
      if (time == before)
        continue;
      const Duration interval = *time - *before;
      const auto periods = std::max<std::int64_t>(1, (interval + kPeriod / 4) / kPeriod);
      out.missing += static_cast<int>(periods - 1);
      const Duration difference = interval - periods * kPeriod;
      out.jitter.push_back(std::abs(std::chrono::duration<double, std::milli>(difference).count()));
    }
  }
  std::sort(out.jitter.begin(), out.jitter.end());
  return out;
}

class DdsSyncTest : public DdsFaultsTest {
 protected:
  std::string with_pulse() const {
    return text() + "  - {name: pulse, interface: \"udp:239.74.163.12:" + std::to_string(port_) +
           "\", sync: 20ms}\n";
  }
  void expect_sync_undisturbed(const std::vector<Instant>& times) {
    const SyncIntervals quiet = intervals(times, quiet_);
    const SyncIntervals disturbed = intervals(times, disturbed_);
    quiet.print("undisturbed");
    disturbed.print("while DDS fails");
    ASSERT_GT(quiet.jitter.size(), 100U);
    ASSERT_GT(disturbed.jitter.size(), 100U);
    // The machine of a test may be busy: both parts are compared, with room for its accidents.
    EXPECT_LE(disturbed.quantile(0.95), 3 * quiet.quantile(0.95) + 5);
    EXPECT_LE(disturbed.missing, quiet.missing + static_cast<int>(disturbed.jitter.size() / 50));
  }

  const std::uint16_t port_ = static_cast<std::uint16_t>(43'300 + test::own_domain());
  std::vector<Span> quiet_;
  std::vector<Span> disturbed_;
};

TEST_F(DdsSyncTest, SyncIsAsPunctualWhileTheProcessIsKilledStoppedLoopsOrUsesUpItsMemory) {
  SyncRecorder recorder(port_);
  ASSERT_TRUE(gateway_->reload(make_plant(with_pulse())).done);
  ASSERT_TRUE(meanwhile([&] { return recorder.receives(); }));
  pass(1s);
  for (const int fault : {SIGKILL, SIGABRT, SIGSTOP, SIGUSR1, SIGUSR2, SIGRTMIN, SIGRTMIN + 1}) {
    const Instant begin = monotonic_now();
    pass(1500ms);
    const Instant fault_begin = monotonic_now();
    const pid_t present = dds_process();
    kill(present, fault);
    ASSERT_TRUE(back_after(present)) << "signal " << fault;
    quiet_.emplace_back(begin, fault_begin);
    disturbed_.emplace_back(fault_begin, monotonic_now());
  }
  expect_sync_undisturbed(recorder.stop());
  EXPECT_EQ(strict_.missing_events("pulse"), 0U);
}

}  // namespace
}  // namespace linegate::gateway

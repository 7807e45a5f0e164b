// SPDX-License-Identifier: Apache-2.0
// The cost of a received frame in an executor, compared with a bare loop with the same epoll,
// stamps and batch size. Figures are CPU time of the receiving thread, per frame.
//
// saturated: when the receiving thread has drained its socket, it writes 512 frames into it, with
//   its clock stopped meanwhile. So every batch is full, whatever else runs on the machine.
// paced: another thread sends a frame every 114.2 us, the load of a full bus at 1 Mbit/s.
//
// The executor runs a manager's line with 64 PDOs of 8 booted nodes. A thread in the place of the
// publisher takes its output, 100 images a second, and discards it.
#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include <unistd.h>

#include "gateway/runtime/executor.h"

#include "tests/bench/allocations.h"
#include "tests/bench/bare_loop.h"
#include "tests/bench/clock.h"
#include "tests/bench/measure.h"
#include "tests/bench/measured_line.h"
#include "tests/bench/pdo_line.h"
#include "tests/bench/thread_counts.h"
#include "tests/bench/wire.h"

namespace {

using namespace linegate;
using bench::Contestant;
using namespace std::chrono_literals;

constexpr std::size_t kPdos = 64;
constexpr int kNodes = 8;
constexpr std::size_t kFill = 512;          // frames
constexpr unsigned kRounds = 100;           // fills in one repetition
constexpr std::size_t kPacedFrames = 1500;  // in one repetition
constexpr std::int64_t kPeriod = 114'194;   // ns: 8757 frames/s

// The totals of a receiving thread, for other threads to read.
struct Totals {
  std::uint64_t system_calls = 0;
  std::uint64_t waits = 0;
  std::uint64_t allocations = 0;
  std::int64_t cpu = 0;  // ns, without the time for filling the socket

  Totals operator-(const Totals& other) const {
    return {system_calls - other.system_calls, waits - other.waits, allocations - other.allocations,
            cpu - other.cpu};
  }
};

// The sending end of a wire, and the counts of the receiving thread.
class Load {
 public:
  Load() : frames_(bench::raw(bench::pdo_frames(bench::pdo_identifiers(kPdos), 4096))) {}

  bench::Wire wire;
  bench::ThreadClock clock;  // of the receiving thread

  // --- receiving thread -----------------------------------------------------------------------

  // Called when every frame has been read.
  void drained() {
    const unsigned rounds = rounds_.load(std::memory_order_acquire);
    if (rounds == 0) {
      return;
    }
    stop_clock();
    if (rounds > 1) {
      fill();
    }
    rounds_.store(rounds - 1, std::memory_order_release);
  }

  // --- main thread ----------------------------------------------------------------------------

  // Fills the socket kRounds times and returns the cost for the receiving thread.
  Totals saturate() {
    rounds_.store(kRounds + 2, std::memory_order_release);
    poke();
    while (rounds_.load(std::memory_order_acquire) != 0) {
      std::this_thread::sleep_for(200us);
    }
    return last_ - first_;
  }

  Totals pace() {
    const std::int64_t before = clock.now();
    bench::Pacer pacer(kPeriod);
    for (std::size_t i = 0; i < kPacedFrames; ++i) {
      pacer.wait();
      send(1);
    }
    std::this_thread::sleep_for(2ms);
    Totals out;
    out.cpu = clock.now() - before;
    return out;
  }

  // The receiving thread copies its totals when it has read one more frame.
  Totals counted() {
    rounds_.store(1, std::memory_order_release);
    poke();
    while (rounds_.load(std::memory_order_acquire) != 0) {
      std::this_thread::sleep_for(200us);
    }
    return last_;
  }

  std::uint64_t sent() const { return sent_.load(); }

 private:
  void stop_clock() {
    const bench::ThreadCounts& counts = bench::thread_counts();
    last_ = {counts.system_calls - filling_.system_calls, counts.waits, bench::allocations(),
             clock.now() - filling_.cpu};
    if (rounds_.load(std::memory_order_relaxed) == kRounds + 1) {
      first_ = last_;
    }
  }
  void fill() {
    const std::int64_t before = clock.now();
    const std::uint64_t calls = bench::thread_counts().system_calls;
    send(kFill);
    filling_.system_calls += bench::thread_counts().system_calls - calls;
    filling_.cpu += clock.now() - before;
  }
  // Wakes the receiving thread, which may start to fill the socket at the same time.
  void poke() {
    can_frame frame = frames_[0];
    wire.send(std::span(&frame, 1));
    ++sent_;
  }
  void send(std::size_t count) {
    if (at_ + count > frames_.size()) {
      at_ = 0;
    }
    wire.send(std::span(frames_).subspan(at_, count));
    at_ += count;
    sent_ += count;
  }

  std::vector<can_frame> frames_;
  std::size_t at_ = 0;
  std::atomic<std::uint64_t> sent_{0};
  std::atomic<unsigned> rounds_{0};
  Totals filling_;
  Totals first_;  // at the start of the first full round
  Totals last_;
};

// --- the two sides ------------------------------------------------------------------------------

class Bare {
 public:
  explicit Bare(Load& load) : load_(load), thread_([this] { run(); }) {}
  ~Bare() {
    stop_ = true;
    thread_.join();
    close(load_.wire.far());
  }
  std::uint64_t received() const { return received_.load(); }

 private:
  void run() {
    bench::BareLoop loop(load_.wire.far());
    load_.clock.begin();
    std::uint64_t sum = 0;
    std::uint64_t received = 0;
    while (!stop_) {
      loop.wait();
      loop.drain([&](const can_frame& frame, std::int64_t stamp) {
        sum += frame.can_id + frame.data[0] + static_cast<std::uint64_t>(stamp);
        ++received;
      });
      received_.store(received, std::memory_order_relaxed);
      load_.drained();
    }
    bench::require(sum != 0, "nothing was received");
  }

  Load& load_;
  std::atomic<bool> stop_{false};
  std::atomic<std::uint64_t> received_{0};
  std::thread thread_;
};

class Gateway {
 public:
  explicit Gateway(Load& load) : publisher_([this] { take(); }), executor_({}) {
    config::LinePlan plan;
    plan.config = bench::pdo_line(bench::Mapping::event_driven, bench::pdo_identifiers(kPdos));
    executor_.add(std::make_unique<bench::ClockedRunner>(
        bench::make_runner(bench::make_line(plan.config), load.wire, plan, port_,
                           publisher_.wakeup),
        load.clock, [&load] { load.drained(); }));
    publisher_.start();
    executor_.start();
    load.clock.wait_begun();
    load.wire.play_devices(kNodes, 500);
    bench::require(running_, "the line's manager does not run");
  }
  ~Gateway() {
    executor_.request_stop();
    executor_.join();
  }

  // Number of PDOs received, as reported by the line's status ten times a second.
  std::uint64_t received() const {
    std::this_thread::sleep_for(300ms);
    return rpdos_.load();
  }

 private:
  void take() {
    if (const gateway::LineStatus* status = bench::discard_reports(port_)) {
      running_ = bench::manager_runs(*status);
      rpdos_ = status->state.counters.rpdos;
    }
    bench::discard_images(port_);
  }

  std::atomic<bool> running_{false};
  std::atomic<std::uint64_t> rpdos_{0};
  gateway::LinePort port_;
  bench::PublisherThread publisher_;
  gateway::Executor executor_;
};

// --- figures ------------------------------------------------------------------------------------

struct Counts {
  double system_calls = 0;
  double waits = 0;
  double frames = 0;
  std::uint64_t allocations = 0;

  void add(const Totals& totals, double of) {
    system_calls += static_cast<double>(totals.system_calls);
    waits += static_cast<double>(totals.waits);
    allocations += totals.allocations;
    frames += of;
  }
  std::string text() const {
    char out[80];
    std::snprintf(out, sizeof out, ", %.3f system calls and %.3f wake-ups a frame",
                  system_calls / frames, waits / frames);
    return out;
  }
};

double saturated(Load& load, Counts& counts) {
  const Totals spent = load.saturate();
  constexpr double kFrames = double{kRounds} * kFill;
  counts.add(spent, kFrames);
  return static_cast<double>(spent.cpu) / kFrames;
}

double paced(Load& load, Counts& counts) {
  const Totals before = load.counted();
  const Totals spent = load.pace();
  counts.add(load.counted() - before, kPacedFrames);
  return static_cast<double>(spent.cpu) / kPacedFrames;
}

template <class Figure>
void compare(const char* heading, const char* name, Load& bare, Load& gateway, Figure figure,
             std::uint64_t& allocations) {
  Counts until_warm;
  (void)figure(bare, until_warm);
  (void)figure(gateway, until_warm);
  std::array<Counts, 2> counts;
  std::vector<Contestant> contestants;
  contestants.push_back({"bare loop", [&] { return figure(bare, counts[0]); }, {}});
  contestants.push_back({"executor", [&] { return figure(gateway, counts[1]); }, {}});
  bench::interleave(contestants);
  bench::print_heading(heading);
  for (std::size_t i = 0; i < 2; ++i) {
    bench::print_figure(contestants[i], "ns", counts[i].text());
  }
  bench::print_target(std::string(name) + ": to the bare loop",
                      bench::median_ratio(contestants[1], contestants[0]), 1.3, "x");
  allocations += counts[1].allocations;
}

}  // namespace

int main() {
  Load bare_load;
  Load gateway_load;
  std::uint64_t allocations = 0;
  {
    Bare bare(bare_load);
    Gateway gateway(gateway_load);
    bare_load.clock.wait_begun();
    compare("Executor, CPU time per frame: saturated, batches of 64", "saturated", bare_load,
            gateway_load, saturated, allocations);
    compare("Executor, CPU time per frame: 8757 frames/s", "paced", bare_load, gateway_load, paced,
            allocations);
    bench::require(bare.received() == bare_load.sent(), "the bare loop missed frames");
    bench::require(gateway.received() == gateway_load.sent(), "the line missed frames");
  }
  bench::print_heading("Allocations in an executor, steady state");
  bench::print_target("in all of the above", static_cast<double>(allocations), 0, "allocations");
}

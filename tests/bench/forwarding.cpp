// SPDX-License-Identifier: Apache-2.0
// A PDO that is forwarded from one line to another, compared with bare loops that copy the frame
// from one socket to the other, with the same epoll, stamps and batch size. No CAN bus is involved.
//
// Within an executor: compared with one thread that reads one socket and writes the other. Across
// executors: compared with a thread that reads and one that writes, which hand over the newest
// frame and wake each other like executors.
//
// Latency: from before the frame is sent until it is read at the far end, by one thread that does
// both and nothing in between. CPU: time of the forwarding threads per frame, at 2000 frames/s; for
// the lines it includes the images that they hand over, 100 a second each.
//
// Both with all threads on one processor, and with the measuring thread on a separate processor.
#include <array>
#include <atomic>
#include <string>
#include <thread>
#include <vector>

#include <unistd.h>

#include "bridges/can/socketcan.h"
#include "gateway/exchange/handover.h"
#include "gateway/exchange/wakeup.h"

#include "tests/bench/bare_loop.h"
#include "tests/bench/forwarding_course.h"
#include "tests/bench/forwarding_lines.h"
#include "tests/bench/measure.h"
#include "tests/bench/placement.h"

namespace {

using namespace linegate;
using bench::Contestant;

constexpr std::size_t kFrames = 400;  // of one repetition

class BareOneThread final : public bench::WiredCourse {
 public:
  explicit BareOneThread(const bench::Placement& where)
      : thread_([this, &where] { run(where.forwarding[0]); }) {
    count(clock_);
  }
  ~BareOneThread() override {
    stop_ = true;
    thread_.join();
    close(in.far());
    close(out.far());
  }

 private:
  void run(unsigned processor) {
    bench::run_on({processor});
    bench::BareLoop loop(in.far());
    clock_.begin();
    while (!stop_) {
      loop.wait();
      loop.drain([&](const can_frame& frame, std::int64_t) { bench::send_on(out.far(), frame); });
    }
  }

  bench::ThreadClock clock_;
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

class BareTwoThreads final : public bench::WiredCourse {
 public:
  explicit BareTwoThreads(const bench::Placement& where)
      : reader_([this, &where] { read(where.forwarding[0]); }),
        writer_([this, &where] { write(where.forwarding[1]); }) {
    count(reading_);
    count(writing_);
  }
  ~BareTwoThreads() override {
    stop_ = true;
    wakeup_.signal();
    reader_.join();
    writer_.join();
    close(in.far());
    close(out.far());
  }

 private:
  void read(unsigned processor) {
    bench::run_on({processor});
    bench::BareLoop loop(in.far());
    reading_.begin();
    while (!stop_) {
      loop.wait();
      loop.drain([&](const can_frame& frame, std::int64_t) {
        newest_.draft().value = frame;
        newest_.publish();
        wakeup_.signal();
      });
    }
  }
  void write(unsigned processor) {
    bench::run_on({processor});
    bench::BareLoop loop(wakeup_.descriptor());
    writing_.begin();
    while (!stop_) {
      loop.wait();
      wakeup_.clear();
      if (const can_frame* frame = newest_.fetch()) {
        bench::send_on(out.far(), *frame);
      }
    }
  }

  bench::ThreadClock reading_;
  bench::ThreadClock writing_;
  exchange::Handover<can_frame> newest_;
  exchange::Wakeup wakeup_;
  std::atomic<bool> stop_{false};
  std::thread reader_;
  std::thread writer_;
};

class Forwarding final : public bench::WiredCourse {
 public:
  Forwarding(const bench::Placement& where, bool together)
      : lines_(
            {can_bridge::open_on_descriptor(in.far()), can_bridge::open_on_descriptor(out.far())},
            together, {where.forwarding[0], where.forwarding[1]}) {
    for (std::size_t i = 0; i < lines_.threads(); ++i) {
      count(lines_.clock(i));
    }
    start_nodes();
  }

 private:
  bench::ForwardingLines lines_;
};

void compare(const bench::Placement& placement, const std::string& executors, const char* bare_name,
             const bench::Course& bare, const bench::Course& gateway) {
  const std::string where = executors + ", " + placement.name;
  bench::run_on({placement.measuring});
  std::array<bench::ForwardingFigures, 2> figures;
  std::vector<Contestant> contestants;
  contestants.push_back(
      {bare_name, [&] { return bench::measure_forwarding(bare, kFrames, figures[0]); }, {}});
  contestants.push_back(
      {"forwarding", [&] { return bench::measure_forwarding(gateway, kFrames, figures[1]); }, {}});
  bench::interleave(contestants);
  const auto print = [&](const char* what, const Contestant& loop, const Contestant& forwarding) {
    bench::print_heading("PDO forwarded line to line, " + where + ": " + what);
    bench::print_figure(loop, "ns");
    bench::print_figure(forwarding, "ns");
    bench::print_target(where + ", " + what + ": to the bare loop",
                        bench::median_ratio(forwarding, loop), 1.3, "x");
  };
  print("latency p50", contestants[0], contestants[1]);
  print("latency p99", bench::beside(contestants[0], figures[0].p99),
        bench::beside(contestants[1], figures[1].p99));
  print("CPU time a frame", bench::beside(contestants[0], figures[0].cpu),
        bench::beside(contestants[1], figures[1].cpu));
}

}  // namespace

int main() {
  for (const bench::Placement& placement : bench::placements()) {
    {
      bench::run_on(placement.others);
      const BareOneThread bare(placement);
      const Forwarding gateway(placement, true);
      compare(placement, "within an executor", "one thread, two sockets", bare, gateway);
    }
    bench::run_on(placement.others);
    const BareTwoThreads bare(placement);
    const Forwarding gateway(placement, false);
    compare(placement, "across executors", "two threads", bare, gateway);
  }
}

// SPDX-License-Identifier: Apache-2.0
// Lines at the load of a full bus at 1 Mbit/s, all at the same time and in real time. Another
// process sends the frames and never waits for a receiver:
//
//   measure_lines [--seconds 600] [--lines 8] [--executors N] [--leave-out N]
//
// Each line is a manager with 64 PDOs of 8 booted nodes on a socket pair, run by its own executor
// unless --executors specifies their number. Every PDO carries numbers. A thread in the place of
// the publisher takes 100 images a second of each line and checks that no number is missing: the
// image has the last number, and its mark the number of frames.
//
// Exits with 1 if a frame was lost between the sender and the image. --leave-out: the sender skips
// a number before every Nth frame, which must be noticed.
#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <memory>
#include <string>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

#include <unistd.h>

#include "gateway/runtime/executor.h"

#include "tests/bench/clock.h"
#include "tests/bench/load_sender.h"
#include "tests/bench/measure.h"
#include "tests/bench/measured_line.h"
#include "tests/bench/numbers_in_image.h"
#include "tests/bench/pdo_line.h"
#include "tests/bench/wire.h"

namespace {

using namespace linegate;
using namespace std::chrono_literals;

constexpr std::size_t kPdos = 64;

struct Options {
  std::uint32_t seconds = 600;
  std::uint32_t lines = 8;
  std::uint32_t executors = 0;  // 0: one per line
  std::uint32_t leave_out = 0;
};

double resident_mib() {
  std::ifstream statm("/proc/self/statm");
  std::uint64_t size = 0;
  std::uint64_t resident = 0;
  statm >> size >> resident;
  return static_cast<double>(resident) * static_cast<double>(sysconf(_SC_PAGESIZE)) / 1048576.0;
}

// Values of a running line, from its status.
struct Seen {
  std::atomic<bool> running{false};
  std::atomic<std::uint32_t> load_permille{0};
  std::atomic<std::uint64_t> lost{0};
  std::atomic<std::uint32_t> longest_queue{0};
  std::atomic<std::uint32_t> events_waiting{0};
  std::atomic<std::uint64_t> received{0};
};

struct LineUnderLoad {
  gateway::LinePort port;
  Seen seen;
  std::unique_ptr<bench::NumbersInImage> numbers;
};

class Lines {
 public:
  Lines(const Options& options, const std::vector<std::unique_ptr<bench::Wire>>& wires)
      : clocks_(options.executors), publisher_([this] { take(); }) {
    for (std::size_t i = 0; i < clocks_.size(); ++i) {
      executors_.push_back(std::make_unique<gateway::Executor>(config::ExecutorPlan{}));
    }
    for (std::size_t i = 0; i < wires.size(); ++i) {
      add(*wires[i], i % clocks_.size());
    }
    publisher_.start();
    for (const auto& executor : executors_) {
      executor->start();
    }
  }
  ~Lines() {
    for (const auto& executor : executors_) {
      executor->request_stop();
    }
    executors_.clear();
  }

  void wait_running() const {
    for (int tries = 0; !std::all_of(all_.begin(), all_.end(),
                                     [](const auto& line) { return line->seen.running.load(); });
         ++tries) {
      bench::require(tries < 3000, "the managers do not run");
      std::this_thread::sleep_for(10ms);
    }
  }

  const std::vector<std::unique_ptr<LineUnderLoad>>& all() const { return all_; }
  std::vector<double> cpu() const {
    std::vector<double> out;
    for (const auto& clock : clocks_) {
      out.push_back(static_cast<double>(clock.now()) / 1e9);
    }
    return out;
  }

 private:
  void add(const bench::Wire& wire, std::size_t executor) {
    auto line = std::make_unique<LineUnderLoad>();
    config::LinePlan plan;
    plan.config = bench::pdo_line(bench::Mapping::event_driven, bench::pdo_identifiers(kPdos));
    std::unique_ptr<line::Line> stack = bench::make_line(plan.config);
    line->numbers =
        std::make_unique<bench::NumbersInImage>(stack->layout(image::Direction::inputs));
    executors_[executor]->add(std::make_unique<bench::ClockedRunner>(
        bench::make_runner(std::move(stack), wire, plan, line->port, publisher_.wakeup),
        clocks_[executor]));
    all_.push_back(std::move(line));
  }

  void take() {
    for (const auto& line : all_) {
      take(*line);
    }
  }
  static void take(LineUnderLoad& line) {
    if (const gateway::LineStatus* status = bench::discard_reports(line.port)) {
      Seen& seen = line.seen;
      seen.running = bench::manager_runs(*status);
      seen.load_permille = status->state.load_permille;
      seen.lost = status->state.counters.frames_lost;
      seen.longest_queue = std::max(seen.longest_queue.load(), status->queues.receive_peak);
      seen.events_waiting = std::max(seen.events_waiting.load(), status->queues.events);
    }
    if (const auto* snapshot = line.port.image(image::Direction::inputs).fetch()) {
      line.numbers->take(*snapshot);
      line.seen.received = line.numbers->frames();
    }
    (void)line.port.image(image::Direction::outputs).fetch();
  }

  std::vector<bench::ThreadClock> clocks_;
  std::vector<std::unique_ptr<LineUnderLoad>> all_;
  bench::PublisherThread publisher_;
  std::vector<std::unique_ptr<gateway::Executor>> executors_;
};

void print_progress(const Lines& lines, std::uint32_t second) {
  std::uint32_t lowest = 1000;
  std::uint32_t highest = 0;
  std::uint64_t lost = 0;
  std::uint32_t longest = 0;
  std::uint32_t events = 0;
  for (const auto& line : lines.all()) {
    lowest = std::min(lowest, line->seen.load_permille.load());
    highest = std::max(highest, line->seen.load_permille.load());
    lost += line->seen.lost;
    longest = std::max(longest, line->seen.longest_queue.exchange(0));
    events = std::max(events, line->seen.events_waiting.exchange(0));
  }
  std::printf(
      "    %4u s: load %.1f to %.1f %%, lost %llu, longest queues: %u frames, %u events; "
      "%.1f MiB\n",
      second, lowest / 10.0, highest / 10.0, static_cast<unsigned long long>(lost), longest, events,
      resident_mib());
  std::fflush(stdout);
}

void run_for(const Lines& lines, std::uint32_t seconds) {
  const std::uint32_t step = seconds > 60 ? 10 : 1;
  const auto start = std::chrono::steady_clock::now();
  for (std::uint32_t second = step; second <= seconds; second += step) {
    std::this_thread::sleep_until(start + std::chrono::seconds(second));
    print_progress(lines, second);
  }
}

// Waits until each line has received all frames that were sent on it. A frame may be in an image
// that is not due yet.
void wait_received(const Lines& lines, const std::vector<bench::SenderReport>& sent) {
  for (int tries = 0; tries < 500; ++tries) {
    bool all = true;
    for (std::size_t i = 0; i < sent.size(); ++i) {
      all = all && lines.all()[i]->seen.received.load() >= sent[i].sent;
    }
    if (all) {
      return;
    }
    std::this_thread::sleep_for(10ms);
  }
}

// Returns the number of frames of all lines that were lost or differ in the image.
std::uint64_t print_frames(const Lines& lines, const std::vector<bench::SenderReport>& sent) {
  std::uint64_t bad = 0;
  bench::print_heading("Frames: sent, not taken by the socket, in the image, missing, torn apart");
  for (std::size_t i = 0; i < sent.size(); ++i) {
    const bench::NumbersInImage& numbers = *lines.all()[i]->numbers;
    std::printf("    line %zu: %10llu %6llu %10llu %6llu %6llu\n", i + 1,
                static_cast<unsigned long long>(sent[i].sent),
                static_cast<unsigned long long>(sent[i].refused),
                static_cast<unsigned long long>(numbers.frames()),
                static_cast<unsigned long long>(numbers.missing()),
                static_cast<unsigned long long>(numbers.torn()));
    bad += sent[i].refused + numbers.missing() + numbers.torn() + lines.all()[i]->seen.lost +
           (sent[i].sent - numbers.frames());
  }
  return bad;
}

void print_cpu(const std::vector<double>& before, const std::vector<double>& after, double elapsed,
               double frames) {
  bench::print_heading("CPU time of the executors");
  double total = 0;
  for (std::size_t i = 0; i < before.size(); ++i) {
    const double cpu = after[i] - before[i];
    total += cpu;
    std::printf("    executor %zu: %8.2f s, %5.2f %% of a core\n", i + 1, cpu, 100 * cpu / elapsed);
  }
  std::printf("    together %.0f ns a frame\n", total * 1e9 / frames);
  bench::print_target("all of them", 100 * total / elapsed, 50, "% of a core");
}

int measure(const Options& options) {
  std::vector<std::unique_ptr<bench::Wire>> wires;
  for (std::uint32_t i = 0; i < options.lines; ++i) {
    wires.push_back(std::make_unique<bench::Wire>());
  }
  bench::LoadSender sender(wires, kPdos);  // forks, so it must precede any thread
  Lines lines(options, wires);
  lines.wait_running();
  sender.wait_ready();

  std::printf("%u lines at %lld frames/s each, sent by process %d\n", options.lines,
              static_cast<long long>(bench::kFramesPerSecond), static_cast<int>(sender.process()));
  const double memory = resident_mib();
  const auto start = std::chrono::steady_clock::now();
  const std::vector<double> before = lines.cpu();
  sender.go(options.seconds, options.leave_out);
  run_for(lines, options.seconds);
  std::uint64_t late = 0;
  const std::vector<bench::SenderReport> sent = sender.wait(late);
  const double elapsed =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  const std::vector<double> after = lines.cpu();
  wait_received(lines, sent);

  double frames = 0;
  for (const bench::SenderReport& report : sent) {
    frames += static_cast<double>(report.sent);
  }
  const std::uint64_t bad = print_frames(lines, sent);
  std::printf("    %.1f frames/s a line over %.3f s; the sender was late by %.1f ms altogether\n",
              frames / elapsed / options.lines, elapsed, static_cast<double>(late) / 1e6);
  print_cpu(before, after, elapsed, frames);
  bench::print_heading("Memory");
  std::printf("    resident: %.2f MiB before the load, %.2f MiB at its end\n", memory,
              resident_mib());
  bench::print_target("frames lost", static_cast<double>(bad), 0, "frames");
  return bad == 0 ? 0 : 1;
}

bool parse(int count, char** words, Options& out) {
  for (int i = 1; i + 1 < count; i += 2) {
    const std::string_view name = words[i];
    const auto value = static_cast<std::uint32_t>(std::strtoul(words[i + 1], nullptr, 10));
    if (name == "--seconds") {
      out.seconds = value;
    } else if (name == "--lines") {
      out.lines = value;
    } else if (name == "--executors") {
      out.executors = value;
    } else if (name == "--leave-out") {
      out.leave_out = value;
    } else {
      return false;
    }
  }
  out.executors = out.executors == 0 ? out.lines : out.executors;
  return count % 2 == 1 && out.seconds > 0 && out.lines > 0;
}

}  // namespace

int main(int count, char** words) {
  Options options;
  if (!parse(count, words, options)) {
    std::fprintf(
        stderr, "usage: measure_lines [--seconds N] [--lines N] [--executors N] [--leave-out N]\n");
    return 2;
  }
  return measure(options);
}

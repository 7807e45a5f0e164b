// A PDO forwarded from one line to another, beside bare loops that move the frame from one socket
// to the other: with the same epoll, stamps and batch size. Nothing is measured on a wire.
//
// Within an executor: beside one thread that reads one socket and writes the other. Across
// executors: beside a thread that reads and one that writes, which hand over the newest frame and
// wake each other as executors do.
//
// Latency: from before the frame is sent to when it was read at the far end, by one thread that
// does both and nothing meanwhile. CPU: time of the forwarding threads a frame, at 2000 frames/s.
#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <memory>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <poll.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>

#include "bridges/can/socketcan.h"
#include "gateway/binder.h"
#include "gateway/exchange/handover.h"
#include "gateway/executor.h"
#include "gateway/line_runner.h"

#include "tests/bench/bare_loop.h"
#include "tests/bench/measure.h"
#include "tests/bench/wire.h"

namespace {

using namespace linegate;
using bench::Contestant;
using namespace std::chrono_literals;

constexpr std::size_t kFrames = 400;  // of one repetition
constexpr Duration kPace = 500us;
constexpr std::uint32_t kIn = 0x185;
constexpr std::uint32_t kOut = 0x205;

std::int64_t cpu_time(clockid_t clock) {
  timespec time{};
  clock_gettime(clock, &time);
  return std::int64_t{time.tv_sec} * 1'000'000'000 + time.tv_nsec;
}

// A thread's CPU clock, when it has begun.
class ThreadClock {
 public:
  void begin() {
    pthread_getcpuclockid(pthread_self(), &clock_);
    begun_.store(true);
  }
  std::int64_t now() const {
    while (!begun_.load()) {
      std::this_thread::sleep_for(1ms);
    }
    return cpu_time(clock_);
  }

 private:
  clockid_t clock_{};
  std::atomic<bool> begun_{false};
};

// The two ends of what is measured: frames go in here and come out there.
class Course {
 public:
  virtual ~Course() = default;
  bench::Wire in;
  bench::Wire out;
  std::vector<const ThreadClock*> clocks;

  std::int64_t cpu() const {
    std::int64_t sum = 0;
    for (const ThreadClock* clock : clocks) {
      sum += clock->now();
    }
    return sum;
  }

  // From before it is sent to when it has been read, in ns.
  std::int64_t pass(unsigned number) {
    can_frame frame{};
    frame.can_id = kIn;
    frame.len = 3;
    frame.data[0] = static_cast<std::uint8_t>(number);
    frame.data[1] = static_cast<std::uint8_t>(number >> 8U);
    frame.data[2] = static_cast<std::uint8_t>(number % 7);
    const std::int64_t begin = cpu_time(CLOCK_MONOTONIC);
    bench::require(::send(in.near(), &frame, sizeof frame, 0) == sizeof frame, "nothing sent");
    can_frame came{};
    pollfd readable{out.near(), POLLIN, 0};
    bench::require(poll(&readable, 1, 1000) == 1, "nothing was forwarded");
    bench::require(recv(out.near(), &came, sizeof came, 0) == sizeof came, "nothing was read");
    const std::int64_t end = cpu_time(CLOCK_MONOTONIC);
    bench::require(came.can_id == kOut && came.data[0] == frame.data[0] &&
                       came.data[1] == frame.data[1] && came.data[2] == frame.data[2],
                   "something else was forwarded");
    return end - begin;
  }
};

void send_on(int descriptor, can_frame frame) {
  frame.can_id = kOut;
  bench::require(::send(descriptor, &frame, sizeof frame, 0) == sizeof frame, "nothing sent");
}

class BareOneThread final : public Course {
 public:
  BareOneThread() : thread_([this] { run(); }) { clocks = {&clock_}; }
  ~BareOneThread() override {
    stop_ = true;
    thread_.join();
    close(in.far());
    close(out.far());
  }

 private:
  void run() {
    bench::BareLoop loop(in.far());
    clock_.begin();
    while (!stop_) {
      loop.wait();
      loop.drain([&](const can_frame& frame, std::int64_t) { send_on(out.far(), frame); });
    }
  }

  ThreadClock clock_;
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

class BareTwoThreads final : public Course {
 public:
  BareTwoThreads() : reader_([this] { read(); }), writer_([this] { write(); }) {
    clocks = {&reading_, &writing_};
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
  void read() {
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
  void write() {
    bench::BareLoop loop(wakeup_.descriptor());
    writing_.begin();
    while (!stop_) {
      loop.wait();
      wakeup_.clear();
      if (const can_frame* frame = newest_.fetch()) {
        send_on(out.far(), *frame);
      }
    }
  }

  ThreadClock reading_;
  ThreadClock writing_;
  exchange::Handover<can_frame> newest_;
  exchange::Wakeup wakeup_;
  std::atomic<bool> stop_{false};
  std::thread reader_;
  std::thread writer_;
};

class Clocked final : public gateway::Runner {
 public:
  Clocked(std::unique_ptr<gateway::LineRunner> runner, ThreadClock& clock)
      : runner_(std::move(runner)), clock_(clock) {}

  int descriptor() const override { return runner_->descriptor(); }
  bool wants_writable() const override { return runner_->wants_writable(); }
  void service(Instant now) override {
    if (!std::exchange(begun_, true)) {
      clock_.begin();
    }
    runner_->service(now);
  }
  Instant next_wake() const override { return runner_->next_wake(); }
  void stop(Instant now) override { runner_->stop(now); }
  bool stopped(Instant now) const override { return runner_->stopped(now); }

 private:
  std::unique_ptr<gateway::LineRunner> runner_;
  ThreadClock& clock_;
  bool begun_ = false;
};

// Lines that obey another master, so that they need no boot.
constexpr const char* kPlant = R"(schema: 1
lines:
  - name: press
    interface: virtual:press
    nodes: [{id: 5, name: axis, eds: bridges/sim/eds/drive.eds}]
  - name: hall
    interface: virtual:hall
    nodes: [{id: 5, name: axis, eds: bridges/sim/eds/drive.eds}]
forward:
  - press.axis.6041:0 -> hall.axis.6040:0
  - press.axis.6061:0 -> hall.axis.6060:0
)";

class Forwarding final : public Course {
 public:
  explicit Forwarding(bool together)
      : plant_(*config::read(kPlant, LINEGATE_SOURCE_DIR "/plant.yaml").value),
        link_(plant_.bindings),
        taker_([this] { take(); }) {
    executors_.push_back(std::make_unique<gateway::Executor>(config::ExecutorPlan{}));
    if (!together) {
      executors_.push_back(std::make_unique<gateway::Executor>(config::ExecutorPlan{}));
    }
    std::array<std::unique_ptr<gateway::LineRunner>, 2> runners;
    for (std::size_t i = 0; i < 2; ++i) {
      config::LinePlan& plan = plant_.lines[i];
      plan.config.role = line::Role::device;
      runners[i] = std::make_unique<gateway::LineRunner>(
          *std::move(line::Line::make(plan.config).value),
          can_bridge::open_on_descriptor((i == 0 ? in : out).far()), plan, ports_[i], wakeup_);
    }
    link_.runner = together ? runners[1].get() : nullptr;
    link_.taker = &executors_.back()->wakeup();
    runners[0]->bind({gateway::BoundSource(link_)}, {});
    runners[1]->bind({}, {gateway::BoundTarget(link_)});
    for (std::size_t i = 0; i < 2; ++i) {
      executor(i).add(std::make_unique<Clocked>(std::move(runners[i]), clock(i)));
    }
    for (const auto& one : executors_) {
      one->start();
    }
    clocks = {&clocks_[0]};
    if (!together) {
      clocks.push_back(&clocks_[1]);
    }
    begin();
  }
  ~Forwarding() override {
    for (const auto& one : executors_) {
      one->request_stop();
      one->join();
    }
    stop_ = true;
    wakeup_.signal();
    taker_.join();
  }

 private:
  gateway::Executor& executor(std::size_t line) {
    return *executors_[std::min(line, executors_.size() - 1)];
  }
  ThreadClock& clock(std::size_t line) { return clocks_[std::min(line, executors_.size() - 1)]; }

  // Starts both nodes; what they say to that is not of interest.
  void begin() {
    can_frame start{};
    start.len = 2;
    start.data[0] = 1;
    for (const bench::Wire* wire : {&in, &out}) {
      std::this_thread::sleep_for(50ms);
      wire->send(std::span(&start, 1));
    }
    std::this_thread::sleep_for(50ms);
    can_frame ignored{};
    while (recv(out.near(), &ignored, sizeof ignored, MSG_DONTWAIT) > 0) {
    }
  }
  void take() {
    while (!stop_) {
      pollfd readable{wakeup_.descriptor(), POLLIN, 0};
      poll(&readable, 1, -1);
      wakeup_.clear();
      for (gateway::LinePort& port : ports_) {
        for (Event event; port.events.pop(event);) {
        }
        for (gateway::NodeStatus node; port.nodes.pop(node);) {
        }
        (void)port.status.fetch();
        for (const auto direction : {image::Direction::inputs, image::Direction::outputs}) {
          (void)port.image(direction).fetch();
        }
      }
    }
  }

  config::Plant plant_;
  gateway::BoundLink link_;
  std::array<gateway::LinePort, 2> ports_;
  exchange::Wakeup wakeup_;
  std::array<ThreadClock, 2> clocks_;
  std::vector<std::unique_ptr<gateway::Executor>> executors_;
  std::atomic<bool> stop_{false};
  std::thread taker_;
};

// --- figures
// --------------------------------------------------------------------------------------

struct Figures {
  std::vector<double> p99;
  std::vector<double> cpu;
};

double measure(Course& course, Figures& figures) {
  std::vector<std::int64_t> latencies;
  const std::int64_t before = course.cpu();
  timespec next{};
  clock_gettime(CLOCK_MONOTONIC, &next);
  for (std::size_t i = 0; i < kFrames; ++i) {
    next.tv_nsec += kPace.count();
    if (next.tv_nsec >= 1'000'000'000) {
      next.tv_nsec -= 1'000'000'000;
      ++next.tv_sec;
    }
    clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &next, nullptr);
    latencies.push_back(course.pass(static_cast<unsigned>(i)));
  }
  figures.cpu.push_back(static_cast<double>(course.cpu() - before) / double{kFrames});
  std::sort(latencies.begin(), latencies.end());
  figures.p99.push_back(static_cast<double>(latencies[kFrames * 99 / 100]));
  return static_cast<double>(latencies[kFrames / 2]);
}

// Of what is measured beside the first figure: the repetition that does not count is left out.
Contestant beside(const Contestant& one, std::vector<double> figures) {
  figures.erase(figures.begin());
  return {one.name, {}, std::move(figures)};
}

void compare(const std::string& where, const char* bare_name, Course& bare, Course& gateway) {
  std::array<Figures, 2> figures;
  std::vector<Contestant> contestants;
  contestants.push_back({bare_name, [&] { return measure(bare, figures[0]); }, {}});
  contestants.push_back({"forwarding", [&] { return measure(gateway, figures[1]); }, {}});
  bench::interleave(contestants);
  const auto print = [&](const char* what, const Contestant& loop, const Contestant& forwarding) {
    bench::print_heading("PDO forwarded line to line, " + where + ": " + what);
    bench::print_figure(loop, "ns");
    bench::print_figure(forwarding, "ns");
    bench::print_target(where + ", " + what + ": to the bare loop",
                        bench::median_ratio(forwarding, loop), 1.3, "x");
  };
  print("latency p50", contestants[0], contestants[1]);
  print("latency p99", beside(contestants[0], figures[0].p99),
        beside(contestants[1], figures[1].p99));
  print("CPU time a frame", beside(contestants[0], figures[0].cpu),
        beside(contestants[1], figures[1].cpu));
}

}  // namespace

int main() {
  {
    BareOneThread bare;
    Forwarding gateway(true);
    compare("within an executor", "one thread, two sockets", bare, gateway);
  }
  BareTwoThreads bare;
  Forwarding gateway(false);
  compare("across executors", "two threads", bare, gateway);
}

// SPDX-License-Identifier: Apache-2.0
// A value that is forwarded from a line of one gateway to a line of another, beside the same
// forwarding inside one gateway, and beside one hop of DDS: a sample of the same topic and size
// that a bare writer sends to a reader in another process.
//
// From before a frame is sent on one bus until the frame with its value is read on the other. The
// buses are `udp:`, so that whole gateways run, each a process, with the devices of each bus in
// another one. One value is in transit at a time, after a pause that is longer than the minimum
// separation of images: all threads sleep when it comes.
#include <array>
#include <chrono>
#include <cstdio>
#include <cstring>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include <fcntl.h>
#include <poll.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include "bridges/can/udp.h"
#include "gateway/process/gateway.h"
#include "gateway/publish/dds_edge.h"
#include "gateway/runtime/signals.h"
#include "gateway/tools/simulate.h"

#include "tests/bench/processes.h"
#include "tests/bench/sample_course.h"
#include "tests/paths.h"

namespace linegate::bench {
namespace {

using namespace std::chrono_literals;

constexpr int kValues = 10;  // of one repetition
constexpr auto kPause = 25ms;
constexpr int kToWait = 500;         // ms for a value
constexpr int kStartAttempts = 600;  // until values are forwarded
constexpr std::uint32_t kFromDevice = 0x185;
constexpr std::uint32_t kToDevice = 0x205;

struct BusAddress {
  std::string group;
  std::uint16_t port = 0;

  std::string uri() const { return "udp:" + group + ":" + std::to_string(port); }
};

BusAddress bus_address(int number) {
  return {"239.74.163." + std::to_string(40 + number),
          static_cast<std::uint16_t>(44'000 + getpid() % 1'000 + number)};
}

// --- the gateways -------------------------------------------------------------------------------

std::string plant_head(const std::string& name, std::uint32_t domain, const std::string& forward) {
  return "schema: 1\ngateway: {name: " + name + "}\ndds: {domain: " + std::to_string(domain) +
         ", profile: " + std::string(paths::kLoopbackProfiles) + "}\n" +
         (forward.empty() ? "" : "forward: [" + forward + "]\n") + "lines:\n";
}

std::string plant_line(const std::string& name, const BusAddress& bus) {
  return "  - {name: " + name + ", interface: \"" + bus.uri() +
         "\", nodes: [{id: 5, name: io, eds: bridges/sim/eds/digital-io.eds}], outputs: {defaults: "
         "{\"io.6200:2\": 0}}}\n";
}

void run_gateway(const std::string& text) {
  spdlog::set_level(spdlog::level::err);
  auto plant = config::read(text, paths::in_repository("plant.yaml"));
  require(plant.ok(), plant.diagnostics.empty() ? "" : to_string(plant.diagnostics.front()));
  auto made = gateway::Gateway::make(*std::move(plant.value), 1 + static_cast<unsigned>(getpid()));
  require(made.ok(), made.diagnostics.empty() ? "" : to_string(made.diagnostics.front()));
  (*made.value)->start();
  for (;;) {
    std::this_thread::sleep_for(100ms);
    (*made.value)->report_edge();
  }
}

void run_device(const BusAddress& bus) {
  spdlog::set_level(spdlog::level::err);
  gateway::block_stop_signals();
  (void)gateway::simulate({.uri = bus.uri(), .devices = {"digital-io:5"}});
}

// --- what is measured ---------------------------------------------------------------------------

class Bus {
 public:
  explicit Bus(const BusAddress& address)
      : channel_(can_bridge::open_udp({.group = address.group, .port = address.port})) {
    (void)read();
    require(channel_->descriptor() >= 0, "no multicast on the loopback interface");
  }

  // The device sends its inputs, of which the first is this one.
  void send(std::uint8_t value) {
    const std::array<std::byte, 4> inputs{std::byte{value}};
    const auto frame = can::make_frame(kFromDevice, inputs);
    require(channel_->write(std::span(&frame, 1), gateway::monotonic_now()) == 1,
            "a frame was not sent");
  }
  // Whether the device is sent that output.
  bool receives(std::uint8_t value) {
    const auto until = gateway::monotonic_now() + std::chrono::milliseconds(kToWait);
    while (gateway::monotonic_now() < until) {
      pollfd readable{channel_->descriptor(), POLLIN, 0};
      (void)poll(&readable, 1, kToWait);
      for (const can::Frame& frame : read()) {
        if (frame.id == kToDevice && frame.data[0] == std::byte{value}) {
          return true;
        }
      }
    }
    return false;
  }

 private:
  std::span<const can::Frame> read() {
    events_.clear();
    return std::span(frames_).first(channel_->read(frames_, events_, gateway::monotonic_now()));
  }

  std::unique_ptr<can_bridge::Channel> channel_;
  std::array<can::Frame, 64> frames_{};
  can_bridge::BusEvents events_;
};

// Times in us.
class Passages {
 public:
  virtual ~Passages() = default;

  double repetition() {
    std::vector<double> times;
    for (int i = 0; i < kValues; ++i) {
      std::this_thread::sleep_for(kPause);
      const auto time = pass();
      require(time.has_value(), "a value was not forwarded");
      times.push_back(*time);
      all_.push_back(*time);
    }
    return median(std::move(times));
  }
  void await_first() {
    for (int i = 0; i < kStartAttempts; ++i) {
      if (pass()) {
        return;
      }
    }
    require(false, "no value is forwarded");
  }
  double p99() const { return percentile(all_, 0.99); }
  // Those before are not counted.
  void forget() { all_.clear(); }

 private:
  virtual std::optional<double> pass() = 0;

  std::vector<double> all_;
};

class Forwarded final : public Passages {
 public:
  Forwarded(const BusAddress& from, const BusAddress& to) : from_(from), to_(to) {}

 private:
  std::optional<double> pass() override {
    value_ = static_cast<std::uint8_t>(value_ % 255 + 1);
    const std::int64_t begin = now_ns();
    from_.send(value_);
    if (!to_.receives(value_)) {
      return std::nullopt;
    }
    return static_cast<double>(now_ns() - begin) / 1000.0;
  }

  Bus from_;
  Bus to_;
  std::uint8_t value_ = 0;
};

class Hopped final : public Passages {
 public:
  // pipe: of the reader.
  Hopped(std::uint32_t domain, int pipe) : writer_("hop", domain), pipe_(pipe) {}

 private:
  std::optional<double> pass() override {
    can_frame frame{};
    const std::int64_t sent = now_ns();
    std::memcpy(frame.data, &sent, sizeof sent);
    writer_.write(frame);
    for (pollfd readable{pipe_, POLLIN, 0}; poll(&readable, 1, kToWait) == 1;) {
      Arrival arrival;
      require(read(pipe_, &arrival, sizeof arrival) == sizeof arrival, "no subscriber");
      if (arrival.sent == sent) {
        return static_cast<double>(arrival.received - sent) / 1000.0;
      }
    }
    return std::nullopt;
  }

  SampleWriter writer_;
  int pipe_;
};

// --- the measurement ----------------------------------------------------------------------------

void measure(std::array<Passages*, 3> all) {
  constexpr std::array kNames{"between two gateways", "inside one gateway", "one hop of DDS"};
  std::vector<Contestant> contestants;
  for (std::size_t i = 0; i < all.size(); ++i) {
    all[i]->await_first();
    all[i]->forget();
    contestants.push_back({kNames[i], [one = all[i]] { return one->repetition(); }, {}});
  }
  interleave(contestants);
  print_heading("A value forwarded from one line to another, p50 and p99");
  for (std::size_t i = 0; i < all.size(); ++i) {
    char note[48];
    std::snprintf(note, sizeof note, ", p99 %.0f us", all[i]->p99());
    print_figure(contestants[i], "us", note);
  }
  Contestant both{"inside one gateway, and one hop", {}, {}};
  for (std::size_t i = 0; i < contestants[1].figures.size(); ++i) {
    both.figures.push_back(contestants[1].figures[i] + contestants[2].figures[i]);
  }
  std::printf("  between two gateways: %.2f x the sum of the other two, p99 %.2f x\n",
              median_ratio(contestants[0], both), all[0]->p99() / (all[1]->p99() + all[2]->p99()));
}

int run(int argc, char** argv) {
  const std::vector<std::string> arguments(argv + 1, argv + argc);
  if (arguments.size() == 1 && arguments[0] == gateway::kDdsProcessArgument) {
    gateway::run_dds_process();
  }
  const std::uint32_t domain = 100 + static_cast<std::uint32_t>(getpid()) % 100;
  if (arguments.size() == 2 && arguments[0] == "--gateway") {
    run_gateway(arguments[1]);
  }
  if (arguments.size() == 3 && arguments[0] == "--subscribe") {
    return subscribe(static_cast<std::uint32_t>(std::stoul(arguments[1])), std::stoi(arguments[2]));
  }
  if (arguments.size() == 3 && arguments[0] == "--device") {
    run_device({arguments[1], static_cast<std::uint16_t>(std::stoul(arguments[2]))});
  }
  require(arguments.empty(), "it has no arguments");

  std::array<int, 2> ends{};
  require(pipe(ends.data()) == 0 && fcntl(ends[0], F_SETFD, FD_CLOEXEC) == 0, "no pipe");
  const std::array buses{bus_address(0), bus_address(1), bus_address(2), bus_address(3)};
  std::vector<pid_t> children;
  for (const BusAddress& bus : buses) {
    children.push_back(start_again({"--device", bus.group, std::to_string(bus.port)}));
  }
  const std::string far = plant_head("hall-b", domain, "") + plant_line("press", buses[0]);
  const std::string near =
      plant_head("hall-a", domain, "hall-b/press.io.6000:1 -> pack.io.6200:1") +
      plant_line("pack", buses[1]);
  const std::string one = plant_head("hall-c", domain, "press.io.6000:1 -> pack.io.6200:1") +
                          plant_line("press", buses[2]) + plant_line("pack", buses[3]);
  for (const std::string& plant : {far, near, one}) {
    children.push_back(start_again({"--gateway", plant}));
  }
  children.push_back(start_again({"--subscribe", std::to_string(domain), std::to_string(ends[1])}));
  close(ends[1]);
  {
    Forwarded between(buses[0], buses[1]);
    Forwarded inside(buses[2], buses[3]);
    Hopped hop(domain, ends[0]);
    measure({&between, &inside, &hop});
  }
  for (const pid_t child : children) {
    end_process(child);
  }
  return 0;
}

}  // namespace
}  // namespace linegate::bench

int main(int argc, char** argv) {
  return linegate::bench::run(argc, argv);
}

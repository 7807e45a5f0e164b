// SPDX-License-Identifier: Apache-2.0
// From a frame on the wire to the sample in another process: the gateway's threads (executor,
// publisher) and bridge, compared with a loop that receives a frame, hands it to a thread and
// writes it as a sample of the same topic, size and QoS; and the same loop without that thread.
//
// The value in the frame is the time at which it was sent (CLOCK_MONOTONIC, which both processes
// share), so the subscriber can compute the age of the sample. Only one frame is in transit at a
// time, after a pause: all threads sleep when it arrives.
#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <csignal>
#include <cstring>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include <linegatePubSubTypes.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include "bridges/can/socketcan.h"
#include "bridges/dds/client.h"
#include "bridges/dds/endpoints.h"
#include "gateway/publish/dds_edge.h"
#include "gateway/publish/publisher.h"
#include "gateway/runtime/clock.h"
#include "gateway/runtime/executor.h"
#include "gateway/runtime/line_host.h"
#include "gateway/runtime/line_runner.h"

#include "tests/bench/bare_loop.h"
#include "tests/bench/measure.h"
#include "tests/bench/pdo_line.h"
#include "tests/bench/wire.h"

namespace linegate::bench {
namespace {

using namespace std::chrono_literals;

constexpr int kExchanges = 15;  // in one repetition
constexpr int kMatchAttempts = 200;

// The subscriber's report on one sample.
struct Arrival {
  char path = 0;              // first letter of the gateway's name
  std::int64_t sent = 0;      // ns, CLOCK_MONOTONIC
  std::int64_t received = 0;  // ns, CLOCK_MONOTONIC
};

std::int64_t now_ns() {
  return gateway::monotonic_now().time_since_epoch().count();
}

// --- the other process --------------------------------------------------------------------------

class Reader final : public dds::ClientListener {
 public:
  explicit Reader(int pipe) : pipe_(pipe) {}

  void on_image(const dds::Source& source, const image::Snapshot& snapshot) override {
    Arrival arrival{source.gateway.at(0), 0, now_ns()};
    if (snapshot.direction != image::Direction::inputs ||
        snapshot.bytes.size() < sizeof arrival.sent) {
      return;
    }
    std::memcpy(&arrival.sent, snapshot.bytes.data(), sizeof arrival.sent);
    require(write(pipe_, &arrival, sizeof arrival) == sizeof arrival, "the pipe is closed");
  }

 private:
  int pipe_;
};

int subscribe(std::uint32_t domain, int pipe) {
  prctl(PR_SET_PDEATHSIG, SIGTERM);
  dds::ClientOptions options;
  options.domain = domain;
  options.profile_file = LOOPBACK_PROFILES;
  options.lines = options.nodes = options.layouts = options.pdos = false;
  options.events = options.commands = false;
  auto client = dds::Client::make(options);
  require(client.ok(), "no DDS client");
  Reader reader(pipe);
  for (;;) {
    (*client.value)->poll(1s, reader);
  }
}

// --- three ways ---------------------------------------------------------------------------------

// One PDO of 8 bytes. The line publishes every change at once.
config::LinePlan line_plan() {
  config::LinePlan plan;
  plan.config = pdo_line(Mapping::event_driven, pdo_identifiers(1));
  plan.publish = {config::Publish::Rule::on_change, Duration::zero()};
  return plan;
}

class Gateway {
 public:
  Gateway(std::uint32_t domain, Wire& wire) {
    config::LinePlan plan = line_plan();
    auto made = line::Line::make(plan.config);
    config::Plant plant;
    plant.gateway = "gateway";
    plant.dds_domain = domain;
    plant.dds_profile = LOOPBACK_PROFILES;
    plant.lines = {plan};
    auto edge = gateway::make_dds_edge(plant, 1);
    require(made.ok() && edge.ok(), "no line, or no DDS");
    edge_ = *std::move(edge.value);
    std::unique_ptr<line::Line> line = *std::move(made.value);
    hosts_.push_back(std::make_unique<gateway::LineHost>(
        plan, line->layout(image::Direction::inputs), line->layout(image::Direction::outputs)));
    publisher_ = std::make_unique<gateway::Publisher>(*edge_, hosts_);
    executor_ = std::make_unique<gateway::Executor>(config::ExecutorPlan{});
    executor_->add(std::make_unique<gateway::LineRunner>(
        std::move(line), can_bridge::open_on_descriptor(wire.far()), plan, hosts_[0]->port,
        publisher_->wakeup()));
    publisher_->start();
    executor_->start();
    wire.play_devices(1, 500);
  }
  ~Gateway() {
    executor_->request_stop();
    executor_->join();
    publisher_->stop();
  }

 private:
  std::unique_ptr<gateway::DataEdge> edge_;
  std::vector<std::unique_ptr<gateway::LineHost>> hosts_;
  std::unique_ptr<gateway::Publisher> publisher_;
  std::unique_ptr<gateway::Executor> executor_;
};

// Writes samples of the same size and QoS as the gateway.
class Writer {
 public:
  Writer(const std::string& name, std::uint32_t domain)
      : endpoints_(name, domain, LOOPBACK_PROFILES, diagnostics_),
        writer_(endpoints_.writer<v1::ProcessImagePubSubType>(v1::TOPIC_PROCESS_IMAGE)) {
    require(endpoints_.ok(), "no DDS writer");
    sample_.gateway(name);
    sample_.line("bench");
    sample_.direction(v1::DIRECTION_INPUTS);
    sample_.incarnation(1);
    sample_.layout_id(1);
    sample_.bytes().resize(8);
    sample_.changed().resize(8);
    sample_.valid().resize(8);
    sample_.pdos().resize(1);
  }

  void write(const can_frame& frame) {
    sample_.sequence_number(sample_.sequence_number() + 1);
    std::memcpy(sample_.bytes().data(), frame.data, 8);
    require(writer_->write(&sample_), "DDS does not accept a sample");
  }

 private:
  std::vector<Diagnostic> diagnostics_;
  dds::Endpoints endpoints_;
  eprosima::fastdds::dds::DataWriter* writer_;
  v1::ProcessImage sample_;
};

class Direct {
 public:
  Direct(std::uint32_t domain, Wire& wire)
      : writer_("direct", domain), wire_(wire), thread_([this] { run(); }) {}
  ~Direct() {
    stop_ = true;
    thread_.join();
    close(wire_.far());
  }

 private:
  void run() {
    BareLoop loop(wire_.far());
    while (!stop_) {
      loop.wait();
      loop.drain([this](const can_frame& frame, std::int64_t) { writer_.write(frame); });
    }
  }

  Writer writer_;
  Wire& wire_;
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

class Hop {
 public:
  Hop(std::uint32_t domain, Wire& wire)
      : writer_("hop", domain),
        wire_(wire),
        receiver_([this] { receive(); }),
        publisher_([this] { publish(); }) {}
  ~Hop() {
    stop_ = true;
    wakeup_.signal();
    receiver_.join();
    publisher_.join();
    close(wire_.far());
  }

 private:
  void receive() {
    BareLoop loop(wire_.far());
    while (!stop_) {
      loop.wait();
      loop.drain([this](const can_frame& frame, std::int64_t) {
        newest_.draft().value = frame;
        newest_.publish();
      });
      wakeup_.signal();
    }
  }
  void publish() {
    while (!stop_) {
      wakeup_.clear();
      if (const can_frame* frame = newest_.fetch()) {
        writer_.write(*frame);
      }
      pollfd readable{wakeup_.descriptor(), POLLIN, 0};
      poll(&readable, 1, -1);
    }
  }

  Writer writer_;
  Wire& wire_;
  exchange::Handover<can_frame> newest_;
  exchange::Wakeup wakeup_;
  std::atomic<bool> stop_{false};
  std::thread receiver_;
  std::thread publisher_;
};

// --- measuring ----------------------------------------------------------------------------------

class Course {
 public:
  Course(char path, Wire& wire, int pipe) : path_(path), wire_(wire), pipe_(pipe) {}

  // Returns the time in us from sending one frame until the subscriber has its sample; nothing if
  // the sample does not arrive within 100 ms.
  std::optional<double> exchange() {
    std::this_thread::sleep_for(1ms);
    can_frame frame{};
    frame.can_id = pdo_identifiers(1)[0];
    frame.len = 8;
    const std::int64_t sent = now_ns();
    std::memcpy(frame.data, &sent, sizeof sent);
    wire_.send(std::span(&frame, 1));
    for (pollfd readable{pipe_, POLLIN, 0}; poll(&readable, 1, 100) == 1;) {
      Arrival arrival;
      require(read(pipe_, &arrival, sizeof arrival) == sizeof arrival, "no subscriber");
      if (arrival.path == path_ && arrival.sent == sent) {
        return static_cast<double>(arrival.received - sent) / 1000.0;
      }
    }
    return std::nullopt;
  }

  void match() {
    for (int i = 0; i < kMatchAttempts; ++i) {
      if (exchange()) {
        return;
      }
    }
    require(false, "the subscriber receives nothing");
  }

  double repetition() {
    std::vector<double> times;
    for (int i = 0; i < kExchanges; ++i) {
      const auto time = exchange();
      lost_ += time ? 0U : 1U;
      if (time) {
        times.push_back(*time);
      }
    }
    require(!times.empty(), "all samples were lost");
    return median(std::move(times));
  }

  unsigned lost() const { return lost_; }

 private:
  char path_;
  Wire& wire_;
  int pipe_;
  unsigned lost_ = 0;
};

pid_t start_subscriber(const char* program, std::uint32_t domain, int& pipe_end) {
  int ends[2] = {-1, -1};
  require(pipe(ends) == 0, "no pipe");
  const pid_t child = fork();
  require(child >= 0, "no process");
  if (child == 0) {
    close(ends[0]);
    execl(program, program, "--subscribe", std::to_string(domain).c_str(),
          std::to_string(ends[1]).c_str(), static_cast<char*>(nullptr));
    _exit(1);
  }
  close(ends[1]);
  pipe_end = ends[0];
  return child;
}

void measure(std::uint32_t domain, int pipe) {
  std::array<Wire, 3> wires;
  Gateway gateway(domain, wires[0]);
  Hop hop(domain, wires[1]);
  Direct direct(domain, wires[2]);
  std::array<Course, 3> courses{Course('g', wires[0], pipe), Course('h', wires[1], pipe),
                                Course('d', wires[2], pipe)};
  constexpr std::array kNames{"gateway", "bare loop with the thread hop", "bare loop without it"};
  std::vector<Contestant> contestants;
  for (std::size_t i = 0; i < courses.size(); ++i) {
    courses[i].match();
    contestants.push_back({kNames[i], [&course = courses[i]] { return course.repetition(); }, {}});
  }
  interleave(contestants);
  print_heading("Frame -> sample in another process, publish: on_change");
  for (std::size_t i = 0; i < courses.size(); ++i) {
    print_figure(contestants[i], "us",
                 ", " + std::to_string(courses[i].lost()) + " not seen within 100 ms");
  }
  print_target("gateway: to the loop with the hop", median_ratio(contestants[0], contestants[1]),
               1.25, "x");
}

int run(int argc, char** argv) {
  if (argc == 4 && std::string_view(argv[1]) == "--subscribe") {
    return subscribe(static_cast<std::uint32_t>(std::stoul(argv[2])), std::stoi(argv[3]));
  }
  const std::uint32_t domain = 100 + static_cast<std::uint32_t>(getpid()) % 100;
  int pipe = -1;
  const pid_t child = start_subscriber("/proc/self/exe", domain, pipe);
  measure(domain, pipe);
  kill(child, SIGTERM);
  waitpid(child, nullptr, 0);
  return 0;
}

}  // namespace
}  // namespace linegate::bench

int main(int argc, char** argv) {
  return linegate::bench::run(argc, argv);
}

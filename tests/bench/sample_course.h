// SPDX-License-Identifier: Apache-2.0
// What the measurements from a frame to its sample share: a gateway of one line, bare loops that
// write samples of the same topic, and a subscriber in another process.
#pragma once

#include <algorithm>
#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdint>
#include <cstring>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include <linegatePubSubTypes.h>
#include <poll.h>
#include <sys/prctl.h>
#include <unistd.h>

#include "bridges/can/socketcan.h"
#include "bridges/dds/client.h"
#include "bridges/dds/endpoints.h"
#include "gateway/exchange/handover.h"
#include "gateway/exchange/wakeup.h"
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
#include "tests/paths.h"

namespace linegate::bench {

inline constexpr int kMatchAttempts = 200;

// The subscriber's report on one sample.
struct Arrival {
  char path = 0;              // first letter of the gateway's name
  std::int64_t sent = 0;      // ns, CLOCK_MONOTONIC
  std::int64_t received = 0;  // ns, CLOCK_MONOTONIC
};

inline std::int64_t now_ns() {
  return gateway::monotonic_now().time_since_epoch().count();
}

// --- the other process --------------------------------------------------------------------------

class ArrivalReporter final : public dds::ClientListener {
 public:
  explicit ArrivalReporter(int pipe) : pipe_(pipe) {}

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

// Reports each arrival on the pipe until its parent ends.
inline int subscribe(std::uint32_t domain, int pipe, const dds::Security& security = {}) {
  prctl(PR_SET_PDEATHSIG, SIGTERM);
  dds::ClientOptions options;
  options.domain = domain;
  options.profile_file = paths::kLoopbackProfiles;
  options.lines = options.nodes = options.layouts = options.pdos = false;
  options.events = options.commands = false;
  options.security = security;
  auto client = dds::Client::make(options);
  require(client.ok(), "no DDS client");
  ArrivalReporter reader(pipe);
  for (;;) {
    (*client.value)->poll(std::chrono::seconds(1), reader);
  }
}

// --- what is measured ---------------------------------------------------------------------------

// One PDO of 8 bytes. The line publishes every change at once.
inline config::LinePlan line_plan() {
  config::LinePlan plan;
  plan.config = pdo_line(Mapping::event_driven, pdo_identifiers(1));
  plan.publish = {config::Publish::Rule::on_change, Duration::zero()};
  return plan;
}

// Lines, each with an executor of its own.
class LineGateway {
 public:
  // plant: with the lines. far: the end of a Wire for each line, which it closes.
  LineGateway(config::Plant plant, const std::vector<int>& far) {
    plant.dds_profile = paths::kLoopbackProfiles;
    auto edge = gateway::make_dds_edge(plant, 1);
    require(edge.ok(), "no DDS");
    edge_ = *std::move(edge.value);
    std::vector<std::unique_ptr<line::Line>> lines;
    for (const config::LinePlan& plan : plant.lines) {
      auto made = line::Line::make(plan.config);
      require(made.ok(), "no line");
      lines.push_back(*std::move(made.value));
      hosts_.push_back(
          std::make_unique<gateway::LineHost>(plan, lines.back()->layout(image::Direction::inputs),
                                              lines.back()->layout(image::Direction::outputs)));
      hosts_.back()->port.direct = edge_->make_direct_images(plan, hosts_.back()->layouts);
    }
    publisher_ = std::make_unique<gateway::Publisher>(*edge_, hosts_);
    for (std::size_t i = 0; i < lines.size(); ++i) {
      executors_.push_back(std::make_unique<gateway::Executor>(config::ExecutorPlan{}));
      executors_[i]->add(std::make_unique<gateway::LineRunner>(
          std::move(lines[i]), can_bridge::open_on_descriptor(far[i]), plant.lines[i],
          hosts_[i]->port, publisher_->wakeup()));
    }
    publisher_->start();
    for (const auto& executor : executors_) {
      executor->start();
    }
  }
  // With the line of line_plan().
  LineGateway(config::Plant plant, int far)
      : LineGateway(with_line(std::move(plant)), std::vector{far}) {}
  ~LineGateway() {
    for (const auto& executor : executors_) {
      executor->request_stop();
    }
    for (const auto& executor : executors_) {
      executor->join();
    }
    publisher_->stop();
  }

  // Whether the manager of each line has booted its nodes, as it was published.
  bool run() {
    return std::ranges::all_of(hosts_, [](const auto& host) {
      if (const line::LineState* state = host->shown.fetch()) {
        host->last_shown = *state;
      }
      return host->last_shown && host->last_shown->manager == line::ManagerState::running;
    });
  }

 private:
  static config::Plant with_line(config::Plant plant) {
    plant.lines = {line_plan()};
    return plant;
  }

  std::unique_ptr<gateway::DataEdge> edge_;
  std::vector<std::unique_ptr<gateway::LineHost>> hosts_;
  std::unique_ptr<gateway::Publisher> publisher_;
  std::vector<std::unique_ptr<gateway::Executor>> executors_;
};

// A participant of a bare loop.
class SampleEndpoints {
 public:
  SampleEndpoints(const std::string& name, std::uint32_t domain, const dds::Security& security = {})
      : name_(name),
        endpoints_(name, domain, paths::kLoopbackProfiles, diagnostics_, true, 0, security),
        writer_(endpoints_.writer<v1::ProcessImagePubSubType>(v1::TOPIC_PROCESS_IMAGE)) {
    require(endpoints_.ok(), "no DDS writer");
  }

  const std::string& name() const { return name_; }
  void write(v1::ProcessImage& sample) {
    require(writer_->write(&sample), "DDS does not accept a sample");
  }

 private:
  const std::string name_;
  std::vector<Diagnostic> diagnostics_;
  dds::Endpoints endpoints_;
  eprosima::fastdds::dds::DataWriter* writer_;
};

// Samples of the same size and QoS as those of a gateway's line whose PDOs have 4 values of 2
// octets each.
class LineSamples {
 public:
  // endpoints must outlive it.
  LineSamples(SampleEndpoints& endpoints, const std::string& line, std::size_t pdos)
      : endpoints_(endpoints) {
    const std::size_t bits = (4 * pdos + 63) / 64 * 8;
    sample_.gateway(endpoints.name());
    sample_.line(line);
    sample_.direction(v1::DIRECTION_INPUTS);
    sample_.incarnation(1);
    sample_.layout_id(1);
    sample_.bytes().resize(8 * pdos);
    sample_.changed().resize(bits);
    sample_.valid().resize(bits);
    sample_.pdos().reserve(pdos);
  }

  void take(std::size_t pdo, const can_frame& frame) {
    std::memcpy(sample_.bytes().data() + 8 * pdo, frame.data, 8);
    if (sample_.pdos().size() < sample_.pdos().capacity()) {
      sample_.pdos().emplace_back();
    }
  }
  void write() {
    sample_.sequence_number(sample_.sequence_number() + 1);
    endpoints_.write(sample_);
    sample_.pdos().clear();
  }

 private:
  SampleEndpoints& endpoints_;
  v1::ProcessImage sample_;
};

// A line of one PDO, with a participant of its own.
class SampleWriter {
 public:
  SampleWriter(const std::string& name, std::uint32_t domain, const dds::Security& security = {})
      : endpoints_(name, domain, security), samples_(endpoints_, "bench", 1) {}

  void write(const can_frame& frame) {
    samples_.take(0, frame);
    samples_.write();
  }

 private:
  SampleEndpoints endpoints_;
  LineSamples samples_;
};

// A loop that receives a frame, hands it to a thread and writes it as a sample.
class Hop {
 public:
  // far: the end of a Wire, which it closes.
  Hop(std::uint32_t domain, int far, const dds::Security& security = {})
      : writer_("hop", domain, security),
        far_(far),
        receiver_([this] { receive(); }),
        publisher_([this] { publish(); }) {}
  ~Hop() {
    stop_ = true;
    wakeup_.signal();
    receiver_.join();
    publisher_.join();
    close(far_);
  }

 private:
  void receive() {
    BareLoop loop(far_);
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

  SampleWriter writer_;
  int far_;
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

  // Sends one frame. Returns the value in it.
  std::int64_t send() {
    can_frame frame{};
    frame.can_id = pdo_identifiers(1)[0];
    frame.len = 8;
    const std::int64_t sent = now_ns();
    std::memcpy(frame.data, &sent, sizeof sent);
    wire_.send(std::span(&frame, 1));
    return sent;
  }
  // Discards the reports of samples until none follows for 20 ms.
  void drain() {
    for (pollfd readable{pipe_, POLLIN, 0}; poll(&readable, 1, 20) == 1;) {
      Arrival arrival;
      require(read(pipe_, &arrival, sizeof arrival) == sizeof arrival, "no subscriber");
    }
  }
  // Returns the time in us from sending one frame until the subscriber has its sample; nothing if
  // the sample does not arrive within 100 ms.
  std::optional<double> exchange() {
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
    const std::int64_t sent = send();
    for (pollfd readable{pipe_, POLLIN, 0}; poll(&readable, 1, 100) == 1;) {
      Arrival arrival;
      require(read(pipe_, &arrival, sizeof arrival) == sizeof arrival, "no subscriber");
      if (arrival.path == path_ && arrival.sent == sent) {
        return static_cast<double>(arrival.received - sent) / 1000.0;
      }
    }
    return std::nullopt;
  }

  // Returns false if the subscriber receives nothing.
  bool match() {
    for (int i = 0; i < kMatchAttempts; ++i) {
      if (exchange()) {
        return true;
      }
    }
    return false;
  }

  // The median of that number of exchanges.
  double repetition(int exchanges) {
    std::vector<double> times;
    for (int i = 0; i < exchanges; ++i) {
      const auto time = exchange();
      lost_ += time ? 0U : 1U;
      if (time) {
        times.push_back(*time);
        all_.push_back(*time);
      }
    }
    require(!times.empty(), "all samples were lost");
    return median(std::move(times));
  }

  unsigned lost() const { return lost_; }
  // All times of repetition().
  const std::vector<double>& all() const { return all_; }

 private:
  char path_;
  Wire& wire_;
  int pipe_;
  unsigned lost_ = 0;
  std::vector<double> all_;
};

}  // namespace linegate::bench

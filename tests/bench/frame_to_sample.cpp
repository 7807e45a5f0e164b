// SPDX-License-Identifier: Apache-2.0
// From a frame on the wire to the sample in another process: the gateway's threads (executor,
// publisher) and bridge, compared with a loop that receives a frame, hands it to a thread and
// writes it as a sample of the same topic, size and QoS; and the same loop without that thread.
//
// The value in the frame is the time at which it was sent (CLOCK_MONOTONIC, which both processes
// share), so the subscriber can compute the age of the sample. Only one frame is in transit at a
// time, after a pause: all threads sleep when it arrives.
#include <array>
#include <atomic>
#include <csignal>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include <sys/wait.h>
#include <unistd.h>

#include "tests/bench/sample_course.h"

namespace linegate::bench {
namespace {

constexpr int kExchanges = 15;  // in one repetition

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

  SampleWriter writer_;
  Wire& wire_;
  std::atomic<bool> stop_{false};
  std::thread thread_;
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
  config::Plant plant;
  plant.gateway = "gateway";
  plant.dds_domain = domain;
  const LineGateway gateway(plant, wires[0].far());
  wires[0].play_devices(1, 500);
  const Hop hop(domain, wires[1].far());
  const Direct direct(domain, wires[2]);
  std::array<Course, 3> courses{Course('g', wires[0], pipe), Course('h', wires[1], pipe),
                                Course('d', wires[2], pipe)};
  constexpr std::array kNames{"gateway", "bare loop with the thread hop", "bare loop without it"};
  std::vector<Contestant> contestants;
  for (std::size_t i = 0; i < courses.size(); ++i) {
    require(courses[i].match(), "the subscriber receives nothing");
    contestants.push_back(
        {kNames[i], [&course = courses[i]] { return course.repetition(kExchanges); }, {}});
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

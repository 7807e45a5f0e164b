// SPDX-License-Identifier: Apache-2.0
// The cost of DDS in a process of its own: a gateway with `dds: {process: same}`, one with `own`,
// and a bare loop that writes samples of the same topic, each a process of its own; without and
// with DDS-Security. From a frame to its sample in another process, processor time of all processes
// of a gateway for a sample, and their memory.
#include <algorithm>
#include <array>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include <fcntl.h>
#include <unistd.h>

#include "gateway/security/authority.h"
#include "gateway/security/files.h"

#include "tests/bench/processes.h"
#include "tests/bench/sample_course.h"

namespace linegate::bench {
namespace {

using namespace std::chrono_literals;
namespace folders = std::filesystem;

constexpr int kExchanges = 40;  // in one repetition
constexpr int kFrames = 300;    // whose processor time is one figure
constexpr auto kPace = std::chrono::milliseconds(1);
constexpr int kSubscribers = 8;  // see Course::match
constexpr std::array<const char*, 3> kWays{"same", "own", "hop"};
constexpr std::array<const char*, 3> kNames{"process: same", "process: own",
                                            "bare loop with the thread hop"};

dds::Security security_of(const std::string& folder) {
  if (folder.empty()) {
    return {};
  }
  return dds::security_with(security::files_in(folder));
}

// --- the other processes ------------------------------------------------------------------------

// way: one of kWays, which is the name of the gateway. far: see Wire. Until its parent ends it.
int run_way(const std::string& way, std::uint32_t domain, int far, const std::string& identity) {
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  require(std::freopen("/dev/null", "w", stdout) != nullptr, "no /dev/null");  // its log
  if (way == "hop") {
    const Hop hop(domain, far, security_of(identity));
    pause();
    return 0;
  }
  config::Plant plant;
  plant.gateway = way;
  plant.dds_domain = domain;
  plant.dds_own_process = way == "own";
  plant.dds_security = identity;
  const LineGateway gateway(plant, far);
  pause();
  return 0;
}

std::string memory(pid_t process) {
  std::string out;
  for (const pid_t one : processes_of(process)) {
    std::ifstream status("/proc/" + std::to_string(one) + "/status");
    for (std::string line; std::getline(status, line);) {
      if (line.starts_with("VmRSS:") || line.starts_with("RssAnon:")) {
        const long kib = std::stol(line.substr(line.find(':') + 1));
        out += (line[0] == 'V' ? ", " : " (private ") + std::to_string(kib / 1024) + " MiB" +
               (line[0] == 'V' ? "" : ")");
      }
    }
  }
  return out.substr(std::min<std::size_t>(2, out.size()));
}

// --- measuring ----------------------------------------------------------------------------------

class Comparison {
 public:
  // folder: of an authority; empty: without DDS-Security.
  Comparison(std::uint32_t domain, std::string folder)
      : domain_(std::to_string(domain)), folder_(std::move(folder)) {
    for (std::size_t i = 0; i < kWays.size(); ++i) {
      fcntl(wires_[i].far(), F_SETFD, 0);  // of this process alone
      ways_.push_back(start_again(
          {"--way", kWays[i], domain_, std::to_string(wires_[i].far()), identity(kWays[i])}));
      close(wires_[i].far());
    }
    for (std::size_t i = 0; i < 2; ++i) {
      wires_[i].play_devices(1, 2'000);
    }
    for (int i = 0; i < kSubscribers && !matched_; ++i) {
      subscribe_again();
    }
    require(matched_, "the subscriber receives nothing");
  }
  ~Comparison() {
    end_process(subscriber_);
    for (const pid_t way : ways_) {
      end_process(way);
    }
    close(pipe_);
  }
  Comparison(const Comparison&) = delete;
  Comparison& operator=(const Comparison&) = delete;

  void measure() {
    std::vector<Contestant> times;
    std::vector<Contestant> costs;
    for (std::size_t i = 0; i < kWays.size(); ++i) {
      times.push_back({kNames[i], [this, i] { return courses_[i].repetition(kExchanges); }, {}});
      costs.push_back({kNames[i], [this, i] { return cost(i); }, {}});
    }
    interleave(times);
    interleave(costs);
    print_heading(folder_.empty() ? "Without DDS-Security" : "With DDS-Security");
    std::printf("frame -> sample in another process:\n");
    for (std::size_t i = 0; i < times.size(); ++i) {
      char note[96];
      std::snprintf(note, sizeof note, ", p99 %.0f us, %u not seen within 100 ms",
                    percentile(courses_[i].all(), 0.99), courses_[i].lost());
      print_figure(times[i], "us", note);
    }
    std::printf("processor time for a sample, at %d samples/s:\n", static_cast<int>(1s / kPace));
    for (const Contestant& one : costs) {
      print_figure(one, "us");
    }
    for (std::size_t i = 0; i < 2; ++i) {
      std::printf("memory, %s: %s\n", kNames[i], memory(ways_[i]).c_str());
    }
    print_target("frame to sample, own: to the bare loop", median_ratio(times[1], times[2]), 1.25,
                 "x");
    print_target("processor time, own: to same", median_ratio(costs[1], costs[0]), 1.1, "x");
  }

 private:
  std::string identity(const std::string& name) const {
    return folder_.empty() ? std::string() : folder_ + "/" + name;
  }
  void subscribe_again() {
    if (subscriber_ > 0) {
      end_process(subscriber_);
      close(pipe_);
    }
    std::array<int, 2> ends{};
    require(pipe(ends.data()) == 0 && fcntl(ends[0], F_SETFD, FD_CLOEXEC) == 0, "no pipe");
    subscriber_ =
        start_again({"--subscribe", domain_, std::to_string(ends[1]), identity("reader")});
    close(ends[1]);
    pipe_ = ends[0];
    courses_.clear();
    matched_ = true;
    for (std::size_t i = 0; i < kWays.size() && matched_; ++i) {
      courses_.emplace_back(kWays[i][0], wires_[i], pipe_);
      matched_ = courses_[i].match();
    }
  }
  // us of processor time for one of kFrames samples.
  double cost(std::size_t i) {
    const double before = processor_time_of_all(ways_[i]);
    for (int n = 0; n < kFrames; ++n) {
      std::this_thread::sleep_for(kPace);
      courses_[i].send();
    }
    const double out = (processor_time_of_all(ways_[i]) - before) / kFrames;
    courses_[i].drain();
    return out;
  }

  const std::string domain_;
  const std::string folder_;
  std::array<Wire, 3> wires_;
  std::vector<pid_t> ways_;
  pid_t subscriber_ = -1;
  int pipe_ = -1;
  bool matched_ = false;
  std::vector<Course> courses_;
};

std::string make_identities() {
  std::string folder = "/tmp/linegate-bench-XXXXXX";
  require(mkdtemp(folder.data()) != nullptr, "no folder for identities");
  const std::string plant = folder + "/plant";
  std::string problem = security::init(plant);
  for (const char* way : kWays) {
    problem += security::issue(plant, {{way, security::Role::gateway, {"*/*"}}, 1});
  }
  problem += security::issue(plant, {{"reader", security::Role::viewer, {"*/*"}}, 1});
  require(problem.empty(), problem);
  return folder;
}

int run(int argc, char** argv) {
  const std::vector<std::string> arguments(argv + 1, argv + argc);
  const auto number = [&](std::size_t i) {
    return static_cast<std::uint32_t>(std::stoul(arguments[i]));
  };
  if (arguments.size() == 1 && arguments[0] == gateway::kDdsProcessArgument) {
    gateway::run_dds_process();
  }
  if (arguments.size() == 5 && arguments[0] == "--way") {
    return run_way(arguments[1], number(2), static_cast<int>(number(3)), arguments[4]);
  }
  if (arguments.size() == 4 && arguments[0] == "--subscribe") {
    return subscribe(number(1), static_cast<int>(number(2)), security_of(arguments[3]));
  }
  const std::uint32_t domain = 100 + static_cast<std::uint32_t>(getpid()) % 60;
  Comparison(domain, "").measure();
  const std::string folder = make_identities();
  Comparison(domain + 1, folder + "/plant").measure();
  folders::remove_all(folder);
  return 0;
}

}  // namespace
}  // namespace linegate::bench

int main(int argc, char** argv) {
  return linegate::bench::run(argc, argv);
}

// SPDX-License-Identifier: Apache-2.0
// The memory of the DDS process of a gateway with many lines and clients, which `dds: {memory:
// ...}` must permit: lines with 4 nodes each, and clients that subscribe to all topics and send
// commands. They start at the same time, which loads the process most, and end at the same time.
//
//   measure_dds_memory [LINES [CLIENTS [secured]]]
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include <spdlog/spdlog.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include "bridges/dds/client.h"
#include "gateway/config/plant.h"
#include "gateway/edge/memory_size.h"
#include "gateway/process/gateway.h"
#include "gateway/publish/dds_edge.h"
#include "gateway/runtime/clock.h"
#include "gateway/security/authority.h"
#include "gateway/security/files.h"
#include "gateway/security/fingerprint.h"

#include "tests/bench/measure.h"
#include "tests/paths.h"

namespace linegate::bench {
namespace {

using namespace std::chrono_literals;
namespace folders = std::filesystem;

constexpr int kClientsOfProcess = 10;

std::string plant_of(int lines, std::uint32_t domain, const std::string& identity) {
  std::string out = "schema: 1\ngateway: {name: bench}\ndds: {process: own, memory: 2GB, domain: " +
                    std::to_string(domain) + ", profile: " + std::string(paths::kLoopbackProfiles) +
                    (identity.empty() ? "" : ", security: " + identity) + "}\nlines:\n";
  for (int i = 0; i < lines; ++i) {
    out += "  - {name: line" + std::to_string(i) +
           ", interface: \"simulated:\", access: all, nodes: [";
    std::string simulated;
    for (int node = 1; node <= 4; ++node) {
      const std::string number = std::to_string(node);
      out += "{id: " + number + ", eds: bridges/sim/eds/digital-io.eds, heartbeat: 5s}, ";
      simulated += "{node: " + number + ", profile: digital-io}, ";
    }
    out += "], simulate: [" + simulated + "]}\n";
  }
  return out;
}

class Counter final : public dds::ClientListener {};

// Clients until the parent ends this process.
[[noreturn]] void run_clients(int count, std::uint32_t domain, const std::string& identity) {
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  require(nice(10) != -1, "no priority");  // in a plant most clients are on other hosts
  dds::ClientOptions options;
  options.domain = domain;
  options.profile_file = paths::kLoopbackProfiles;
  options.outputs = true;
  if (!identity.empty()) {
    options.security = dds::security_with(security::files_in(identity));
    options.security.is_holder = security::is_holder;
    options.security.right = "engineer/client";
  }
  std::vector<std::unique_ptr<dds::Client>> clients;
  for (int i = 0; i < count; ++i) {
    auto made = dds::Client::make(options);
    require(made.ok(), "no DDS client");
    clients.push_back(*std::move(made.value));
  }
  Counter ignored;
  for (;;) {
    for (const auto& client : clients) {
      client->poll(10ms, ignored);
    }
  }
}

std::vector<pid_t> start_clients(int count, std::uint32_t domain, const std::string& identity) {
  std::vector<pid_t> out;
  for (; count > 0; count -= kClientsOfProcess) {
    const pid_t child = fork();
    require(child >= 0, "no process");
    if (child == 0) {
      run_clients(std::min(count, kClientsOfProcess), domain, identity);
    }
    out.push_back(child);
  }
  return out;
}

pid_t dds_process() {
  for (const auto& task : folders::directory_iterator("/proc/self/task")) {
    std::ifstream children(task.path() / "children");
    for (pid_t child = 0; children >> child;) {
      std::ifstream name("/proc/" + std::to_string(child) + "/comm");
      std::string text;
      if (std::getline(name, text) && text == "linegated-dds") {
        return child;
      }
    }
  }
  return 0;
}

class Watch {
 public:
  explicit Watch(gateway::Gateway& gateway) : gateway_(gateway), process_(dds_process()) {}

  // For `time`; prints the memory then, and the most so far.
  void pass(const char* what, Duration time) {
    const auto end = gateway::monotonic_now() + time;
    while (gateway::monotonic_now() < end) {
      std::this_thread::sleep_for(20ms);
      gateway_.report_edge();
      note();
    }
    std::printf("%s: %.1f MB, most %.1f MB; data with the stacks of threads: %.1f MB\n", what,
                mega(present_.resident), mega(most_), mega(present_.data));
    std::fflush(stdout);
    require(dds_process() == process_, "the DDS process was replaced");
  }

 private:
  static double mega(std::size_t octets) { return static_cast<double>(octets) / 1e6; }
  void note() {
    const std::string statm = "/proc/" + std::to_string(process_) + "/statm";
    present_ = gateway::memory_size(statm.c_str());
    most_ = std::max(most_, present_.resident);
  }

  gateway::Gateway& gateway_;
  const pid_t process_;
  gateway::MemorySize present_;
  std::size_t most_ = 0;
};

std::string make_identities(const std::string& folder) {
  std::string problem = security::init(folder);
  problem += security::issue(folder, {{"bench", security::Role::gateway, {"*/*"}}, 1});
  problem += security::issue(folder, {{"client", security::Role::engineer, {"*/*"}}, 1});
  return problem;
}

int run(int argc, char** argv) {
  const std::vector<std::string> arguments(argv + 1, argv + argc);
  if (arguments.size() == 1 && arguments[0] == gateway::kDdsProcessArgument) {
    gateway::run_dds_process();
  }
  spdlog::set_level(spdlog::level::err);
  const int lines = arguments.empty() ? 64 : std::stoi(arguments[0]);
  const int clients = arguments.size() < 2 ? 100 : std::stoi(arguments[1]);
  std::string folder;
  if (arguments.size() > 2) {
    folder = "/tmp/linegate-bench-XXXXXX";
    require(mkdtemp(folder.data()) != nullptr, "no folder for identities");
    const std::string problem = make_identities(folder + "/plant");
    require(problem.empty(), problem);
  }
  const auto identity = [&](const char* name) {
    return folder.empty() ? std::string() : folder + "/plant/" + name;
  };
  const std::uint32_t domain = 100 + static_cast<std::uint32_t>(getpid()) % 60;
  auto plant =
      config::read(plant_of(lines, domain, identity("bench")), paths::in_repository("plant.yaml"));
  require(plant.ok(), plant.diagnostics.empty() ? "" : to_string(plant.diagnostics.front()));
  auto made = gateway::Gateway::make(*std::move(plant.value), 1);
  require(made.ok(), made.diagnostics.empty() ? "" : to_string(made.diagnostics.front()));
  (*made.value)->start();
  std::printf("%d lines, %d clients%s\n", lines, clients, folder.empty() ? "" : ", secured");
  Watch watch(**made.value);
  watch.pass("without clients", 5s);
  const auto children = start_clients(clients, domain, identity("client"));
  for (int i = 0; i < 3; ++i) {
    watch.pass("with the clients", 20s);
  }
  for (const pid_t child : children) {
    kill(child, SIGKILL);
    waitpid(child, nullptr, 0);
  }
  watch.pass("after they were killed", 25s);
  if (!folder.empty()) {
    folders::remove_all(folder);
  }
  return 0;
}

}  // namespace
}  // namespace linegate::bench

int main(int argc, char** argv) {
  return linegate::bench::run(argc, argv);
}

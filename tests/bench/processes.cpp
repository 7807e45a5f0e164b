// SPDX-License-Identifier: Apache-2.0
#include "tests/bench/processes.h"

#include <csignal>
#include <ctime>
#include <filesystem>
#include <fstream>

#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include "tests/bench/measure.h"

namespace linegate::bench {

pid_t start_process(const std::function<void()>& run) {
  const pid_t child = fork();
  require(child >= 0, "no process");
  if (child == 0) {
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    run();
    _exit(1);
  }
  return child;
}

pid_t start_again(const std::vector<std::string>& arguments) {
  return start_process([&] {
    std::vector<char*> command{const_cast<char*>("measurement")};
    for (const std::string& argument : arguments) {
      command.push_back(const_cast<char*>(argument.c_str()));
    }
    command.push_back(nullptr);
    execv("/proc/self/exe", command.data());
  });
}

void end_process(pid_t process) {
  kill(process, SIGKILL);
  waitpid(process, nullptr, 0);
}

std::vector<pid_t> processes_of(pid_t process) {
  std::vector<pid_t> out{process};
  for (const auto& task :
       std::filesystem::directory_iterator("/proc/" + std::to_string(process) + "/task")) {
    std::ifstream children(task.path() / "children");
    for (pid_t child = 0; children >> child;) {
      out.push_back(child);
    }
  }
  return out;
}

double processor_time(pid_t process) {
  clockid_t clock{};
  timespec time{};
  require(clock_getcpuclockid(process, &clock) == 0 && clock_gettime(clock, &time) == 0,
          "a process has ended");
  return static_cast<double>(time.tv_sec) * 1e6 + static_cast<double>(time.tv_nsec) / 1e3;
}

double processor_time_of_all(pid_t process, pid_t without) {
  double out = 0;
  for (const pid_t one : processes_of(process)) {
    out += one == without ? 0 : processor_time(one);
  }
  return out;
}

}  // namespace linegate::bench

// SPDX-License-Identifier: Apache-2.0
#include "tests/dds/peer_process.h"

#include <array>
#include <fstream>
#include <thread>
#include <utility>

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include "tests/dds/own_domain.h"
#include "tests/paths.h"

namespace linegate::test {

using Clock = std::chrono::steady_clock;

std::uint32_t domain() {
  return own_domain();
}

namespace {

// The environment of this process, with one more option of the address sanitizer.
std::vector<std::string> environment(Freed freed) {
  std::vector<std::string> out;
  std::string options = "ASAN_OPTIONS=";
  for (char** one = environ; *one != nullptr; ++one) {
    const std::string_view text = *one;
    if (text.starts_with("ASAN_OPTIONS="))
      options = text;
    else
      out.emplace_back(text);
  }
  out.push_back(options + (freed == Freed::released ? ":quarantine_size_mb=16" : ""));
  return out;
}

}  // namespace

Peer::Peer(const std::string& role, const std::string& profiles, Freed freed) {
  const std::string number = std::to_string(domain());
  std::vector<std::string> variables = environment(freed);
  std::vector<char*> pointers;
  for (std::string& one : variables)
    pointers.push_back(one.data());
  pointers.push_back(nullptr);
  std::array<int, 2> in{};
  std::array<int, 2> out{};
  if (::pipe2(in.data(), O_CLOEXEC) != 0 || ::pipe2(out.data(), O_CLOEXEC) != 0)
    return;
  pid_ = ::fork();
  if (pid_ == 0) {
    ::dup2(in[0], STDIN_FILENO);
    ::dup2(out[1], STDOUT_FILENO);
    ::execle(paths::kDdsPeer, paths::kDdsPeer, role.c_str(), number.c_str(), profiles.c_str(),
             nullptr, pointers.data());
    ::_exit(127);
  }
  ::close(in[0]);
  ::close(out[1]);
  to_ = in[1];
  from_ = out[0];
}

Peer::~Peer() {
  end();
  ::close(from_);
}

bool Peer::end() {
  if (to_ >= 0)
    ::close(std::exchange(to_, -1));
  if (pid_ <= 0)
    return false;
  ::kill(pid_, SIGCONT);
  const auto deadline = Clock::now() + std::chrono::seconds(30);
  int status = -1;
  while (::waitpid(pid_, &status, WNOHANG) == 0) {
    if (Clock::now() > deadline)
      ::kill(pid_, SIGKILL);
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  pid_ = -1;
  return status == 0;
}

void Peer::signal(int number) const {
  if (pid_ > 0)
    ::kill(pid_, number);
}

std::size_t Peer::resident() const {
  std::ifstream statm("/proc/" + std::to_string(pid_) + "/statm");
  std::size_t all = 0;
  std::size_t resident = 0;
  statm >> all >> resident;
  return resident * static_cast<std::size_t>(::sysconf(_SC_PAGESIZE));
}

bool Peer::read_more(int timeout_ms) {
  pollfd output{from_, POLLIN, 0};
  if (::poll(&output, 1, timeout_ms) <= 0)
    return false;
  std::array<char, 4096> chunk{};
  const ssize_t length = ::read(from_, chunk.data(), chunk.size());
  if (length <= 0)
    return false;
  unread_.append(chunk.data(), static_cast<std::size_t>(length));
  return true;
}

std::string Peer::expect(std::string_view prefix, std::chrono::milliseconds deadline) {
  const auto end = Clock::now() + deadline;
  for (;;) {
    const std::size_t newline = unread_.find('\n');
    if (newline != std::string::npos) {
      std::string line = unread_.substr(0, newline);
      unread_.erase(0, newline + 1);
      if (line.starts_with(prefix))
        return line;
      continue;
    }
    const auto left =
        std::chrono::duration_cast<std::chrono::milliseconds>(end - Clock::now()).count();
    if (left <= 0 || !read_more(static_cast<int>(left)))
      return {};
  }
}

}  // namespace linegate::test

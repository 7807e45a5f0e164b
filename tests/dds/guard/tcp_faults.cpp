// SPDX-License-Identifier: Apache-2.0
// Preloaded into a DDS participant (LD_PRELOAD). SIGUSR1 ends its TCP connections, as a network
// does. The thread of Fast DDS that has received on such a connection then stops within
// TCPChannelResourceBasic::disconnect, as if the system had interrupted it, until another thread
// has received on another connection. Prints "overtaken" then.
#include <atomic>
#include <csignal>
#include <cstdio>

#include <dlfcn.h>
#include <netinet/in.h>
#include <semaphore.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <unistd.h>

namespace {

std::atomic<bool> ended = false;    // by SIGUSR1; the next shutdown() waits
std::atomic<bool> waiting = false;  // for octets on another connection
sem_t received;

bool is_connected(int descriptor) {
  sockaddr_in peer{};
  socklen_t size = sizeof peer;
  return ::getpeername(descriptor, reinterpret_cast<sockaddr*>(&peer), &size) == 0 &&
         peer.sin_family == AF_INET;
}

// shutdown(2) itself.
long shut_down(int socket, int how) {
  return ::syscall(SYS_shutdown, socket, how);
}

void end_connections(int) {
  constexpr int kDescriptors = 256;
  ended = true;
  for (int descriptor = 0; descriptor < kDescriptors; ++descriptor) {
    if (is_connected(descriptor))
      shut_down(descriptor, SHUT_RDWR);
  }
}

[[gnu::constructor]] void install() {
  sem_init(&received, 0, 0);
  struct sigaction action {};
  action.sa_handler = end_connections;
  sigaction(SIGUSR1, &action, nullptr);
}

}  // namespace

// They replace the functions of the C library for Fast DDS, and call them.
extern "C" int shutdown(int socket, int how) {
  const auto result = static_cast<int>(shut_down(socket, how));
  if (ended.exchange(false)) {
    waiting = true;
    while (sem_wait(&received) != 0) {
    }
    std::puts("overtaken");
    std::fflush(stdout);
  }
  return result;
}

extern "C" ssize_t recv(int socket, void* buffer, std::size_t size, int flags) {
  using Function = ssize_t (*)(int, void*, std::size_t, int);
  static const auto library = reinterpret_cast<Function>(dlsym(RTLD_NEXT, "recv"));
  const ssize_t result = library(socket, buffer, size, flags);
  if (result > 0 && waiting.exchange(false))
    sem_post(&received);
  return result;
}

// SPDX-License-Identifier: Apache-2.0
#include "gateway/edge/edge_end.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <new>
#include <string_view>
#include <system_error>

#include <fcntl.h>
#include <linux/capability.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <sys/uio.h>
#include <unistd.h>

#include "gateway/edge/memory_size.h"
#include "gateway/edge/system_calls.h"

namespace linegate::gateway {
namespace {

bool drop_capabilities() {
  for (unsigned long capability = 0; capability <= CAP_LAST_CAP; ++capability) {
    prctl(PR_CAPBSET_DROP, capability, 0, 0, 0);  // not permitted without CAP_SETPCAP
  }
  __user_cap_header_struct header{_LINUX_CAPABILITY_VERSION_3, 0};
  std::array<__user_cap_data_struct, 2> none{};
  return prctl(PR_CAP_AMBIENT, PR_CAP_AMBIENT_CLEAR_ALL, 0, 0, 0) == 0 &&
         syscall(SYS_capset, &header, none.data()) == 0;
}

bool limit(__rlimit_resource resource, std::size_t most) {
  rlimit present{};
  getrlimit(resource, &present);
  const rlimit wanted{std::min<rlim_t>(most, present.rlim_max),
                      std::min<rlim_t>(most, present.rlim_max)};
  return setrlimit(resource, &wanted) == 0;
}

// The address sanitizer reserves terabytes for its shadow memory, and cannot work with a limit.
bool limit_data([[maybe_unused]] std::size_t memory) {
#ifdef __has_feature  // Clang, with whose sanitizers this project is built
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
  return true;
#endif
#endif
  return limit(RLIMIT_DATA, memory);
}

// The process ID of the parent does not show it: a gateway in a container may have ID 1.
bool parent_has_ended() {
  pollfd socket{kWakeDescriptor, 0, 0};
  return poll(&socket, 1, 0) == 1 && (socket.revents & POLLHUP) != 0;
}

// If memory is short, the kernel ends this process before the gateway (proc(5)).
void offer_to_end_first() {
  const int file = open("/proc/self/oom_score_adj", O_WRONLY | O_CLOEXEC);
  if (file >= 0) {
    constexpr std::string_view kScore = "500";
    if (write(file, kScore.data(), kScore.size()) < 0) {
      errno = 0;  // without it, the kernel compares the size of both
    }
    close(file);
  }
}

// A single allocation of an absurd size is an error of its caller; with little memory left, nobody
// can go on. Allocates nothing.
void out_of_memory() {
  rlimit data{};
  getrlimit(RLIMIT_DATA, &data);
  if (memory_size("/proc/self/statm").data < data.rlim_cur / 4 * 3) {
    throw std::bad_alloc();
  }
  constexpr std::string_view kText = "<3>the memory of this process is used up\n";
  if (write(STDERR_FILENO, kText.data(), kText.size()) < 0) {
    errno = 0;  // its exit code says so, too
  }
  _exit(kExitOutOfMemory);
}

}  // namespace

bool give_up_privileges(std::size_t memory) {
  offer_to_end_first();
  std::set_new_handler(out_of_memory);
  return prctl(PR_SET_PDEATHSIG, SIGKILL, 0, 0, 0) == 0 && !parent_has_ended() &&
         drop_capabilities() && prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) == 0 &&
         limit(RLIMIT_RTPRIO, 0) && limit(RLIMIT_MEMLOCK, 0) && limit_data(memory) &&
         protect_other_processes();
}

EdgeEnd::EdgeEnd()
    : rings_(kRingsDescriptor),
      bell_(kBellDescriptor),
      incoming_(rings_.other_incoming()),
      outgoing_(rings_.other_outgoing()) {
  close(kRingsDescriptor);
  close(kBellDescriptor);
}

std::span<const std::byte> EdgeEnd::receive(Duration timeout, const std::function<bool()>& more) {
  if (incoming_.front(message_)) {
    return message_;
  }
  bell_.arm();
  const bool work = more && more();
  if (!work && !incoming_.front(message_) && !incoming_.broken()) {
    bell_.wait(timeout);
  }
  bell_.disarm();
  return incoming_.front(message_) ? std::span<const std::byte>(message_)
                                   : std::span<const std::byte>();
}

// Files of an earlier tag may be there: a message about them that found no room was not sent.
std::array<int, 2> EdgeEnd::take_files(std::uint64_t tag) {
  for (;;) {
    std::uint64_t received = 0;
    iovec content{&received, sizeof received};
    alignas(cmsghdr) std::array<char, CMSG_SPACE(2 * sizeof(int))> control{};
    msghdr message{};
    message.msg_iov = &content;
    message.msg_iovlen = 1;
    message.msg_control = control.data();
    message.msg_controllen = control.size();
    const ssize_t length = recvmsg(kWakeDescriptor, &message, MSG_DONTWAIT | MSG_CMSG_CLOEXEC);
    const cmsghdr* const head = CMSG_FIRSTHDR(&message);
    if (length != sizeof received || head == nullptr || head->cmsg_type != SCM_RIGHTS ||
        head->cmsg_len != CMSG_LEN(2 * sizeof(int))) {
      throw std::system_error(length < 0 ? errno : EINVAL, std::generic_category(),
                              "shared memory of the gateway");
    }
    std::array<int, 2> files{};
    std::memcpy(files.data(), CMSG_DATA(head), sizeof files);
    if (received == tag) {
      return files;
    }
    close(files[0]);
    close(files[1]);
  }
}

bool EdgeEnd::send(std::span<const std::byte> message) {
  if (!outgoing_.push(message)) {
    return false;
  }
  if (outgoing_.pop_waiting()) {
    const char octet = 0;
    ::send(kWakeDescriptor, &octet, 1, MSG_DONTWAIT | MSG_NOSIGNAL);
  }
  return true;
}

}  // namespace linegate::gateway

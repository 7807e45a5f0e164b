// SPDX-License-Identifier: Apache-2.0
#include "gateway/edge/system_calls.h"

#include <array>
#include <cerrno>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <fcntl.h>
#include <linux/audit.h>
#include <linux/filter.h>
#include <linux/seccomp.h>
#include <linux/sockios.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <unistd.h>

namespace linegate::gateway {
namespace {

#if defined(__x86_64__)
constexpr std::uint32_t kArchitecture = AUDIT_ARCH_X86_64;
#elif defined(__aarch64__)
constexpr std::uint32_t kArchitecture = AUDIT_ARCH_AARCH64;
#else
constexpr std::uint32_t kArchitecture = 0;
#endif

constexpr std::uint32_t kX32 = 0x4000'0000;  // the numbers of another interface of x86-64

// Headers of Linux 6.1 lack it (Linux 6.6).
constexpr int kFchmodat2 = 452;

// Forbidden whatever their arguments are.
constexpr std::array kForbidden{SYS_tkill,
                                SYS_rt_sigqueueinfo,
                                SYS_rt_tgsigqueueinfo,
                                SYS_pidfd_open,
                                SYS_pidfd_getfd,
                                SYS_pidfd_send_signal,
                                SYS_ptrace,
                                SYS_process_vm_readv,
                                SYS_process_vm_writev,
                                SYS_kcmp,
                                SYS_execve,
                                SYS_execveat,
                                SYS_setpriority,
                                SYS_ioprio_set,
                                SYS_sched_setscheduler,
                                SYS_sched_setparam,
                                SYS_sched_setattr,
                                SYS_sched_setaffinity,
                                SYS_migrate_pages,
                                SYS_move_pages,
                                SYS_unshare,
                                SYS_setns,
                                SYS_mount,
                                SYS_bpf,
                                SYS_perf_event_open,
                                SYS_userfaultfd,
                                SYS_io_uring_setup,
                                SYS_add_key,
                                SYS_keyctl,
                                SYS_request_key,
                                SYS_truncate,
                                SYS_fchmodat,
                                kFchmodat2,
                                SYS_fchownat,
                                SYS_setxattr,
                                SYS_lsetxattr,
                                SYS_utimensat};
#if defined(SYS_chmod)  // not on AArch64
constexpr std::array kForbiddenOld{SYS_chmod, SYS_chown, SYS_lchown};
#else
constexpr std::array<int, 0> kForbiddenOld{};
#endif

// Direct the signals of a file or socket to another process, with any number (fcntl(2)).
constexpr std::array<std::uint32_t, 3> kSignalsByFile{F_SETOWN, F_SETOWN_EX, F_SETSIG};
constexpr std::array<std::uint32_t, 2> kSignalsBySocket{FIOSETOWN, SIOCSPGRP};

class Filter {
 public:
  // Loads a word of seccomp_data.
  void load(std::size_t offset) {
    add(BPF_LD | BPF_W | BPF_ABS, static_cast<std::uint32_t>(offset));
  }
  // The first argument of the call, of which a process ID has the low 32 bits (little-endian).
  void load_first_argument() { load_argument(0); }
  // The low 32 bits.
  void load_argument(std::size_t argument) {
    load(offsetof(seccomp_data, args) + argument * sizeof(std::uint64_t));
  }
  void load_number() { load(offsetof(seccomp_data, nr)); }
  void refuse_if_equal(std::uint32_t value) {
    add(BPF_JMP | BPF_JEQ | BPF_K, value, 0, 1);
    refuse();
  }
  void refuse_unless_equal(std::uint32_t value) {
    add(BPF_JMP | BPF_JEQ | BPF_K, value, 1, 0);
    refuse();
  }
  void refuse_from(std::uint32_t value) {
    add(BPF_JMP | BPF_JGE | BPF_K, value, 0, 1);
    refuse();
  }
  // The call is permitted if its first argument is that value.
  void refuse_call_unless(std::uint32_t number, std::uint32_t first_argument) {
    add(BPF_JMP | BPF_JEQ | BPF_K, number, 0, 4);
    load_first_argument();
    refuse_unless_equal(first_argument);
    load_number();
  }
  // The call is not permitted if the flags in that argument truncate a file that they do not open
  // for writing: Landlock before ABI 3 permits it. Access mode 3 is neither reading nor writing
  // (open(2)).
  void refuse_truncation(std::uint32_t number, std::size_t argument) {
    constexpr std::uint32_t kMask = O_ACCMODE | O_TRUNC;
    add(BPF_JMP | BPF_JEQ | BPF_K, number, 0, 7);
    load_argument(argument);
    add(BPF_ALU | BPF_AND | BPF_K, kMask);
    refuse_if_equal(O_RDONLY | O_TRUNC);
    refuse_if_equal(O_ACCMODE | O_TRUNC);
    load_number();
  }
  // The call is not permitted if its second argument is one of the values.
  template <std::size_t count>
  void refuse_call_if(std::uint32_t number, const std::array<std::uint32_t, count>& values) {
    add(BPF_JMP | BPF_JEQ | BPF_K, number, 0, 2 * count + 2);
    load_argument(1);
    for (const std::uint32_t value : values) {
      refuse_if_equal(value);
    }
    load_number();
  }
  // The flags of that call are in memory, which no filter can read. The C library falls back to
  // another call.
  void hide(std::uint32_t number) {
    add(BPF_JMP | BPF_JEQ | BPF_K, number, 0, 1);
    add(BPF_RET | BPF_K, SECCOMP_RET_ERRNO | ENOSYS);
  }
  bool install() {
    add(BPF_RET | BPF_K, SECCOMP_RET_ALLOW);
    const sock_fprog program{static_cast<unsigned short>(code_.size()), code_.data()};
    return prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, &program) == 0;
  }

 private:
  void add(int code, std::uint32_t value, std::uint8_t if_true = 0, std::uint8_t if_false = 0) {
    code_.push_back({static_cast<std::uint16_t>(code), if_true, if_false, value});
  }
  void refuse() { add(BPF_RET | BPF_K, SECCOMP_RET_ERRNO | EPERM); }

  std::vector<sock_filter> code_;
};

}  // namespace

bool protect_other_processes() {
  if (kArchitecture == 0) {
    return true;
  }
  const auto self = static_cast<std::uint32_t>(getpid());
  Filter filter;
  filter.load(offsetof(seccomp_data, arch));
  filter.refuse_unless_equal(kArchitecture);
  filter.load_number();
  filter.refuse_from(kX32);
  for (const long number : kForbidden) {
    filter.refuse_if_equal(static_cast<std::uint32_t>(number));
  }
  for (const long number : kForbiddenOld) {
    filter.refuse_if_equal(static_cast<std::uint32_t>(number));
  }
  filter.refuse_call_unless(SYS_kill, self);
  filter.refuse_call_unless(SYS_tgkill, self);
  filter.refuse_call_unless(SYS_prlimit64, 0);
#if defined(SYS_open)
  filter.refuse_truncation(SYS_open, 1);
#endif
  filter.refuse_truncation(SYS_openat, 2);
  filter.hide(SYS_openat2);
  filter.refuse_call_if(SYS_fcntl, kSignalsByFile);
  filter.refuse_call_if(SYS_ioctl, kSignalsBySocket);
  return filter.install();
}

}  // namespace linegate::gateway

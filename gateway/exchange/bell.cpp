// SPDX-License-Identifier: Apache-2.0
#include "gateway/exchange/bell.h"

#include <ctime>
#include <new>

#include <linux/futex.h>
#include <sys/syscall.h>
#include <unistd.h>

namespace linegate::exchange {
namespace {

constexpr std::size_t kBellBytes = 4'096;

}  // namespace

static_assert(sizeof(std::atomic<std::uint32_t>) == 4, "futex(2) needs its address");

Bell::Bell() : memory_(kBellBytes, SharedMemory::Other::writes) {
  new (memory_.data()) std::atomic<std::uint32_t>(0);
}

Bell::Bell(int descriptor) : memory_(descriptor, kBellBytes, SharedMemory::Other::writes) {
}

std::atomic<std::uint32_t>& Bell::word() const {
  return *std::launder(reinterpret_cast<std::atomic<std::uint32_t>*>(memory_.data()));
}

[[gnu::hot]] void Bell::ring() {
  std::atomic_thread_fence(std::memory_order_seq_cst);
  if (word().load(std::memory_order_relaxed) != 0 &&
      word().exchange(0, std::memory_order_relaxed) != 0) {
    syscall(SYS_futex, &word(), FUTEX_WAKE, 1, nullptr, nullptr, 0);
  }
}

void Bell::arm() {
  word().store(1, std::memory_order_relaxed);
  std::atomic_thread_fence(std::memory_order_seq_cst);
}

void Bell::disarm() {
  word().store(0, std::memory_order_relaxed);
}

void Bell::wait(Duration timeout) {
  const timespec limit{static_cast<time_t>(timeout.count() / 1'000'000'000),
                       static_cast<long>(timeout.count() % 1'000'000'000)};
  syscall(SYS_futex, &word(), FUTEX_WAIT, 1, &limit, nullptr, 0);
}

}  // namespace linegate::exchange

// SPDX-License-Identifier: Apache-2.0
#include "gateway/exchange/wakeup.h"

#include <cerrno>
#include <cstdint>
#include <system_error>

#include <sys/eventfd.h>
#include <unistd.h>

namespace linegate::exchange {

Wakeup::Wakeup() : descriptor_(eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)) {
  if (descriptor_ < 0) {
    throw std::system_error(errno, std::generic_category(), "eventfd");
  }
}

Wakeup::~Wakeup() {
  close(descriptor_);
}

[[gnu::hot]] void Wakeup::signal() {
  if (pending_.exchange(true, std::memory_order_acq_rel)) {
    return;
  }
  const std::uint64_t one = 1;
  while (write(descriptor_, &one, sizeof one) < 0 && errno == EINTR) {
  }
}

[[gnu::hot]] void Wakeup::clear() {
  std::uint64_t count = 0;
  while (read(descriptor_, &count, sizeof count) < 0 && errno == EINTR) {
  }
  // After the read: a signal between the two is either detected by the caller's check of the rings,
  // or writes again.
  clear_edge();
}

// The counter of the eventfd, which is never read, would overflow after 2^64 signals.
[[gnu::hot]] void Wakeup::clear_edge() {
  pending_.exchange(false, std::memory_order_acq_rel);
}

}  // namespace linegate::exchange

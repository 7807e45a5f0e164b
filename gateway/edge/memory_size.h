// SPDX-License-Identifier: Apache-2.0
// The memory that a process uses, from /proc.
#pragma once

#include <cstddef>

namespace linegate::gateway {

// In octets.
struct MemorySize {
  std::size_t resident = 0;  // without memory that it shares with other processes or files
  std::size_t data = 0;      // as RLIMIT_DATA counts, with memory that was never written
};

// statm: such as "/proc/self/statm" (proc(5)). Zeros if it cannot be read: the process has ended.
// Allocates nothing.
MemorySize memory_size(const char* statm);

}  // namespace linegate::gateway

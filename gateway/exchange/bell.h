// SPDX-License-Identifier: Apache-2.0
// Wakes a thread of another process that waits for messages and records of several sources.
//
// The word in the memory is a hint: whatever the other process writes to it costs a thread that
// rings one system call at most, and never lets it wait.
#pragma once

#include <atomic>
#include <cstdint>

#include "gateway/exchange/shared_memory.h"
#include "stack/base/time.h"

namespace linegate::exchange {

class Bell {
 public:
  // Creates it. Throws std::system_error.
  Bell();
  // That of the process that created it. Throws std::system_error.
  explicit Bell(int descriptor);

  int descriptor() const { return memory_.descriptor(); }

  // From any thread, after it has stored what the other one waits for.
  void ring();

  // --- the one thread that waits
  // ------------------------------------------------------------------

  // Call it before looking for something to do. If there is nothing, wait(): it returns when ring()
  // was called since arm(), when the timeout has passed, or, rarely, earlier.
  void arm();
  void wait(Duration timeout);
  // Call it afterwards, whether it has waited or not: ring() is then cheap.
  void disarm();

 private:
  // 1: the other thread is about to wait.
  std::atomic<std::uint32_t>& word() const;

  SharedMemory memory_;
};

}  // namespace linegate::exchange

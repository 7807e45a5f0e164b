// SPDX-License-Identifier: Apache-2.0
// The end of the link in the process that EdgeProcess starts.
#pragma once

#include <cstddef>
#include <functional>
#include <span>
#include <vector>

#include "gateway/exchange/shared_rings.h"
#include "stack/base/time.h"

namespace linegate::gateway {

// The descriptors that the process has, besides standard input (/dev/null), output and error (a
// pipe to the log).
inline constexpr int kRingsDescriptor = 3;  // exchange::SharedRings
inline constexpr int kWakeDescriptor = 4;   // a socket: an octet wakes the gateway

// The exit code of a process that has used up the memory of give_up_privileges(). As in sysexits.h,
// it is none that a program ends with by accident.
inline constexpr int kExitOutOfMemory = 71;

// Gives up every privilege that the process does not need: capabilities, new privileges, real-time
// priority, and system calls that affect other processes (system_calls.h); limits its memory to
// `memory` octets, and ends with kExitOutOfMemory when operator new reaches that limit. The process
// ends with its parent. Call it first in main(). Returns false if the system refuses one of them,
// or the parent has ended already.
bool give_up_privileges(std::size_t memory);

class EdgeEnd {
 public:
  // Throws std::system_error if the process has not been started by EdgeProcess.
  EdgeEnd();

  // --- the thread that receives ---------------------------------------------------------------

  // Returns the oldest message, which counts as carried out after done(); empty if none arrived
  // within the timeout.
  std::span<const std::byte> receive(Duration timeout);
  void done() { incoming_.pop(); }
  // The memory contains what no EdgeProcess writes.
  bool broken() const { return incoming_.broken(); }
  void add_receiver_progress() { rings_.add_progress(0); }

  // --- the thread that sends ------------------------------------------------------------------

  // Returns false if there is no room.
  bool send(std::span<const std::byte> message);
  void add_sender_progress() { rings_.add_progress(1); }

 private:
  exchange::SharedRings rings_;
  exchange::ByteRingConsumer incoming_;
  exchange::ByteRingProducer outgoing_;
  std::vector<std::byte> message_;
};

}  // namespace linegate::gateway

// SPDX-License-Identifier: Apache-2.0
// The end of the link in the process that EdgeProcess starts.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "gateway/exchange/bell.h"
#include "gateway/exchange/shared_rings.h"
#include "stack/base/time.h"

namespace linegate::gateway {

// The descriptors that the process has, besides standard input (/dev/null), output and error (a
// pipe to the log).
inline constexpr int kRingsDescriptor = 3;  // exchange::SharedRings
// A socket: an octet wakes the gateway, which sends descriptors by it (EdgeEnd::take_files()).
inline constexpr int kWakeDescriptor = 4;
inline constexpr int kBellDescriptor = 5;  // exchange::Bell

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
  // more: returns true if the caller has other work, which ring() of the gateway's bell announces.
  std::span<const std::byte> receive(Duration timeout, const std::function<bool()>& more = {});
  void done() { incoming_.pop(); }
  // Ends the present receive(), or the next one, after a thread has stored what `more` finds. From
  // any thread.
  void wake() { bell_.ring(); }
  // The memory contains what no EdgeProcess writes.
  bool broken() const { return incoming_.broken(); }
  // The descriptors that the gateway has sent with that tag, before any message about it. The
  // caller closes them. Throws std::system_error if there are none.
  std::array<int, 2> take_files(std::uint64_t tag);
  void add_receiver_progress() { rings_.add_progress(0); }

  // --- the thread that sends ------------------------------------------------------------------

  // Returns false if there is no room.
  bool send(std::span<const std::byte> message);
  void add_sender_progress() { rings_.add_progress(1); }

 private:
  exchange::SharedRings rings_;
  exchange::Bell bell_;
  exchange::ByteRingConsumer incoming_;
  exchange::ByteRingProducer outgoing_;
  std::vector<std::byte> message_;
};

}  // namespace linegate::gateway

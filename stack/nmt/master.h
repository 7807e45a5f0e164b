// SPDX-License-Identifier: Apache-2.0
// Node control by the NMT master (CiA 301, 7.2.8.2.1): sends commands as frames, separated by the
// inhibit time of 102Ah (CiA 302-2).
#pragma once

#include <cstdint>
#include <deque>

#include "stack/base/time.h"
#include "stack/can/transmit_queue.h"
#include "stack/nmt/node_control.h"
#include "stack/nmt/state.h"

namespace linegate::od {
class Dictionary;
}

namespace linegate::nmt {

class Master {
 public:
  // transmit and dictionary must outlive the master. 102Ah (UNSIGNED16, 100 us) of the dictionary
  // is read before each command. Without a dictionary, or without the object, there is no inhibit
  // time.
  explicit Master(can::TransmitQueue& transmit, const od::Dictionary* dictionary = nullptr);

  // False: the node is not the NMT master of its network (1F80h bit 0). Then send() refuses, and
  // commands in the transmit queue are dropped; other frames of that class stay. Initially true.
  void set_active(bool active);

  // Queues the command for a node, 1..127, or 0 = all nodes except the master itself. It is sent
  // after the inhibit time of the previous one, in the order of the calls. Returns false, without
  // queueing, if node is above 127, the queue is full, or the master is not active.
  bool send(Command command, std::uint8_t node, Instant now);

  // Whether the command waits for the end of the inhibit time.
  bool waits(const NodeControl& control) const;

  void advance(Instant now);
  // When the next waiting command is due; kNever if none waits.
  Instant next_wake() const { return waiting_.empty() ? kNever : free_at_; }

 private:
  Duration inhibit_time() const;
  bool push(const NodeControl& control, Instant now);

  can::TransmitQueue& transmit_;
  const od::Dictionary* dictionary_;
  std::deque<NodeControl> waiting_;
  Instant free_at_{};  // end of the inhibit time
  bool active_ = true;
};

}  // namespace linegate::nmt

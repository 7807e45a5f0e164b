// SPDX-License-Identifier: Apache-2.0
// The NMT master's half of node control (CiA 301, 7.2.8.2.1): commands become frames, with the
// inhibit time of 102Ah (CiA 302-2) between them.
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
  // transmit must outlive the master; so must dictionary, whose 102Ah (UNSIGNED16, 100 us) is read
  // before each command. Without one, or without the object, commands follow each other at once.
  explicit Master(can::TransmitQueue& transmit, const od::Dictionary* dictionary = nullptr);

  // False: the node is not the NMT master of its network (1F80h bit 0). send() refuses, and
  // commands that no controller has taken yet are dropped. True to begin with.
  void set_active(bool active);

  // Queues the command for a node, 1..127, or 0 = all nodes but the master itself. It is sent when
  // the inhibit time of the one before is over, in the order of the calls. False if node is above
  // 127, there is no room, or the master is not active: nothing was queued then.
  bool send(Command command, std::uint8_t node, Instant now);

  // The command waits for the inhibit time.
  bool waits(const NodeControl& control) const;

  void advance(Instant now);
  // Of the next command that waits; kNever if none does.
  Instant next_wake() const { return waiting_.empty() ? kNever : free_at_; }

 private:
  Duration inhibit_time() const;
  bool push(const NodeControl& control, Instant now);

  can::TransmitQueue& transmit_;
  const od::Dictionary* dictionary_;
  std::deque<NodeControl> waiting_;
  Instant free_at_{};  // of the inhibit time
  bool active_ = true;
};

}  // namespace linegate::nmt

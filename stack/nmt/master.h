// The NMT master's half of node control (CiA 301, 7.2.8.2.1): commands become frames.
#pragma once

#include <cstdint>

#include "stack/can/transmit_queue.h"
#include "stack/nmt/state.h"

namespace linegate::nmt {

class Master {
 public:
  // transmit must outlive the master.
  explicit Master(can::TransmitQueue& transmit);

  // Queues the command for a node, 1..127, or 0 = all nodes but the master itself. False if node is
  // above 127 or the queue has no room: nothing was queued then.
  bool send(Command command, std::uint8_t node = 0);

 private:
  can::TransmitQueue& transmit_;
};

}  // namespace linegate::nmt

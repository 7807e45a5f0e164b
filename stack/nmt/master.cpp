#include "stack/nmt/master.h"

#include "stack/can/cob_id.h"
#include "stack/nmt/node_control.h"

namespace linegate::nmt {

Master::Master(can::TransmitQueue& transmit) : transmit_(transmit) {
}

bool Master::send(Command command, std::uint8_t node) {
  return node <= can::kMaxNodeId &&
         transmit_.push(can::TransmitClass::nmt, encode({command, node}));
}

}  // namespace linegate::nmt

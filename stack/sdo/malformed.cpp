// SPDX-License-Identifier: Apache-2.0
#include "stack/can/dispatch.h"
#include "stack/sdo/protocol.h"

namespace linegate::sdo {

void report_malformed(const can::Frame& frame, std::uint8_t node, EventLog& events) {
  events.emit(can::malformed_event(frame, node));
}

}  // namespace linegate::sdo

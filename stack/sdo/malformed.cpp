// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include "stack/sdo/protocol.h"

namespace linegate::sdo {

void tell_malformed(const can::Frame& frame, std::uint8_t node, EventLog& events) {
  Event event;
  event.time = frame.time;
  event.kind = EventKind::malformed_frame;
  event.node = node;
  event.code = frame.id;
  event.value = frame.length;
  event.length = std::min(frame.length, std::uint8_t{8});
  std::copy_n(frame.data.begin(), event.length, event.data.begin());
  events.emit(event);
}

}  // namespace linegate::sdo

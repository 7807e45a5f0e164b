// SPDX-License-Identifier: Apache-2.0
// How a frame that a service wanted but could not understand is told.
#pragma once

#include <algorithm>
#include <cstddef>

#include "stack/base/event.h"
#include "stack/can/frame.h"

namespace linegate::can {

// EventKind::malformed_frame with identifier, length and the first 8 bytes. node: the one
// concerned, 0 = the line.
inline Event malformed_event(const Frame& frame, std::uint8_t node = 0) {
  Event event;
  event.time = frame.time;
  event.kind = EventKind::malformed_frame;
  event.node = node;
  event.code = frame.id;
  event.value = frame.length;
  event.length = std::min<std::uint8_t>(frame.length, 8);
  std::copy_n(frame.data.begin(), event.length, event.data.begin());
  return event;
}

}  // namespace linegate::can

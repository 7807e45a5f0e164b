// SPDX-License-Identifier: Apache-2.0
// How a frame that is no SDO frame is told.
#pragma once

#include <cstdint>

#include "stack/base/event_log.h"
#include "stack/can/frame.h"

namespace linegate::sdo {

// Emits EventKind::malformed_frame. node: whose frame it is, 0 if unknown.
void tell_malformed(const can::Frame& frame, std::uint8_t node, EventLog& events);

}  // namespace linegate::sdo

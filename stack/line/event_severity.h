// SPDX-License-Identifier: Apache-2.0
// The severity of an event. It usually follows from the kind; for some kinds it depends on the
// content.
#pragma once

#include "stack/base/event.h"

namespace linegate::line {

// The severity of the event's kind, see linegate::severity(), except for:
//   boot_result    error if the node was not booted
//   manager_state  error if the network halts or waits for a mandatory node
//   lss_result     warning if the device was not configured completely
EventSeverity severity_of(const Event& event);

}  // namespace linegate::line

// SPDX-License-Identifier: Apache-2.0
// The severity of an event. It usually follows from the kind; for some kinds it depends on the
// content.
#pragma once

#include "stack/base/event.h"

namespace linegate::line {

// The severity of the kind, see linegate::severity(), except for:
//   BootResult    error if the node was not booted
//   ManagerState  error if the network halts or waits for a mandatory node
//   LssResult     warning if the device was not configured completely
//   JournalState  error if events are or were not stored, or the previous journal was unusable
EventSeverity severity_of(const EventData& data);

}  // namespace linegate::line

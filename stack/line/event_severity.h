// SPDX-License-Identifier: Apache-2.0
// How serious an event is. Most are as serious as their kind; of some it depends on what they say.
#pragma once

#include "stack/base/event.h"

namespace linegate::line {

// That of the event's kind, see linegate::severity(), but
//   boot_result    error if the node was not booted
//   manager_state  error if the network halts or waits for a mandatory node
//   lss_result     warning if the device did not get all it was to have
EventSeverity severity_of(const Event& event);

}  // namespace linegate::line

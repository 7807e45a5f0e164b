// The signals a program waits for: SIGINT and SIGTERM end it, SIGHUP makes the gateway read its
// configuration again.
#pragma once

#include <optional>

#include "stack/base/time.h"

namespace linegate::gateway {

// By main() before any thread starts: no thread is interrupted by SIGINT and SIGTERM.
void block_stop_signals();
// The same for SIGHUP, which ends a program otherwise.
void block_reload_signal();

// Waits for SIGINT or SIGTERM and gives its number.
int wait_for_stop_signal();

// Waits for any of the three, but no longer than that.
std::optional<int> wait_for_signal(Duration timeout);

}  // namespace linegate::gateway

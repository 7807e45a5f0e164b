// SPDX-License-Identifier: Apache-2.0
// The signals a program waits for: SIGINT and SIGTERM end it, SIGHUP makes the gateway read its
// configuration again.
#pragma once

#include <chrono>
#include <optional>

#include "stack/base/time.h"

namespace linegate::gateway {

// By main() before any thread starts: no thread is interrupted by SIGINT and SIGTERM.
void block_stop_signals();

// After SIGINT or SIGTERM the process ends within this time, at the latest: unless it has ended by
// then, a thread of its own writes a message to standard error and ends the process with
// kExitForced, whatever the other threads do and whether or not one of them waits for signals. A
// library thread that never returns, or a main() that waits for it, holds up the end no longer.
// Call it once, after block_stop_signals(). limit: 1 s at least.
void limit_end(Duration limit);
// What the commands of the console use.
inline constexpr Duration kEndLimit = std::chrono::milliseconds(4'500);
// The same for SIGHUP, which ends a program otherwise.
void block_reload_signal();

// Instead, for a program that looks for a signal in a loop: SIGINT and SIGTERM are caught, and end
// the program within 4 s even if it does not come to look (kExitForced).
void catch_stop_signals();
bool stop_signal_caught();

// Waits for SIGINT or SIGTERM and gives its number.
int wait_for_stop_signal();

// Waits for any of the three, but no longer than that.
std::optional<int> wait_for_signal(Duration timeout);

}  // namespace linegate::gateway

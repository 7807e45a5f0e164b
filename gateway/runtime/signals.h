// SPDX-License-Identifier: Apache-2.0
// The signals of a program: SIGINT and SIGTERM end it, SIGHUP makes the gateway reload its
// configuration.
#pragma once

#include <chrono>
#include <optional>

#include <sys/types.h>

#include "stack/base/time.h"

namespace linegate::gateway {

// Call it in main() before any thread starts: no thread is interrupted by SIGINT and SIGTERM.
void block_stop_signals();

// Limits the time from SIGINT or SIGTERM to the end of the process: if it has not ended by then, a
// thread writes a message to standard error and ends the process with kExitForced, whatever the
// other threads do and whether or not one of them waits for signals. A library thread that never
// returns, or a main() that waits for it, cannot delay the end any longer. Call it once, after
// block_stop_signals(). limit: 1 s at least.
void limit_end(Duration limit);
// The limit of the console's commands.
inline constexpr Duration kEndLimit = std::chrono::milliseconds(4'500);
// The same for SIGHUP, which ends a program by default.
void block_reload_signal();

// The alternative for a program that polls for signals in a loop: SIGINT and SIGTERM are caught,
// and end the program within 4 s even if it does not poll (kExitForced).
void catch_stop_signals();
bool stop_signal_caught();

// Limits the time until the end of its scope, such as that of the end of a library that may wait
// for a thread for ever: the process then ends with a message to standard error and kExitForced.
// One at a time. Uses SIGALRM, as catch_stop_signals() does; the earlier one of both limits
// applies.
class TimeToEnd {
 public:
  explicit TimeToEnd(std::chrono::seconds limit);
  ~TimeToEnd();
  TimeToEnd(const TimeToEnd&) = delete;
  TimeToEnd& operator=(const TimeToEnd&) = delete;
};

// Whether SIGINT or SIGTERM has arrived and no thread has taken it yet. After block_stop_signals().
bool stop_signal_pending();

// Waits for SIGINT or SIGTERM and returns its number.
int wait_for_stop_signal();

// The process that sent a signal, as the kernel reports it.
struct SignalSender {
  pid_t process = 0;
  uid_t user = 0;  // the real user ID of the process
};

struct ReceivedSignal {
  int number = 0;
  std::optional<SignalSender> sender{};  // nothing: the kernel, such as a terminal that is closed
};

// Waits for any of the three signals, for at most `timeout`.
std::optional<ReceivedSignal> wait_for_signal(Duration timeout);

}  // namespace linegate::gateway

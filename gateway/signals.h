// SIGINT and SIGTERM as something a program waits for.
#pragma once

namespace linegate::gateway {

// By main() before any thread starts: no thread is interrupted by them.
void block_stop_signals();

// Waits for one of them and gives its number.
int wait_for_stop_signal();

}  // namespace linegate::gateway

// SPDX-License-Identifier: Apache-2.0
// The exit codes of the programs.
#pragma once

namespace linegate::gateway {

inline constexpr int kExitOk = 0;
inline constexpr int kExitFailed = 1;  // an error at run time
inline constexpr int kExitUsage = 2;   // the command line or the configuration is wrong
// A stop signal was received, and a thread did not end in time
inline constexpr int kExitForced = 70;

}  // namespace linegate::gateway

// SPDX-License-Identifier: Apache-2.0
// How the programs end.
#pragma once

namespace linegate::gateway {

inline constexpr int kExitOk = 0;
inline constexpr int kExitFailed = 1;   // something went wrong while running
inline constexpr int kExitUsage = 2;    // the command line or the configuration is wrong
inline constexpr int kExitForced = 70;  // a stop signal came, and a thread did not end in time

}  // namespace linegate::gateway

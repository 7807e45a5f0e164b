// How the programs end.
#pragma once

namespace linegate::gateway {

inline constexpr int kExitOk = 0;
inline constexpr int kExitFailed = 1;  // something went wrong while running
inline constexpr int kExitUsage = 2;   // the command line or the configuration is wrong

}  // namespace linegate::gateway

// SPDX-License-Identifier: Apache-2.0
// `linegate write --hold` and `--while`: an output that has its value as long as the console writes
// it.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>

#include "bridges/console/commands.h"

namespace linegate::console {

// The watchdog of the outputs: so long after the last write they become 0.
inline constexpr Duration kHoldWatchdog = std::chrono::seconds(2);

struct HoldRequest {
  std::string line;
  std::string entry;  // as write() takes it
  std::string value;
  std::optional<std::uint16_t> group{};  // of outputs; none: the one that the entry is in
  Duration time{};                       // from the first write; 0 = until stopped() says so
};

// Writes the value as OutputWrite again and again. Its watchdog sets the outputs of the group to 0
// kHoldWatchdog after the last write, also if the console is killed. kFailed: the line refused it,
// or its image did not show the value within context.timeout. kUsage also if no group was given and
// the entry is in none.
int hold(Context& context, const HoldRequest& request, const std::function<bool()>& stopped);

}  // namespace linegate::console

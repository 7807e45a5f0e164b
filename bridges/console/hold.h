// SPDX-License-Identifier: Apache-2.0
// `linegate write --hold` and `--while`: an output keeps its value only as long as the console
// writes it.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>

#include "bridges/console/commands.h"

namespace linegate::console {

// Watchdog time of the outputs: they become 0 this long after the last write.
inline constexpr Duration kHoldWatchdog = std::chrono::seconds(2);

struct HoldRequest {
  std::string line;
  std::string entry;  // in the syntax of write()
  std::string value;
  std::optional<std::uint16_t> group{};  // group of outputs; none: the group of the entry
  bool raw = false;                      // as of write()
  Duration time{};                       // since the first write; 0 = until stopped() returns true
};

// Publishes the value as OutputWrite periodically. The watchdog sets the outputs of the group to 0
// kHoldWatchdog after the last write, also if the console is killed. Each change between held and
// not held is reported. kDone: the value was held from its first appearance in the image to the
// end. kHeldBack: at the end, the line has accepted it and not sent it. kFailed: the line refused
// it (refusals of other clients have no effect), its image did not show the value within
// context.timeout, the value was lost meanwhile, or the gateway was started again, where nothing is
// written. kUsage also if no group was given and the entry is in none.
int hold(Context& context, const HoldRequest& request, const std::function<bool()>& stopped);

}  // namespace linegate::console

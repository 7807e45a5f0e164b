// The live view: lines, nodes, changing values, events.
#pragma once

#include <functional>

#include "bridges/console/commands.h"

namespace linegate::console {

struct MonitorOptions {
  Duration duration{};  // 0 = until stopped
  bool once = false;    // one picture as plain text, then done
};

// On a terminal a screen that follows its size (80x24 is enough): q or Ctrl-C ends, Tab and the
// arrow keys choose the line, up and down scroll its values, o switches inputs and outputs.
// stopped() is asked several times a second.
int monitor_screen(Context& context, const MonitorOptions& options,
                   const std::function<bool()>& stopped);

// The same as plain text for files and pipes: a picture every two seconds, events as they come.
int monitor_text(Context& context, const MonitorOptions& options,
                 const std::function<bool()>& stopped);

}  // namespace linegate::console

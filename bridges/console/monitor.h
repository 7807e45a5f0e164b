// SPDX-License-Identifier: Apache-2.0
// The live view of a plant: lines, nodes, changing values, events.
#pragma once

#include <functional>

#include "bridges/console/commands.h"
#include "bridges/console/filter.h"

namespace linegate::console {

struct MonitorOptions {
  Duration duration{};  // 0 = until stopped
  bool once = false;    // print the present state as text or one JSON document, then end
  Filter filter;
};

// model: that of the whole command, with everything received so far. Gateways send layouts, states
// and kept events to each client only once.

// On a terminal: pages of lines, nodes, values and events, a page for each node, and one that lists
// the keys. It follows the size of the terminal; 80x24 is enough. stopped() is called several times
// a second. If the terminal cannot be used: as monitor_text().
int monitor_screen(Context& context, const MonitorOptions& options, Model& model,
                   const std::function<bool()>& stopped);

// For files, pipes and scripts: the state every two seconds, events as they arrive.
int monitor_text(Context& context, const MonitorOptions& options, Model& model,
                 const std::function<bool()>& stopped);

// Sets filter.node to the node-ID in `text`, or to that of the node with this name on the line of
// the filter. Without a line in the filter, sets it to the only line with a node of this name.
// Empty text: all nodes. Returns the exit code, after an error message on context.err.
int find_node(Context& context, Model& model, const std::string& text, Filter& filter);

}  // namespace linegate::console

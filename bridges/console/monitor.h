// SPDX-License-Identifier: Apache-2.0
// The view of a plant: lines, nodes, changing values, events.
#pragma once

#include <functional>

#include "bridges/console/commands.h"
#include "bridges/console/filter.h"

namespace linegate::console {

struct MonitorOptions {
  Duration duration{};  // 0 = until stopped
  bool once = false;    // what there is, as text or one JSON document, then done
  Filter filter;
};

// The model of each function below is that of the whole command: it has what was received before.
// Gateways send layouts, states and kept events once to each client.

// On a terminal: pages of lines, nodes, values and events, a page for each node, and one that tells
// the keys. It follows the size of the terminal; 80x24 is enough. stopped() is asked several times
// a second. Where the terminal cannot be used: as monitor_text().
int monitor_screen(Context& context, const MonitorOptions& options, Model& model,
                   const std::function<bool()>& stopped);

// The same for files, pipes and scripts: a picture every two seconds, events as they come.
int monitor_text(Context& context, const MonitorOptions& options, Model& model,
                 const std::function<bool()>& stopped);

// Sets filter.node to the node-ID that was typed, or to that of the node of this name on the line
// of the filter. Without a line in the filter, sets it to the only line that has a node of this
// name. Empty text: all nodes. The exit code; what is wrong is said on context.err.
int find_node(Context& context, Model& model, const std::string& text, Filter& filter);

}  // namespace linegate::console

// SPDX-License-Identifier: Apache-2.0
// Which node and object a command of `linegate sdo` is about, and over which line it is reached.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "bridges/console/commands.h"
#include "bridges/console/model.h"
#include "stack/line/command.h"

namespace linegate::console {

struct SdoTarget {
  NodeRef node;
  line::Command command;
  bool whole_object = false;    // no sub-index was typed
  const Line* owner = nullptr;  // the line with the node; nullptr: it is not received
};

// The words of a command line as a target; otherwise says on context.err what they are not.
std::optional<SdoTarget> sdo_target(Context& context, const std::string& node,
                                    const std::string& index, const std::string& sub, bool write);

// The line with the node; nullptr: there is none, and the error is printed.
const Line* find_own_line(Context& context, Model& model, SdoTarget& target);
// The line that has the node; or the one over which its network is reached, by routes that gateways
// publish. nullptr: there is neither, and the error is printed.
const Line* find_target(Context& context, Model& model, SdoTarget& target, const std::string& via);

struct MeantNodes {
  std::vector<std::uint8_t> nodes;
  std::string missing;  // "3 of 12 nodes of press were received"; empty: all that are configured
};

// The nodes that are meant; otherwise says on context.err why there are none.
std::optional<MeantNodes> meant_nodes(Context& context, Model& model, const SdoTarget& target);
// The next of several nodes; nothing if one was named.
void select_node(SdoTarget& target, std::uint8_t node);

// Empty: the node has none, or it is not received. Precondition: target.owner is not nullptr.
std::string name_of(const SdoTarget& target);
// "5 (ram)"
std::string node_text(const SdoTarget& target);
// "5 (ram): " before a message about one of several nodes.
std::string prefix_of(const SdoTarget& target);

}  // namespace linegate::console

// SPDX-License-Identifier: Apache-2.0
// The node and object of a `linegate sdo` command, and the line that reaches it.
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
  od::Address address{};
  bool write = false;
  std::optional<std::uint16_t> network{};  // network-ID, if it is not that of the requested line
  bool as_device = false;                  // of a network: as a device of the requested line
  bool from_image = false;                 // a valid value of the input image is accepted
  bool from_scan = false;                  // the value that a scan read is accepted
  std::vector<std::byte> data{};           // to be written
  Duration timeout{};
  bool whole_object = false;    // no sub-index was typed
  const Line* owner = nullptr;  // the line of the node; nullptr: not received
};
// The command that reads or writes the object.
line::Command command_of(const SdoTarget& target);

// Parses the words of a command line; nothing, after an error message, if they are invalid.
std::optional<SdoTarget> sdo_target(Context& context, const std::string& node,
                                    const std::string& index, const std::string& sub, bool write);

// The line of the node; nullptr after an error message.
const Line* find_own_line(Context& context, Model& model, SdoTarget& target);
// The line of the node, or the line over which its network is reached by the routes that gateways
// publish; nullptr after an error message.
const Line* find_target(Context& context, Model& model, SdoTarget& target, const std::string& via);

struct MeantNodes {
  std::vector<std::uint8_t> nodes;
  std::string missing;  // "3 of 12 nodes of press were received"; empty: all configured nodes
};

// The selected nodes; nothing, after an error message, if there are none.
std::optional<MeantNodes> meant_nodes(Context& context, Model& model, const SdoTarget& target);
// Selects the next of several nodes; no effect if one was named.
void select_node(SdoTarget& target, std::uint8_t node);

// The name of the node; empty if it has none or was not received. Precondition: target.owner is not
// nullptr.
std::string name_of(const SdoTarget& target);
// "5 (ram)"
std::string node_text(const SdoTarget& target);
// "5 (ram): ", for messages about one of several nodes.
std::string prefix_of(const SdoTarget& target);

}  // namespace linegate::console

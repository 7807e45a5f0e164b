// SPDX-License-Identifier: Apache-2.0
#include "bridges/console/sdo_target.h"

#include <algorithm>
#include <ostream>
#include <set>
#include <utility>

#include "bridges/console/discovery.h"
#include "bridges/console/lookup.h"
#include "bridges/console/routes.h"
#include "bridges/console/table.h"
#include "stack/base/assert.h"

namespace linegate::console {
namespace {

// A network of one gateway; empty: of any gateway.
struct RemoteNetwork {
  std::uint16_t number = 0;
  std::string gateway;
};

// "NETWORK" or "GATEWAY/NETWORK" with a network-ID that belongs to no line.
std::optional<RemoteNetwork> remote_network(const Model& model, const std::string& line) {
  const std::size_t slash = line.find('/');
  const bool full_name = slash != std::string::npos;
  const auto number = parse_number(full_name ? line.substr(slash + 1) : line, 0xFFFF, false);
  if (!number || *number == 0 || !model.find(line).empty()) {
    return std::nullopt;
  }
  return RemoteNetwork{static_cast<std::uint16_t>(*number),
                       full_name ? line.substr(0, slash) : std::string()};
}

// Resolves the name of the node.
bool resolve_target(Context& context, Model& model, const Line& line, SdoTarget& target) {
  return resolve_node(context, model, line, target.node);
}

// The line named by `via`; the network is a number, or that of a line.
const Line* find_via(Context& context, Model& model, SdoTarget& target, const std::string& via) {
  if (target.node.own) {
    context.err << "--via cannot address the own node of a line\n";
    return nullptr;
  }
  const Line* const line = find_line(context, model, via);
  if (line == nullptr) {
    return nullptr;
  }
  target.as_device = true;
  const auto number = parse_number(target.node.line, 0xFFFF, false);
  if (number && target.node.name.empty() && !target.node.all) {
    target.network = static_cast<std::uint16_t>(*number);
    return line;
  }
  const Line* const other = find_line(context, model, target.node.line);
  if (other == nullptr || !resolve_target(context, model, *other, target)) {
    return nullptr;
  }
  target.owner = other;
  target.network = other->view->state.network_id;
  return line;
}

// The lines over which a network is reached whose network-ID belongs to no line.
std::vector<const Line*> ways_to(const Model& model, const std::string& line) {
  const auto network = remote_network(model, line);
  return network ? find_ways(model, network->number, network->gateway) : std::vector<const Line*>();
}

// Whether there is one and, for that of a named gateway, no line that was not received yet has this
// network-ID or a cheaper route.
bool has_way(const Context& context, const Model& model, const std::string& line) {
  const auto network = remote_network(model, line);
  return network && !find_ways(model, network->number, network->gateway).empty() &&
         (network->gateway.empty() || has_all_lines(context, model, network->gateway) ||
          is_settled(context, model));
}

const Line* own_line(Context& context, Model& model, SdoTarget& target, const Line* line) {
  target.owner = line;
  return line != nullptr && resolve_target(context, model, *line, target) ? line : nullptr;
}

// "5, 10..19": the networks that a gateway reaches, or any.
std::string reached_networks(const Model& model, const std::string& gateway) {
  std::set<std::pair<std::uint16_t, std::uint16_t>> networks;
  for (const KnownRoute& route : routes_of(model)) {
    if (gateway.empty() || route.gateway == gateway) {
      networks.emplace(route.first, route.last);
    }
  }
  std::string out;
  for (const auto& [first, last] : networks) {
    out += (out.empty() ? "" : ", ") + std::to_string(first) +
           (first == last ? "" : ".." + std::to_string(last));
  }
  return out.empty() ? "none" : out;
}

// The line of the node, after the wait for it; for a network without a route the error message says
// so.
const Line* line_without_way(Context& context, Model& model, SdoTarget& target, Lookup result) {
  const std::string& line = target.node.line;
  const auto network = remote_network(model, line);
  const bool unknown = network && ways_to(model, line).empty() && !model.lines().empty();
  if (!unknown || result == Lookup::found) {
    return own_line(context, model, target, looked_up(context, model, line, result));
  }
  const std::string also = " and no route to network " + std::to_string(network->number);
  context.err << (result == Lookup::absent ? absent_text(model, line, also)
                                           : no_line_text(context, model, line, also))
              << "; networks " << (network->gateway.empty() ? "that gateways reach" : "it reaches")
              << ": " << reached_networks(model, network->gateway) << '\n';
  return nullptr;
}

}  // namespace

const Line* find_own_line(Context& context, Model& model, SdoTarget& target) {
  return own_line(context, model, target, find_line(context, model, target.node.line));
}

const Line* find_target(Context& context, Model& model, SdoTarget& target, const std::string& via) {
  if (!via.empty()) {
    return find_via(context, model, target, via);
  }
  const std::string& line = target.node.line;
  if (target.node.own) {
    return find_own_line(context, model, target);
  }
  const Lookup result = look_up(context, model, line, [&] {
    return is_received(model, line) || has_way(context, model, line);
  });
  const std::vector<const Line*> found = ways_to(model, line);
  if (result != Lookup::found || found.empty()) {
    return line_without_way(context, model, target, result);
  }
  if (!target.node.name.empty() || target.node.all) {
    context.err << "the nodes of network " << line << " are not known here: give the node-ID\n";
    return nullptr;
  }
  if (found.size() > 1) {
    context.err << "more than one gateway has a route to network " << line << ": name one, as "
                << printable(found.front()->id.gateway) << '/' << line << '\n';
    return nullptr;
  }
  const RemoteNetwork network = *remote_network(model, line);
  target.network = network.number;
  return found.front();
}

std::optional<SdoTarget> sdo_target(Context& context, const std::string& node,
                                    const std::string& index, const std::string& sub, bool write) {
  const auto ref = parse_node(node);
  if (!ref) {
    context.err << "'" << node << "' is not LINE:NODE, with a node-ID 1..127, a name, own or all\n";
    return std::nullopt;
  }
  const auto address = parse_object(context, index, sub);
  if (!address) {
    return std::nullopt;
  }
  const bool whole = sub.empty() && index.find(':') == std::string::npos;
  return SdoTarget{.node = *ref,
                   .address = *address,
                   .write = write,
                   .timeout = context.timeout,
                   .whole_object = whole};
}

line::Command command_of(const SdoTarget& target) {
  line::Command out{.timeout = target.timeout};
  const std::uint8_t node = target.node.node;
  if (target.network && target.write) {
    out.request = line::NetworkWrite{.network = *target.network,
                                     .node = node,
                                     .address = target.address,
                                     .as_device = target.as_device,
                                     .data = target.data};
  } else if (target.network) {
    out.request = line::NetworkRead{.network = *target.network,
                                    .node = node,
                                    .address = target.address,
                                    .as_device = target.as_device};
  } else if (target.node.own && target.write) {
    out.request = line::LocalWrite{.node = node, .address = target.address, .data = target.data};
  } else if (target.node.own) {
    out.request = line::LocalRead{.node = node, .what = target.address};
  } else if (target.write) {
    out.request = line::SdoWrite{.node = node, .address = target.address, .data = target.data};
  } else {
    out.request = line::SdoRead{.node = node,
                                .address = target.address,
                                .from_image = target.from_image,
                                .from_scan = target.from_scan};
  }
  return out;
}

std::string name_of(const SdoTarget& target) {
  LINEGATE_ASSERT(target.owner != nullptr, "the line of the node was found");
  const auto known = target.owner->nodes.find(target.node.node);
  return known == target.owner->nodes.end() ? "" : printable(known->second.name);
}

std::string node_text(const SdoTarget& target) {
  const std::string name = name_of(target);
  return std::to_string(target.node.node) + (name.empty() ? "" : " (" + name + ')');
}

std::string prefix_of(const SdoTarget& target) {
  return target.node.all ? node_text(target) + ": " : "";
}

std::optional<MeantNodes> meant_nodes(Context& context, Model& model, const SdoTarget& target) {
  if (!target.node.all) {
    return MeantNodes{{target.node.node}, ""};
  }
  const Line& line = *target.owner;
  const bool known = know_nodes(context, model, line);
  MeantNodes out;
  std::size_t configured = 0;
  for (const auto& [id, node] : line.nodes) {
    configured += node.state.configured ? 1 : 0;
    if (node.state.configured || node.state.presence == line::Presence::present) {
      out.nodes.push_back(id);
    }
  }
  if (!known && line.view->state.role != line::Role::observer) {
    out.missing = std::to_string(configured) + " of " +
                  std::to_string(line.view->state.nodes_configured) + " nodes of " +
                  printable(line.id.line) + " were received";
  }
  if (out.nodes.empty()) {
    context.err << (out.missing.empty() ? "no node of " + printable(line.id.line) + " is known"
                                        : out.missing)
                << '\n';
    return std::nullopt;
  }
  return out;
}

void select_node(SdoTarget& target, std::uint8_t node) {
  if (target.node.all) {
    target.node.node = node;
  }
}

}  // namespace linegate::console

// SPDX-License-Identifier: Apache-2.0
// Routes between networks (CiA 302-7), from the properties of LineState (idl/README.md).
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "bridges/console/model.h"
#include "bridges/console/table.h"

namespace linegate::console {

struct KnownRoute {
  std::string gateway;
  std::uint16_t first = 0;  // first network-ID
  std::uint16_t last = 0;
  std::string line;       // the outgoing line
  std::uint8_t next = 0;  // node-ID of the next gateway there; 0 = the network is the line's own
  std::uint16_t cost = 0;
  // The lines of the gateway whose 1F2Ch has the route: a route that is written to 1F2Ch of one
  // line is in no other table.
  std::vector<std::string> known_to;
  bool known_to_all = false;  // that route
};

// The routes that this line publishes; malformed ones are skipped.
std::vector<KnownRoute> routes_of(const LineId& id, const LineView& view);
// The routes of all gateways, each once.
std::vector<KnownRoute> routes_of(const Model& model);

// A counter that a routing line publishes: "open", "timed-out".
std::optional<std::uint64_t> routing_count(const LineView& view, std::string_view name);

// For each gateway (or for `gateway` alone, if not empty) the line that a request to that network
// is sent to: the one with the cheapest route in its table, and of several the outgoing line.
// Gateways without a route have none.
std::vector<const Line*> find_ways(const Model& model, std::uint16_t network,
                                   const std::string& gateway);

Table routes_table(const Model& model);
// Connections and frames of each routing line.
Table routing_table(const Model& model);
// {"routes":[{"gateway":..,"first":..,"last":..,"line":..,"node":..,"cost":..},..],
//  with "known_to":["LINE",..] in a route that not all lines have,
//  "lines":[{"gateway":..,"line":..,"network_id":..,"open":..,..},..]}
std::string routes_json(const Model& model);

}  // namespace linegate::console

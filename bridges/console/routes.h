// SPDX-License-Identifier: Apache-2.0
// Routes between networks (CiA 302-7), as the properties of LineState tell them: idl/README.md.
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
  std::uint16_t first = 0;  // networks
  std::uint16_t last = 0;
  std::string line;       // it is reached over
  std::uint8_t next = 0;  // node-ID of the next gateway there; 0 = the network is the line's own
  std::uint16_t cost = 0;
  // The lines of the gateway whose table it is in: a route that is written to 1F2Ch of one line is
  // in that of no other.
  std::vector<std::string> known_to;
  bool known_to_all = false;  // that route
};

// Those that this line tells of; what cannot be read is left out.
std::vector<KnownRoute> routes_of(const LineId& id, const LineView& view);
// All gateways', each once.
std::vector<KnownRoute> routes_of(const Model& model);

// One of the numbers that a line which routes tells of: "open", "timed-out".
std::optional<std::uint64_t> routing_count(const LineView& view, std::string_view name);

// The line of each gateway (of one, if `gateway` is not empty) that a request to that network is
// sent to: the one whose table has the route of the lowest cost, and of several the one that it
// leads over. Gateways without a route have none.
std::vector<const Line*> find_ways(const Model& model, std::uint16_t network,
                                   const std::string& gateway);

Table routes_table(const Model& model);
// Of each line that routes: connections and frames.
Table routing_table(const Model& model);
// {"routes":[{"gateway":..,"first":..,"last":..,"line":..,"node":..,"cost":..},..],
//  with "known_to":["LINE",..] in a route that not all lines have,
//  "lines":[{"gateway":..,"line":..,"network_id":..,"open":..,..},..]}
std::string routes_json(const Model& model);

}  // namespace linegate::console

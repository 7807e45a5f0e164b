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
};

// Those that this line tells of; what cannot be read is left out.
std::vector<KnownRoute> routes_of(const LineId& id, const LineView& view);
// All gateways', each once: every line of one gateway tells the same.
std::vector<KnownRoute> routes_of(const Model& model);

// One of the numbers that a line which routes tells of: "open", "timed-out".
std::optional<std::uint64_t> routing_count(const LineView& view, std::string_view name);

// The line over which that network is reached at the lowest cost; nullptr if no gateway knows it.
const Line* find_way(const Model& model, std::uint16_t network);

Table routes_table(const Model& model);
// Of each line that routes: connections and frames.
Table routing_table(const Model& model);
// {"routes":[{"gateway":..,"first":..,"last":..,"line":..,"node":..,"cost":..},..],
//  "lines":[{"gateway":..,"line":..,"network_id":..,"open":..,..},..]}
std::string routes_json(const Model& model);

}  // namespace linegate::console

// SPDX-License-Identifier: Apache-2.0
// What subscribers see of routing between networks (CiA 302-7): properties of LineState,
// idl/README.md, and the words for people.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "gateway/config/plant.h"
#include "gateway/publish/values.h"
#include "stack/routing/config.h"

namespace linegate::gateway {

// Names of the lines that route, by their interface.
using InterfaceNames = std::vector<std::pair<std::uint8_t, std::string>>;

// "10..19", "7".
std::string networks_text(std::uint16_t first, std::uint16_t last);
// "10..19 hall:5 10": networks, line and next gateway, cost.
std::string route_text(const routing::Route& route, const InterfaceNames& names);
// "SDO read, EMCY": what a rule lets in.
std::string services_text(const routing::AccessRule& rule);

// routes-1 and following, as many routes in each as there is room for; routes-left-out: how many
// found none.
std::vector<Property> route_properties(std::span<const routing::Route> routes,
                                       const InterfaceNames& names);
// routing-values, if there are any.
void add_forwarding(const routing::Counters& counters, std::vector<Property>& out);
// routing-...; stalls: times that a link to another line was full.
void add_properties(const routing::Counters& counters, std::uint64_t stalls,
                    std::vector<Property>& out);

}  // namespace linegate::gateway

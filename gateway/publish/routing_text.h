// SPDX-License-Identifier: Apache-2.0
// Describes routing between networks (CiA 302-7): properties of LineState (idl/README.md), and
// texts for people.
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

// Names of the lines that route, with their routing interface.
using InterfaceNames = std::vector<std::pair<std::uint8_t, std::string>>;

// "10..19", "7".
std::string networks_text(std::uint16_t first, std::uint16_t last);
// "10..19 hall:5 10": networks, line and next gateway, cost.
std::string route_text(const routing::Route& route, const InterfaceNames& names);
// "SDO read, EMCY": the services that a rule permits.
std::string services_text(const routing::AccessRule& rule);

// routes-1 and following, each with as many routes as fit; routes-left-out: number of omitted
// routes.
std::vector<Property> route_properties(std::span<const routing::Route> routes,
                                       const InterfaceNames& names);
// Appends routing-values, if values are forwarded.
void add_forwarding(const routing::Counters& counters, std::vector<Property>& out);
// Appends sleep, if it is configured.
void add_sleep(const line::LineState& state, std::vector<Property>& out);
// Appends srdos, srdos-valid, srdo-pairs and srdo-faults, if nodes transmit SRDOs.
void add_srdos(const line::SrdoCounters& counters, std::vector<Property>& out);
// Appends routing-...; stalls: how often a link to another line was full.
void add_properties(const routing::Counters& counters, std::uint64_t stalls,
                    std::vector<Property>& out);

}  // namespace linegate::gateway

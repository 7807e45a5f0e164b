// SPDX-License-Identifier: Apache-2.0
// What a configuration changes in the one that runs. A line is known by its name.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "gateway/config/plant.h"
#include "stack/base/diagnostic.h"

namespace linegate::config {

// The part of a configuration that is needed to determine what another one changes.
struct PlantIdentity {
  struct Line {
    std::string name;
    std::string source;
    std::string routes;
  };
  std::string gateway;
  std::uint32_t dds_domain = 0;
  std::string dds_profile;
  std::uint32_t dds_participants = 0;          // in effect
  std::uint32_t dds_profile_participants = 0;  // in effect if the configuration has none
  std::vector<std::string> dds_interfaces;
  std::vector<std::string> dds_peers;
  std::vector<std::string> dds_servers;
  bool dds_multicast = false;
  bool dds_guard = true;
  bool dds_partitions = false;
  std::optional<Journal> journal;
  bool dds_own_process = false;
  std::uint64_t dds_memory = 0;
  std::string dds_security;
  std::string dds_routes_security;
  std::vector<Line> lines;
};
// Limit of other DDS participants if neither the configuration nor the DDS profile has one.
inline constexpr std::uint32_t kUsualDdsParticipants = 100;

// profile_participants: the limit of other participants that is in effect if the configuration
// has none, which the DDS profile may set.
PlantIdentity identity_of(const Plant& plant,
                          std::uint32_t profile_participants = kUsualDdsParticipants);

struct PlanDifference {
  // Names of lines, each in the order of the configuration that has them.
  std::vector<std::string> unchanged;
  std::vector<std::string> changed;
  std::vector<std::string> started;
  std::vector<std::string> stopped;
  // Of the unchanged: lines that get other routes while they run.
  std::vector<std::string> rerouted;
  // What only a new start can change: the gateway is known by it, or has its connections by it.
  std::vector<Diagnostic> refusals;

  bool empty() const {
    return changed.empty() && started.empty() && stopped.empty() && rerouted.empty();
  }
};
PlanDifference difference(const PlantIdentity& running, const Plant& wanted);

// "lines changed: press; started: pack, oven; stopped: none; unchanged: 5", and "; other routes:
// hall" if there are any.
std::string describe(const PlanDifference& difference);

}  // namespace linegate::config

// SPDX-License-Identifier: Apache-2.0
// Observes the host, the network and the domain for `linegate doctor`.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "gateway/doctor/observations.h"

namespace linegate::doctor {

struct Settings {
  std::uint32_t domain = 0;
  std::string profile;                  // file; empty: the installed one
  std::string identity;                 // folder; empty: without DDS-Security
  std::vector<std::string> interfaces;  // of the participant; none: those of the profile
  std::vector<std::string> peers;       // besides those of the profile
  std::vector<std::string> servers;     // discovery servers
  bool multicast = false;               // ask for images by multicast
  std::vector<std::string> hosts;       // to probe, by name or address
  Duration time{};                      // of the observation
};

// Joins the domain as a subscriber of everything that gateways publish, without commands and
// outputs, for that time. Changes nothing at a gateway.
Observations examine(const Settings& settings);

}  // namespace linegate::doctor

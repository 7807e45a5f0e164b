// SPDX-License-Identifier: Apache-2.0
// What a plant.yaml would run, in words or as JSON: `linegate check` and `linegated --check`.
#pragma once

#include <string>

#include "gateway/config/plant.h"

namespace linegate::gateway {

// Findings go to standard error, the description to standard output. Nothing is opened. Gives the
// exit code: kExitOk, or kExitUsage if there are errors. With json, everything (findings included)
// is one JSON object on standard output. The file of DDS profiles is checked as well: dds_profile,
// or the one of the configuration if that is empty.
int check(const std::string& path, bool json, const std::string& dds_profile = {});

// The description alone.
std::string describe(const config::Plant& plant);
std::string to_json(const Loaded<config::Plant>& loaded);

}  // namespace linegate::gateway

// SPDX-License-Identifier: Apache-2.0
// `linegate check` and `linegated --check`: describes the configuration in a plant.yaml, as text or
// as JSON.
#pragma once

#include <string>

#include "gateway/config/plant.h"

namespace linegate::gateway {

// Prints findings on standard error and the description on standard output. With json, everything,
// including findings, is one JSON object on standard output. Opens no interface. Also checks the
// file of DDS profiles: dds_profile, or the one of the configuration if that is empty. Returns the
// exit code: kExitOk, or kExitUsage if there are errors.
int check(const std::string& path, bool json, const std::string& dds_profile = {});

// The description alone.
std::string describe(const config::Plant& plant);
std::string to_json(const Loaded<config::Plant>& loaded);

}  // namespace linegate::gateway

// SPDX-License-Identifier: Apache-2.0
// What a scan makes of the line that it was applied to.
#pragma once

#include "gateway/config/plant.h"
#include "gateway/runtime/scan_taker.h"
#include "stack/base/diagnostic.h"

namespace linegate::gateway {

// The line as it ran, with the nodes that were found; a scan of one node changes that one. Without
// line::kScanSetUp their NodeConfig::as_found is set. A node that was not read to the end stays
// what it was. Nothing if there is nothing to take over: nobody was found, or the folder of EDS
// files cannot be read. Diagnostics have the line's name as file.
Loaded<config::LinePlan> plan_of(const config::LinePlan& present, const TakenScan& scan);

}  // namespace linegate::gateway

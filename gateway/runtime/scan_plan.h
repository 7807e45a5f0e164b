// SPDX-License-Identifier: Apache-2.0
// Makes the configuration of a line from a scan that was applied to it.
#pragma once

#include "gateway/config/plant.h"
#include "gateway/runtime/scan_applier.h"
#include "stack/base/diagnostic.h"

namespace linegate::gateway {

// The present configuration of the line, with the nodes that were found; a scan of one node changes
// only that node. Without line::ScanApply::set_up their NodeConfig::as_found is set. A node that
// was not read completely is unchanged. Returns nothing if no node was found, or the folder of EDS
// files cannot be read. Diagnostics have the line's name as file.
Loaded<config::LinePlan> plan_of(const config::LinePlan& present, const AppliedScan& scan);

}  // namespace linegate::gateway

// SPDX-License-Identifier: Apache-2.0
// linegate config: compares the configuration of devices with plant.yaml, and applies it.
#pragma once

#include <cstddef>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "bridges/console/commands.h"
#include "bridges/console/table.h"
#include "stack/manager/node_report.h"
#include "stack/manager/state.h"

namespace linegate::console {

enum class ConfigAction : std::uint8_t { verify, apply };

// what: a line, or LINE:NODE for one node. Prints the progress on context.err, and the findings at
// the end. Returns kFailed also if a node differs or could not be configured.
int configure(Context& context, ConfigAction action, const std::string& what);

// Writes a concise DCF (CiA 302-3) to the manager. LINE:NODE: it replaces the configuration of that
// node (1F22h). LINE: its values are written to the objects of the line's own node, one after the
// other; the first refusal ends the import and is named.
int import_configuration(Context& context, const std::string& what,
                         std::span<const std::byte> concise_dcf);

// By node-ID: why the boot process that was to configure the node ended early.
using BootFindings = std::map<std::uint8_t, manager::BootFinding>;

// One row for each object that differs. The notes name the nodes that are configured as expected,
// and those that are not, with the reason.
Table configuration_table(const LineId& id, ConfigAction action,
                          const std::vector<manager::NodeReport>& nodes,
                          const BootFindings& findings = {});
std::string configuration_json(const LineId& id, ConfigAction action,
                               const std::vector<manager::NodeReport>& nodes,
                               const BootFindings& findings = {});

}  // namespace linegate::console

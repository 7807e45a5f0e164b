// SPDX-License-Identifier: Apache-2.0
// linegate config: whether devices have the configuration they are to have, and giving it to them.
#pragma once

#include <cstddef>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "bridges/console/commands.h"
#include "bridges/console/table.h"
#include "stack/manager/configuration_report.h"
#include "stack/manager/state.h"

namespace linegate::console {

enum class ConfigAction : std::uint16_t { verify = 0, apply = 1 };  // Command::code

// what: a line, or LINE:NODE for one node alone. Tells on context.err how far it is meanwhile, and
// prints what was found. kFailed also if a node differs or could not be configured.
int configure(Context& context, ConfigAction action, const std::string& what);

// Brings a concise DCF (CiA 302-3) into the manager itself. LINE:NODE: it becomes what that node is
// configured with (1F22h). LINE: its values are written to the objects of the line's own node, one
// after the other; the first that is refused ends it and is named.
int import_configuration(Context& context, const std::string& what,
                         std::span<const std::byte> concise_dcf);

// By node-ID: why its boot process, which was to configure it, ended before it did.
using BootFindings = std::map<std::uint8_t, manager::BootFinding>;

// A row for each object that differs; the notes say which nodes are as they should be, and which
// are not and why.
Table configuration_table(const LineId& id, ConfigAction action,
                          const std::vector<manager::NodeReport>& nodes,
                          const BootFindings& findings = {});
std::string configuration_json(const LineId& id, ConfigAction action,
                               const std::vector<manager::NodeReport>& nodes,
                               const BootFindings& findings = {});

}  // namespace linegate::console

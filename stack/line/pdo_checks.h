// SPDX-License-Identifier: Apache-2.0
// Whether the PDOs of the configured devices go together with the other services of the line: on
// which identifiers these are, and who produces SYNC.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "stack/base/diagnostic.h"
#include "stack/line/config.h"
#include "stack/pdo/link.h"

namespace linegate::line {

// Errors: a PDO on the identifier of SYNC, of TIME if the line sends it, or of an EMCY, of a node
// or the own one; warnings in a line that is what a scan found. Those of the own node are where its
// own_values put 1005h, 1012h and 1014h. remotes are nodes of config.
std::vector<Diagnostic> check_pdos(const LineConfig& config,
                                   std::span<const pdo::RemoteNode> remotes);

// A warning that names the PDOs of a manager's line that wait for SYNC, if nobody in the
// configuration produces it; somebody else on the bus may. file is the line's name.
std::optional<Diagnostic> unsynchronised_pdos(const LineConfig& config);

}  // namespace linegate::line

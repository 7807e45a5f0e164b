// Whether the PDOs of the configured devices go together with the other services of the line: on
// which identifiers these are, and who produces SYNC.
#pragma once

#include <span>
#include <vector>

#include "stack/base/diagnostic.h"
#include "stack/line/config.h"
#include "stack/pdo/link.h"

namespace linegate::line {

// Errors: a PDO on the identifier of SYNC, of TIME if the line sends it, or of an EMCY, of a node
// or the own one; warnings for a node that is taken as it was found. A warning if PDOs of a
// manager's line wait for SYNC that nobody in the configuration produces. remotes are nodes of
// config.
std::vector<Diagnostic> check_pdos(const LineConfig& config,
                                   std::span<const pdo::RemoteNode> remotes);

}  // namespace linegate::line

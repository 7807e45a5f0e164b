// SPDX-License-Identifier: Apache-2.0
// Checks the PDOs of the configured devices against the other services of the line: their
// identifiers, and the SYNC producer; and the pool of SDO connections, and the messages of sleep,
// against all of them.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "stack/base/diagnostic.h"
#include "stack/line/config.h"
#include "stack/pdo/link.h"

namespace linegate::line {

// Errors: a PDO on the identifier of SYNC, of TIME if the line sends it, or of an EMCY, of a node
// or the own node; warnings if the line was made from a scan. The identifiers of the own node are
// those that own_values writes to 1005h, 1012h and 1014h. remotes are nodes of config.
std::vector<Diagnostic> check_pdos(const LineConfig& config,
                                   std::span<const pdo::RemoteNode> remotes);

// Errors: the pool of SDO connections is no range, has a restricted CAN-ID, or one of a service, a
// PDO, or an SDO channel of the configuration.
std::vector<Diagnostic> check_connection_pool(const LineConfig& config,
                                              std::span<const pdo::RemoteNode> remotes);

// Errors: a message of sleep has a CAN-ID of another service, of a PDO, SRDO or SDO channel of the
// configuration, or one of the pool of SDO connections.
std::vector<Diagnostic> check_sleep_identifiers(const LineConfig& config,
                                                std::span<const pdo::RemoteNode> remotes);

// A warning that names the PDOs of a manager's line that wait for SYNC if the configuration has no
// SYNC producer; another device on the bus may produce it. file is the line's name.
std::optional<Diagnostic> unsynchronised_pdos(const LineConfig& config);

}  // namespace linegate::line

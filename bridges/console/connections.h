// SPDX-License-Identifier: Apache-2.0
// SDO connections between two nodes, which the manager of a line assigns (CiA 302-5).
#pragma once

#include <string>
#include <vector>

#include "bridges/console/commands.h"
#include "bridges/console/table.h"
#include "stack/line/replies.h"

namespace linegate::console {

// Without words: prints the connections of the line. {"open", CLIENT, SERVER} assigns one between
// these nodes, {"close", NUMBER} releases one.
int connections(Context& context, const std::string& line, const std::vector<std::string>& words);

Table connections_table(const LineId& id, const line::SdoConnections& connections);
// {"gateway":..,"line":..,"connections":[{"number":..,"client":..,"server":..,"client_record":..,
//  "server_record":..,"request":..,"response":..,"state":..},..]}, with "abort" of a stale one.
std::string connections_json(const LineId& id, const line::SdoConnections& connections);

}  // namespace linegate::console

// SPDX-License-Identifier: Apache-2.0
// Whether all gateways of the domain and all their lines were received. Only then is a line name
// known to be unambiguous.
//
// The rule: every gateway in the domain has published the LineState of each of its lines, and no
// gateway appeared or left for 300 ms. A gateway is in the domain if its participant was
// discovered, or if a received LineState names it (property `other-gateways`). So one received
// gateway is enough to wait for the others, however late they are discovered.
#pragma once

#include <string>
#include <vector>

#include "bridges/console/client.h"
#include "bridges/console/model.h"

namespace linegate::console {

struct Context;

// Describes gateways and lines that were not received: "gateway b", "2 of 3 lines of gateway a".
// Empty: all were received.
std::vector<std::string> missing_lines(const Model& model,
                                       const std::vector<std::string>& gateways);

// Whether the rule above holds and there is at least one line.
bool is_settled(const Context& context, const Model& model);

// Whether all lines that this gateway has were received, and no gateway appeared or left recently:
// a name that is not among them is none of its names, whatever other gateways there are. False for
// gateways that do not publish the number of their lines.
bool has_all_lines(const Context& context, const Model& model, const std::string& gateway);

// What is_settled() still waits for, as a message: "nothing was received of gateway b". Empty if
// nothing.
std::string unsettled_text(const Context& context, const Model& model);

}  // namespace linegate::console

// SPDX-License-Identifier: Apache-2.0
// Whether all gateways of the domain, and all their lines, are received. A name is unambiguous only
// when they are.
//
// The rule: each gateway that is in the domain has sent the LineState of each of its lines, and for
// 300 ms none has come or gone. In the domain are those whose participants are discovered, and
// those that a received LineState names (its property `other-gateways`), so that one gateway that
// is received is enough to wait for the others, however late they are discovered.
#pragma once

#include <string>
#include <vector>

#include "bridges/console/client.h"
#include "bridges/console/model.h"

namespace linegate::console {

struct Context;

// The gateways and lines that are not received, each in words: "gateway b", "2 of 3 lines of
// gateway a". Empty: all are.
std::vector<std::string> missing_lines(const Model& model,
                                       const std::vector<std::string>& gateways);

// By the rule above, and there is a line at all.
bool is_settled(const Context& context, const Model& model);

// What is_settled() waits for, as a message: "nothing was received of gateway b"; empty if nothing.
std::string unsettled_text(const Context& context, const Model& model);

}  // namespace linegate::console

// SPDX-License-Identifier: Apache-2.0
// Text of other hosts, before it goes into the log.
#pragma once

#include <string>
#include <string_view>

namespace linegate::gateway {

// Replaces everything but printable ASCII by '.', so that it cannot end a line of the log or
// control a terminal.
std::string printable(std::string_view text);

}  // namespace linegate::gateway

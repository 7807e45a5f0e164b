// SPDX-License-Identifier: Apache-2.0
// Sanitises text from other hosts for the log.
#pragma once

#include <string>
#include <string_view>

namespace linegate::gateway {

// Replaces all characters except printable ASCII by '.', so that the text cannot end a line of the
// log or control a terminal.
std::string printable(std::string_view text);

}  // namespace linegate::gateway

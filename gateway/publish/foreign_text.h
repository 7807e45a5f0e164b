// SPDX-License-Identifier: Apache-2.0
// Text that strangers chose, before it goes into the log.
#pragma once

#include <string>
#include <string_view>

namespace linegate::gateway {

// Nothing in it can end a line of the log or steer a terminal: what is not printable ASCII is '.'.
std::string printable(std::string_view text);

}  // namespace linegate::gateway

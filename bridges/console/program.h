// SPDX-License-Identifier: Apache-2.0
// linegate program: loads a program into a device (CiA 302-2).
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "bridges/console/commands.h"

namespace linegate::console {

// node: LINE:NODE. number: of the program, 1..255. Prints the progress on context.err.
int load_program(Context& context, const std::string& node, std::uint8_t number,
                 std::vector<std::byte> program);

}  // namespace linegate::console

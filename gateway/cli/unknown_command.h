// SPDX-License-Identifier: Apache-2.0
// A word of a command line that is no command.
#pragma once

#include <string>

namespace CLI {
class App;
}

namespace linegate::gateway {

// After the command line was refused: which word is no command, and the command that is nearest to
// it. Empty if there is no such word.
std::string unknown_command(const CLI::App& app);

}  // namespace linegate::gateway

// SPDX-License-Identifier: Apache-2.0
// Reports an unknown command on a command line.
#pragma once

#include <string>

namespace CLI {
class App;
}

namespace linegate::gateway {

// Call it after the command line was refused: names the word that is not a command, and the most
// similar command. Empty if there is no such word.
std::string unknown_command(const CLI::App& app);

}  // namespace linegate::gateway

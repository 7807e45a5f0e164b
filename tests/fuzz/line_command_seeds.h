// SPDX-License-Identifier: Apache-2.0
// Inputs of the target `line` that ask for every command, in each role and with each of the
// setup's choices: the devices are those of the subject, which answer.
#pragma once

#include <filesystem>

namespace linegate::fuzz {

void save_command_seeds(const std::filesystem::path& folder);

}  // namespace linegate::fuzz

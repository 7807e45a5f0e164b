// SPDX-License-Identifier: Apache-2.0
// Inputs of the target `line` with every command, in each role and with each option of the setup.
// The devices are those of the subject, which answer.
#pragma once

#include <filesystem>

namespace linegate::fuzz {

void save_command_seeds(const std::filesystem::path& folder);

}  // namespace linegate::fuzz

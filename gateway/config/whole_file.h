// SPDX-License-Identifier: Apache-2.0
// Files that are read at once.
#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>

namespace linegate::config {

// Above all that plant.yaml and what it names can be: a program has 16 MB at most.
inline constexpr std::size_t kLargestFile = 64'000'000;

// All of it, or nothing and why: it cannot be opened, is no regular file (a folder, a device, a
// pipe, which may have no end), is larger than that, or an error comes up in the middle. Never
// waits for somebody who writes.
std::optional<std::string> whole_file(const std::filesystem::path& path, std::string& why);
std::optional<std::string> whole_file(const std::filesystem::path& path);

}  // namespace linegate::config

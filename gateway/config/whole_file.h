// SPDX-License-Identifier: Apache-2.0
// Reads a regular file as a whole.
#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>

namespace linegate::config {

// Larger than plant.yaml and every file it names: a program has at most 16 MB.
inline constexpr std::size_t kLargestFile = 64'000'000;

// The content; or nothing, with the reason: the file cannot be opened, is not a regular file (a
// folder, a device, a pipe, which may have no end), is larger than kLargestFile, or a read failed.
// Never blocks on a writer.
std::optional<std::string> whole_file(const std::filesystem::path& path, std::string& why);
std::optional<std::string> whole_file(const std::filesystem::path& path);

}  // namespace linegate::config

// Files that are read at once.
#pragma once

#include <filesystem>
#include <optional>
#include <string>

namespace linegate::config {

// All of it, or nothing: if it cannot be opened, is a folder, or an error comes up in the middle.
std::optional<std::string> whole_file(const std::filesystem::path& path);

}  // namespace linegate::config

// SPDX-License-Identifier: Apache-2.0
// Text that identifies what a line was read from, to detect whether it changed.
#pragma once

#include <string>
#include <string_view>

#include <yaml-cpp/yaml.h>

namespace linegate::config {

// The content of a part of a document, independent of comments, spacing, quotes and order of keys.
std::string canonical(const YAML::Node& node);

// A file: its path and its content.
std::string file_source(std::string_view path, std::string_view content);

}  // namespace linegate::config

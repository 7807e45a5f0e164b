// SPDX-License-Identifier: Apache-2.0
// What a line was read from, so that a line that stayed the same can be told from one that changed.
#pragma once

#include <string>
#include <string_view>

#include <yaml-cpp/yaml.h>

namespace linegate::config {

// The content of a part of a document: the same for two that mean the same, whatever their
// comments, spacing, quotes and order of keys.
std::string canonical(const YAML::Node& node);

// A file by its path and its content.
std::string file_source(std::string_view path, std::string_view content);

}  // namespace linegate::config

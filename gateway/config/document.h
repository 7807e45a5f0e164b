// SPDX-License-Identifier: Apache-2.0
// Loads a YAML document and checks that it is safe to walk. Internal to this folder.
#pragma once

#include <string>

#include "gateway/config/reader.h"

namespace linegate::config {

// Limit for the values of a document with all aliases expanded; a plant of a hundred lines has some
// ten thousand.
inline constexpr std::size_t kMostValues = 2'000'000;

// Parses the only document of the text and expands its merge keys (<<). Returns Null, with an error
// that names the position, if there is a second document, if aliases expand to more than
// kMostValues, or if an alias contains itself. May throw YAML::Exception.
YAML::Node load_document(Findings& findings, const std::string& text);

}  // namespace linegate::config

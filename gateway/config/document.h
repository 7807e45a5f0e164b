// SPDX-License-Identifier: Apache-2.0
// What a YAML document must be before it is walked through. Internal to this folder.
#pragma once

#include <string>

#include "gateway/config/reader.h"

namespace linegate::config {

// The values of a document with all aliases written out; a plant of a hundred lines has some ten
// thousand.
inline constexpr std::size_t kMostValues = 2'000'000;

// The one document of the text. Null, with an error that names its place, if there is a second
// document, if aliases stand for more than kMostValues, or one for something that it is a part of.
// Merge keys (<<) are replaced by what they stand for.
// May throw YAML::Exception.
YAML::Node load_document(Findings& findings, const std::string& text);

}  // namespace linegate::config

// SPDX-License-Identifier: Apache-2.0
#include "bridges/console/filter.h"

#include <sstream>

#include "bridges/console/lookup.h"

namespace linegate::console {

std::optional<Filter> parse_filter(const std::string& text) {
  Filter out;
  std::istringstream words(text);
  for (std::string word; words >> word;) {
    if (word.starts_with("line=")) {
      out.line = word.substr(5);
    } else if (word.starts_with("node=")) {
      const auto node = parse_number(word.substr(5), 127, false);
      if (!node || *node == 0) {
        return std::nullopt;
      }
      out.node = static_cast<std::uint8_t>(*node);
    } else {
      out.words.push_back(word);
    }
  }
  return out;
}

std::string text_of(const Filter& filter) {
  std::string out = filter.line.empty() ? "" : "line=" + filter.line;
  const auto add = [&out](const std::string& word) { out += (out.empty() ? "" : " ") + word; };
  if (filter.node != 0) {
    add("node=" + std::to_string(filter.node));
  }
  for (const std::string& word : filter.words) {
    add(word);
  }
  return out;
}

}  // namespace linegate::console

// SPDX-License-Identifier: Apache-2.0
#include <set>
#include <utility>

#include "stack/image/layout.h"

namespace linegate::image {

void make_names_unique(Layout& layout) {
  std::set<std::string> seen;
  for (Entry& entry : layout.entries) {
    std::string name = entry.name;
    if (seen.contains(name) && entry.remote_pdo != 0) {
      name += " in PDO " + std::to_string(entry.remote_pdo);
    }
    const std::string base = name;
    for (unsigned number = 2; !seen.insert(name).second; ++number) {
      name = base + " #" + std::to_string(number);
    }
    entry.name = std::move(name);
  }
}

}  // namespace linegate::image

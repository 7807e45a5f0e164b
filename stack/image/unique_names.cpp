// SPDX-License-Identifier: Apache-2.0
#include <map>
#include <set>
#include <string>
#include <utility>

#include "stack/base/short_text.h"
#include "stack/image/layout.h"
#include "stack/image/limits.h"

namespace linegate::image {
namespace {

// The suffix remains whole, because it makes the difference.
std::string with_suffix(const std::string& name, const std::string& suffix) {
  return short_text(name, kLongestEntryName - suffix.size()) + suffix;
}

}  // namespace

std::string pdo_text(std::uint16_t remote_pdo) {
  return is_srdo(remote_pdo) ? "SRDO " + std::to_string(remote_pdo - kFirstSrdo + 1)
                             : "PDO " + std::to_string(remote_pdo);
}

std::string pdo_cell(std::uint16_t remote_pdo) {
  return is_srdo(remote_pdo) ? "SRDO" + std::to_string(remote_pdo - kFirstSrdo + 1)
                             : std::to_string(remote_pdo);
}

void make_names_unique(Layout& layout) {
  std::set<std::string> seen;
  // By name and suffix: the first number that may be free
  std::map<std::pair<std::string, std::string>, unsigned> numbers;
  for (Entry& entry : layout.entries) {
    std::string name = with_suffix(entry.name, {});
    std::string suffix;
    if (seen.contains(name) && entry.remote_pdo != 0) {
      suffix = " in " + pdo_text(entry.remote_pdo);
      name = with_suffix(entry.name, suffix);
    }
    if (!seen.insert(name).second) {
      unsigned& number = numbers.try_emplace({entry.name, suffix}, 2).first->second;
      do {
        name = with_suffix(entry.name, suffix + " #" + std::to_string(number++));
      } while (!seen.insert(name).second);
    }
    entry.name = std::move(name);
  }
}

}  // namespace linegate::image

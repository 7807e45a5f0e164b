// SPDX-License-Identifier: Apache-2.0
#include "bridges/console/output_groups.h"

#include <algorithm>
#include <sstream>

#include "bridges/console/lookup.h"

namespace linegate::console {
namespace {

// Whether "6..9", or "12", contains the number.
bool is_in_run(const std::string& run, std::uint32_t entry) {
  constexpr std::uint64_t kMost = 0xFFFF'FFFF;
  const std::size_t dots = run.find("..");
  const auto first = parse_number(run.substr(0, dots), kMost, false);
  const auto last =
      dots == std::string::npos ? first : parse_number(run.substr(dots + 2), kMost, false);
  return first && last && *first <= entry && entry <= *last;
}

}  // namespace

EntryGroup group_of_entry(const LineView& line, std::uint32_t entry) {
  const auto property = std::ranges::find_if(
      line.properties, [](const auto& one) { return one.first == "output-groups"; });
  if (property == line.properties.end()) {
    return {};
  }
  EntryGroup out{.found = EntryGroup::Found::none};
  std::istringstream in(property->second);
  for (std::string number; in >> number;) {
    std::string run;
    if (number.starts_with('+')) {
      out.found = EntryGroup::Found::left_out;
    } else if (std::getline(in >> std::ws, run, ',') && is_in_run(run, entry)) {
      const auto group = parse_number(number, 0xFFFF, false);
      return group ? EntryGroup{.number = static_cast<std::uint16_t>(*group)} : out;
    }
  }
  return out;
}

}  // namespace linegate::console

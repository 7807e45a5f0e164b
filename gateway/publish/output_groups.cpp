// SPDX-License-Identifier: Apache-2.0
#include "gateway/publish/output_groups.h"

#include <algorithm>
#include <cstddef>
#include <string>

namespace linegate::gateway {
namespace {

constexpr std::size_t kLongestValue = 240;  // bytes; a property value has up to 256

std::vector<std::string> runs_of(const line::OutputGroup& group) {
  std::vector<std::uint32_t> entries = group.entries;
  std::ranges::sort(entries);
  std::vector<std::string> out;
  for (std::size_t i = 0; i < entries.size();) {
    std::size_t last = i;
    while (last + 1 < entries.size() && entries[last + 1] == entries[last] + 1) {
      ++last;
    }
    out.push_back(std::to_string(group.number) + ' ' + std::to_string(entries[i]) +
                  (last == i ? "" : ".." + std::to_string(entries[last])));
    i = last + 1;
  }
  return out;
}

}  // namespace

std::vector<Property> output_group_properties(std::span<const line::OutputGroup> groups) {
  std::string text;
  std::size_t left_out = 0;
  for (const line::OutputGroup& group : groups) {
    for (const std::string& run : runs_of(group)) {
      if (left_out > 0 || text.size() + run.size() > kLongestValue) {
        ++left_out;
      } else {
        text += (text.empty() ? "" : ", ") + run;
      }
    }
  }
  if (left_out > 0) {
    text += ", +" + std::to_string(left_out);
  }
  return groups.empty() ? std::vector<Property>() : std::vector<Property>{{"output-groups", text}};
}

}  // namespace linegate::gateway

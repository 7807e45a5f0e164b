// SPDX-License-Identifier: Apache-2.0
#include "bridges/dds/security.h"

#include <algorithm>

namespace linegate::dds {
namespace {

// Of fnmatch(), which Fast DDS compares partitions with.
constexpr std::string_view kWildcards = "*?[]\\";

ClientRight right_named(std::string_view name) {
  if (name == "operator")
    return ClientRight::operate;
  return name == "engineer" ? ClientRight::engineer : ClientRight::none;
}

}  // namespace

std::string request_partition(std::string_view gateway, std::string_view line,
                              std::string_view right) {
  std::string out(gateway);
  for (const std::string_view part : {line, right})
    out.append("/").append(part);
  return out;
}

std::string reply_partition(std::string_view gateway, std::string_view right) {
  return request_partition(gateway, "", right);
}

std::string replies_to(std::string_view right) {
  return request_partition("*", "*", right);
}

std::optional<Claim> claim_of(const std::vector<std::string>& partitions, std::string_view gateway,
                              std::string_view line) {
  const bool has_wildcard = std::ranges::any_of(partitions, [](const std::string& partition) {
    return partition.find_first_of(kWildcards) != std::string::npos;
  });
  if (has_wildcard)
    return std::nullopt;
  const std::string begin = request_partition(gateway, line, "");
  for (const std::string_view partition : partitions) {
    if (!partition.starts_with(begin))
      continue;
    const std::string_view rest = partition.substr(begin.size());
    const std::size_t slash = rest.find('/');
    if (slash == std::string_view::npos)
      continue;
    const std::string_view name = rest.substr(slash + 1);
    const ClientRight right = right_named(rest.substr(0, slash));
    if (right != ClientRight::none && !name.empty() && name.find('/') == std::string_view::npos)
      return Claim{right, std::string(name)};
  }
  return std::nullopt;
}

}  // namespace linegate::dds

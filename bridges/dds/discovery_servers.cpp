// SPDX-License-Identifier: Apache-2.0
#include "bridges/dds/discovery_servers.h"

#include <charconv>
#include <limits>

namespace linegate::dds {
namespace {

template <class T>
std::optional<T> whole_number(std::string_view text, T least) {
  T out{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), out);
  const bool whole = error == std::errc{} && end == text.data() + text.size();
  return whole && out >= least ? std::optional(out) : std::nullopt;
}

}  // namespace

std::optional<DiscoveryServer> parse_discovery_server(std::string_view text, std::size_t position) {
  DiscoveryServer out;
  std::optional<std::uint8_t> id;
  if (const auto at = text.find('@'); at != text.npos) {
    id = whole_number<std::uint8_t>(text.substr(0, at), 0);
    text.remove_prefix(at + 1);
  } else if (position <= std::numeric_limits<std::uint8_t>::max()) {
    id = static_cast<std::uint8_t>(position);
  }
  std::optional<std::uint16_t> port = out.port;
  if (const auto colon = text.find(':'); colon != text.npos) {
    port = whole_number<std::uint16_t>(text.substr(colon + 1), 1);
    text = text.substr(0, colon);
  }
  if (!id || !port || text.empty())
    return std::nullopt;
  out.id = *id;
  out.host = text;
  out.port = *port;
  return out;
}

}  // namespace linegate::dds

// SPDX-License-Identifier: Apache-2.0
#include "gateway/publish/gateway_news.h"

#include <string_view>

namespace linegate::gateway {
namespace {

// FNV-1a. Includes the end of each text, so that "a", "b" differs from "ab", "".
void add_to_hash(std::uint64_t& hash, std::string_view text) {
  const auto add = [&hash](unsigned char octet) { hash = (hash ^ octet) * 0x100'0000'01B3; };
  for (const char c : text) {
    add(static_cast<unsigned char>(c));
  }
  add(0);
}

}  // namespace

std::uint64_t configuration_hash(const config::PlantIdentity& identity) {
  std::uint64_t hash = 0xCBF2'9CE4'8422'2325;
  add_to_hash(hash, identity.gateway);
  add_to_hash(hash, std::to_string(identity.dds_domain));
  add_to_hash(hash, identity.dds_profile);
  add_to_hash(hash, identity.dds_security);
  add_to_hash(hash, identity.dds_routes_security);
  for (const auto& line : identity.lines) {
    add_to_hash(hash, line.name);
    add_to_hash(hash, line.source);
    add_to_hash(hash, line.routes);
  }
  return hash;
}

}  // namespace linegate::gateway

// SPDX-License-Identifier: Apache-2.0
// The gateways in a domain, by the names of their participants: "linegate NAME" is a gateway,
// "linegate client NAME" a client (the name of a gateway contains no space).
#pragma once

#include <algorithm>
#include <cstddef>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "stack/base/time.h"

namespace linegate::dds {

// The gateway name in the name of a participant; nothing if it is not a gateway.
inline std::optional<std::string_view> gateway_of(std::string_view participant) {
  constexpr std::string_view kPrefix = "linegate ";
  if (!participant.starts_with(kPrefix) || participant.size() == kPrefix.size()) {
    return std::nullopt;
  }
  const std::string_view name = participant.substr(kPrefix.size());
  return name.find_first_of(" /,") == std::string_view::npos ? std::optional(name) : std::nullopt;
}

template <class Key>
class PeerGateways {
 public:
  // Bounded, because any participant may have such a name
  static constexpr std::size_t kMost = 1024;

  explicit PeerGateways(Instant begin) : changed_(begin) {}

  // A participant was discovered, or its name changed.
  void come(const Key& key, std::string_view participant, Instant now) {
    const auto name = gateway_of(participant);
    if (name && peers_.size() < kMost && peers_.try_emplace(key, *name).second) {
      changed_ = now;
    }
  }
  void go(const Key& key, Instant now) {
    if (peers_.erase(key) != 0) {
      changed_ = now;
    }
  }

  // Sorted, without duplicates.
  std::vector<std::string> names() const {
    std::vector<std::string> out;
    for (const auto& [key, name] : peers_) {
      out.push_back(name);
    }
    std::ranges::sort(out);
    const auto first = std::unique(out.begin(), out.end());
    out.erase(first, out.end());
    return out;
  }
  // When a gateway was last discovered or lost; the start of the observation if never.
  Instant changed() const { return changed_; }

 private:
  std::map<Key, std::string> peers_;
  Instant changed_;
};

}  // namespace linegate::dds

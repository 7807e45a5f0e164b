// SPDX-License-Identifier: Apache-2.0
// With DDS-Security: whether a participant has the certificate of the gateway that its sample
// names. The permissions of a gateway do not limit the names in its samples.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <utility>

#include "bridges/dds/security.h"

namespace linegate::dds {

class GatewayHolders {
 public:
  using Prefix = std::array<std::uint8_t, 12>;  // of the GUID of a participant

  // is_holder: Security::is_holder; without a function each participant counts as each gateway.
  explicit GatewayHolders(decltype(Security::is_holder) is_holder)
      : is_holder_(std::move(is_holder)) {}

  bool has(const Prefix& participant, const std::string& gateway) {
    if (!is_holder_)
      return true;
    const std::pair key{participant, gateway};
    const auto known = known_.find(key);
    if (known != known_.end())
      return known->second;
    if (known_.size() >= kMost)
      known_.clear();
    return known_[key] = is_holder_(participant, "gateway", gateway);
  }

 private:
  static constexpr std::size_t kMost = 1'024;  // any host may publish any names

  const decltype(Security::is_holder) is_holder_;
  std::map<std::pair<Prefix, std::string>, bool> known_;
};

}  // namespace linegate::dds

// SPDX-License-Identifier: Apache-2.0
#include "bridges/dds/address_change.h"

namespace linegate::dds {

void AddressChange::started(Instant now) {
  watch_.created();
  starts_ = true;
  not_before_ = now + kPause;
}

std::string AddressChange::due(Instant now) {
  if (now < not_before_) {
    if (starts_)
      watch_.narrow();
    else
      watch_.look();
    return {};
  }
  starts_ = false;
  if (now < look_at_)
    return {};
  look_at_ = now + kLook;
  const std::string added = watch_.added();
  const std::size_t space = added.find(' ');
  return added.empty() ? added
                       : "network interface " + added.substr(0, space) + " has the address " +
                             added.substr(space + 1) + " now";
}

void AddressChange::ends(Instant now) {
  starts_ = false;
  not_before_ = now + kPause;
}

}  // namespace linegate::dds

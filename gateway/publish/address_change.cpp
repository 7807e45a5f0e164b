// SPDX-License-Identifier: Apache-2.0
#include "gateway/publish/address_change.h"

#include <algorithm>
#include <utility>

namespace linegate::gateway {

AddressChange::AddressChange(std::vector<std::string> interfaces,
                             std::function<Addresses()> addresses)
    : interfaces_(std::move(interfaces)), addresses_(std::move(addresses)), used_(look()) {
}

AddressChange::Addresses AddressChange::look() const {
  Addresses all = addresses_();
  if (!interfaces_.empty()) {
    std::erase_if(all, [&](const std::string& one) {
      const std::size_t space = one.find(' ');
      return std::ranges::none_of(interfaces_, [&](const std::string& wanted) {
        return one.substr(0, space) == wanted || one.substr(space + 1) == wanted;
      });
    });
  }
  return all;
}

// An address that went and came back is not new: the participant still has it.
std::string AddressChange::due(Instant now) {
  if (now < look_at_ || now < not_before_) {
    return {};
  }
  look_at_ = now + kLook;
  const Addresses present = look();
  const auto added =
      std::ranges::find_if(present, [&](const std::string& one) { return !used_.contains(one); });
  if (added == present.end()) {
    return {};
  }
  const std::size_t space = added->find(' ');
  return "network interface " + added->substr(0, space) + " has the address " +
         added->substr(space + 1) + " now";
}

void AddressChange::done(Instant now) {
  used_ = look();
  not_before_ = now + kPause;
}

}  // namespace linegate::gateway

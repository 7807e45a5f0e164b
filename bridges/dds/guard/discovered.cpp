#include "bridges/dds/guard/discovered.h"

#include <algorithm>

namespace linegate::dds::guard {

void Discovered::participant_found(const Prefix& prefix) {
  const std::lock_guard lock(mutex_);
  participants_.try_emplace(prefix);
}

void Discovered::participant_lost(const Prefix& prefix) {
  const std::lock_guard lock(mutex_);
  participants_.erase(prefix);
  std::erase_if(endpoints_, [&](const Guid& guid) { return prefix_of(guid) == prefix; });
}

void Discovered::endpoint_found(const Guid& endpoint) {
  const std::lock_guard lock(mutex_);
  const auto owner = participants_.find(prefix_of(endpoint));
  if (endpoints_.insert(endpoint).second && owner != participants_.end())
    ++owner->second.endpoints;
}

void Discovered::endpoint_lost(const Guid& endpoint) {
  const std::lock_guard lock(mutex_);
  const auto owner = participants_.find(prefix_of(endpoint));
  if (endpoints_.erase(endpoint) != 0 && owner != participants_.end() &&
      owner->second.endpoints != 0)
    --owner->second.endpoints;
}

bool Discovered::has_participant(const Prefix& prefix) const {
  const std::lock_guard lock(mutex_);
  return participants_.contains(prefix);
}

bool Discovered::has_endpoint(const Guid& endpoint) const {
  const std::lock_guard lock(mutex_);
  return endpoints_.contains(endpoint);
}

std::size_t Discovered::endpoints() const {
  const std::lock_guard lock(mutex_);
  return endpoints_.size();
}

bool Discovered::admits(const Prefix& prefix, const Address& from, std::uint32_t lease) const {
  const std::size_t most = limits_.participants;
  const std::size_t reserved = limits_.peers.empty() ? 0 : most - most / 4 * 3;
  const std::lock_guard lock(mutex_);
  const std::size_t taken = participants_.size();
  if (participants_.contains(prefix) ||
      std::find(limits_.peers.begin(), limits_.peers.end(), from) != limits_.peers.end())
    return true;
  return taken < most - reserved && (taken < most / 2 || lease <= kLongestLease);
}

bool Discovered::admits(const Prefix& prefix, const Guid& endpoint, std::int64_t now) {
  const std::lock_guard lock(mutex_);
  const auto owner = participants_.find(prefix);
  // The library ignores endpoints of participants that it has not found.
  if (owner == participants_.end() || endpoints_.contains(endpoint))
    return true;
  Participant& it = owner->second;
  const std::int64_t spent = std::max(it.spent, now - kSaved * kInterval) + kInterval;
  if (it.endpoints >= kEndpoints || spent > now)
    return false;
  it.spent = spent;
  return true;
}

}  // namespace linegate::dds::guard

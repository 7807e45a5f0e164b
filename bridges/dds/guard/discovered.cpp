// SPDX-License-Identifier: Apache-2.0
#include "bridges/dds/guard/discovered.h"

#include <algorithm>
#include <random>

namespace linegate::dds::guard {
namespace {

// Takes one of at most `saved` tokens, which are replenished at one per interval. Returns false if
// there is none. Times in nanoseconds.
bool spend(std::int64_t& spent, std::int64_t now, std::int64_t saved, std::int64_t interval) {
  const std::int64_t then = std::max(spent, now - saved * interval) + interval;
  if (then > now)
    return false;
  spent = then;
  return true;
}

}  // namespace

Discovered::Discovered(DiscoveryLimits limits)
    : limits_(std::move(limits)), key_(std::uint64_t{std::random_device{}()} << 32U | 1U) {
  arrivals_.fill(kNever);
}

void Discovered::participant_found(const Prefix& prefix, bool endless) {
  const std::lock_guard lock(mutex_);
  participants_.try_emplace(prefix, Participant{.endless = endless});
  std::replace(awaited_.begin(), awaited_.end(), prefix, Prefix{});
}

void Discovered::participant_lost(const Prefix& prefix) {
  const std::lock_guard lock(mutex_);
  participants_.erase(prefix);
  std::erase_if(endpoints_, [&](const auto& each) { return prefix_of(each.first) == prefix; });
}

void Discovered::endpoint_found(const Guid& endpoint) {
  const std::lock_guard lock(mutex_);
  const auto owner = participants_.find(prefix_of(endpoint));
  if (endpoints_.try_emplace(endpoint, false).second && owner != participants_.end())
    ++owner->second.endpoints;
}

void Discovered::endpoint_lost(const Guid& endpoint) {
  const std::lock_guard lock(mutex_);
  const auto known = endpoints_.find(endpoint);
  if (known == endpoints_.end())
    return;
  const bool counted = !known->second;
  endpoints_.erase(known);
  const auto owner = participants_.find(prefix_of(endpoint));
  if (counted && owner != participants_.end() && owner->second.endpoints != 0)
    --owner->second.endpoints;
}

void Discovered::ends(const Guid& endpoint) {
  const std::lock_guard lock(mutex_);
  const auto known = endpoints_.find(endpoint);
  const auto owner = participants_.find(prefix_of(endpoint));
  if (known == endpoints_.end() || known->second || owner == participants_.end() ||
      owner->second.endpoints == 0)
    return;
  known->second = true;
  --owner->second.endpoints;
}

bool Discovered::is_server(const Prefix& prefix) const {
  const auto& servers = limits_.servers;
  return std::find(servers.begin(), servers.end(), prefix) != servers.end();
}

bool Discovered::has_participant(const Prefix& prefix) const {
  const std::lock_guard lock(mutex_);
  return participants_.contains(prefix);
}

bool Discovered::is_endless(const Prefix& prefix) const {
  const std::lock_guard lock(mutex_);
  const auto found = participants_.find(prefix);
  return found != participants_.end() && found->second.endless;
}

bool Discovered::has_endpoint(const Guid& endpoint) const {
  const std::lock_guard lock(mutex_);
  return endpoints_.contains(endpoint);
}

std::size_t Discovered::endpoints() const {
  const std::lock_guard lock(mutex_);
  return endpoints_.size();
}

std::int64_t& Discovered::arrivals_from(const Address& address) {
  std::uint64_t hash = key_;
  for (const std::uint8_t octet : address)
    hash = (hash ^ octet) * 0x100000001B3U;  // FNV-1a
  return arrivals_[(hash ^ hash >> 32U) % arrivals_.size()];
}

bool Discovered::arrives(const Prefix& prefix, const Address& from, std::int64_t now) {
  const bool awaited = std::find(awaited_.begin(), awaited_.end(), prefix) != awaited_.end();
  if (awaited && prefix != Prefix{})
    return true;
  if (!spend(arrivals_from(from), now, kArrivals, kArrivalInterval))
    return false;
  awaited_[next_awaited_++ % awaited_.size()] = prefix;
  return true;
}

bool Discovered::admits(const Prefix& prefix, const Prefix& by, const Address& from,
                        std::uint32_t lease, std::int64_t now) {
  const bool endless = lease == kEndless;
  if (lease > kLongestLease && !endless)
    return false;
  const std::size_t most = limits_.participants;
  const std::size_t reserved = limits_.peers.empty() || most < 4 ? 0 : most / 4 + (most % 4 != 0);
  const std::lock_guard lock(mutex_);
  const auto known = participants_.find(prefix);
  if (known != participants_.end())
    return known->second.endless == endless;
  // What a server announces of others comes from its address, too.
  const bool is_peer = prefix == by && std::find(limits_.peers.begin(), limits_.peers.end(),
                                                 from) != limits_.peers.end();
  if (is_peer || is_server(prefix))
    return true;
  const std::size_t taken = participants_.size();
  return taken < most - reserved && (taken < most / 2 || !endless) && arrives(prefix, from, now);
}

bool Discovered::admits(const Prefix& prefix, const Guid& endpoint, std::int64_t now) {
  const std::lock_guard lock(mutex_);
  const auto owner = participants_.find(prefix);
  // The library ignores endpoints of participants that it has not found.
  if (owner == participants_.end() || endpoints_.contains(endpoint))
    return true;
  Participant& it = owner->second;
  return it.endpoints < kEndpoints && spend(it.spent, now, kSaved, kInterval);
}

}  // namespace linegate::dds::guard

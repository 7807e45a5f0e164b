// SPDX-License-Identifier: Apache-2.0
// Participants that this process can no longer send to, because their TCP connection was lost.
//
// When a participant connects again, Fast DDS 2.9.1 goes on sending to it on the accepted
// connection over which it discovered the participant, which is lost; only a new discovery takes
// the new connection (TCPTransportInterface::OpenOutputChannel). What the participant sends on the
// new one renews its lease, so there was none: it received nothing for ever. So the guard drops
// what it sends until its lease expires. An infinite lease never does: what such a participant
// sends passes, also its end, which frees its place.
#pragma once

#include <cstdint>
#include <map>
#include <mutex>

#include "bridges/dds/guard/wire.h"

namespace linegate::dds::guard {

// All functions may be called from any thread.
class LostPeers {
 public:
  using Connection = std::uint64_t;  // an accepted TCP connection; 0: none

  // Whether a datagram of that participant may be passed on. known: whether it is discovered.
  template <class HasEnded>
  bool may_pass(const Prefix& sender, bool known, HasEnded has_ended) const {
    const std::lock_guard lock(mutex_);
    const auto it = found_.find(sender);
    return !known || it == found_.end() || !has_ended(it->second);
  }

  // The library discovered the participant by a datagram that was received on that connection.
  // endless: its lease is infinite. known(const Prefix&): whether a participant is still
  // discovered.
  template <class Known>
  void found(const Prefix& sender, Connection on, bool endless, Known known) {
    const std::lock_guard lock(mutex_);
    std::erase_if(found_, [&](const auto& each) { return !known(each.first); });
    found_.erase(sender);
    if (on != 0 && !endless)
      found_.emplace(sender, on);
  }

 private:
  mutable std::mutex mutex_;
  std::map<Prefix, Connection> found_;  // participants, by the connection that is sent on
};

}  // namespace linegate::dds::guard

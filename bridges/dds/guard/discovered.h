// SPDX-License-Identifier: Apache-2.0
// What discovery found, and how much more of it is let in. A participant that announces endpoints
// by the thousand costs 8 kB and a match for each of them. Participants that come and go by the
// thousand occupy a core, and the library keeps about 100 octets of each for ever.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <map>
#include <mutex>
#include <utility>
#include <vector>

#include "bridges/dds/guard/wire.h"

namespace linegate::dds::guard {

using Address = std::array<std::uint8_t, 16>;  // of a locator, RTPS 2.3 9.3.2

struct DiscoveryLimits {
  // Others that the library takes note of at the same time.
  std::size_t participants = std::numeric_limits<std::size_t>::max();
  std::vector<Address> peers;  // configured ones; for them a quarter of the places is left
  // Protocol SIMPLE: each participant announces itself, and its end is left to its lease.
  bool simple = true;
};

// From any thread.
class Discovered {
 public:
  static constexpr std::uint32_t kLongestLease = 3600;   // s
  static constexpr std::uint32_t kEndless = 0x7FFFFFFF;  // s, RTPS 2.3 9.3.2.3: infinite
  static constexpr std::size_t kEndpoints = 1024;        // of one participant
  static constexpr std::int64_t kSaved = 1024;           // announcements of new ones at once
  static constexpr std::int64_t kInterval = 20'000'000;  // ns until one more may be announced
  static constexpr std::int64_t kArrivals = 128;         // new participants of one address at once
  static constexpr std::int64_t kArrivalInterval = 100'000'000;  // ns until one more may come

  explicit Discovered(DiscoveryLimits limits);

  void participant_found(const Prefix& prefix, bool endless);  // its lease
  void participant_lost(const Prefix& prefix);
  void endpoint_found(const Guid& endpoint);
  void endpoint_lost(const Guid& endpoint);

  bool simple() const { return limits_.simple; }
  // Whether no timer of a lease may fire while its end is carried out.
  bool is_endless(const Prefix& prefix) const;
  bool has_participant(const Prefix& prefix) const;
  bool has_endpoint(const Guid& endpoint) const;
  std::size_t endpoints() const;

  // Whether a participant that is announced from there with that lease, s, may take a place; counts
  // it if it is new. Those that are never gone would keep the places from others.
  bool admits(const Prefix& prefix, const Address& from, std::uint32_t lease, std::int64_t now);
  // Whether that participant may announce that endpoint; counts it if it is new.
  bool admits(const Prefix& prefix, const Guid& endpoint, std::int64_t now);
  // Its participant announced its end. That gives the place back at once: the library takes samples
  // of discovery in their order, so that it may wait for an announcement that found no place.
  void ends(const Guid& endpoint);

 private:
  static constexpr std::int64_t kNever = std::numeric_limits<std::int64_t>::min();

  struct Participant {
    bool endless = false;
    std::size_t endpoints = 0;    // whose end was not announced
    std::int64_t spent = kNever;  // all that was saved, since then
  };

  std::int64_t& arrivals_from(const Address& address);
  bool arrives(const Prefix& prefix, const Address& from, std::int64_t now);

  const DiscoveryLimits limits_;
  mutable std::mutex mutex_;
  std::map<Prefix, Participant> participants_;
  std::map<Guid, bool> endpoints_;  // true: its end was announced
  // When all was spent that an address had saved. Addresses can be invented: they share 64 places,
  // by a hash that no sender knows.
  std::array<std::int64_t, 64> arrivals_{};
  const std::uint64_t key_;
  // Counted as new, and not found yet: this participant, too, which receives what it announces, is
  // never found. They do not count again.
  std::array<Prefix, 64> awaited_{};
  std::size_t next_awaited_ = 0;
};

}  // namespace linegate::dds::guard

// What discovery found, and how much more of it is let in. A participant that announces endpoints
// by the thousand costs 8 kB and a match for each of them.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <map>
#include <mutex>
#include <set>
#include <utility>
#include <vector>

#include "bridges/dds/guard/wire.h"

namespace linegate::dds::guard {

using Address = std::array<std::uint8_t, 16>;  // of a locator, RTPS 2.3 9.3.2

struct DiscoveryLimits {
  // Others that the library takes note of at the same time.
  std::size_t participants = std::numeric_limits<std::size_t>::max();
  std::vector<Address> peers;  // configured ones; for them a quarter of the places is left
  bool ends_by_lease = true;   // the announced end of a participant is not passed on
};

// From any thread.
class Discovered {
 public:
  static constexpr std::uint32_t kLongestLease = 3600;   // s, where half of the places are taken
  static constexpr std::size_t kEndpoints = 1024;        // of one participant
  static constexpr std::int64_t kSaved = 1024;           // announcements of new ones at once
  static constexpr std::int64_t kInterval = 20'000'000;  // ns until one more may be announced

  explicit Discovered(DiscoveryLimits limits) : limits_(std::move(limits)) {}

  void participant_found(const Prefix& prefix);
  void participant_lost(const Prefix& prefix);
  void endpoint_found(const Guid& endpoint);
  void endpoint_lost(const Guid& endpoint);

  bool ends_by_lease() const { return limits_.ends_by_lease; }
  bool has_participant(const Prefix& prefix) const;
  bool has_endpoint(const Guid& endpoint) const;
  std::size_t endpoints() const;

  // Whether a participant that is announced from there with that lease, s, may take a place. One
  // that is never gone would keep it from others.
  bool admits(const Prefix& prefix, const Address& from, std::uint32_t lease) const;
  // Whether that participant may announce that endpoint; counts it if it is new.
  bool admits(const Prefix& prefix, const Guid& endpoint, std::int64_t now);

 private:
  struct Participant {
    std::size_t endpoints = 0;
    std::int64_t spent =
        std::numeric_limits<std::int64_t>::min();  // all that was saved, since then
  };

  const DiscoveryLimits limits_;
  mutable std::mutex mutex_;
  std::map<Prefix, Participant> participants_;
  std::set<Guid> endpoints_;
};

}  // namespace linegate::dds::guard

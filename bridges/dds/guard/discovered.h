// SPDX-License-Identifier: Apache-2.0
// Records discovered participants and endpoints, and limits how many more are accepted. A
// participant that announces thousands of endpoints costs 8 kB and a match for each of them.
// Participants that come and go by the thousand occupy a core, and the library keeps about 100
// octets of each forever.
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
  // Number of other participants that the library accepts at the same time.
  std::size_t participants = std::numeric_limits<std::size_t>::max();
  // Configured initial peers; a quarter of the places is reserved for them.
  std::vector<Address> peers;
  // Discovery servers, which announce other participants and their endpoints. They always have a
  // place; those that they announce have one like others.
  std::vector<Prefix> servers;
  // Discovery protocol SIMPLE: each participant announces itself, and it is removed when its lease
  // expires, not when it announces its end.
  bool simple = true;
};

// All functions may be called from any thread.
class Discovered {
 public:
  static constexpr std::uint32_t kLongestLease = 3600;   // s
  static constexpr std::uint32_t kEndless = 0x7FFFFFFF;  // s, RTPS 2.3 9.3.2.3: infinite
  static constexpr std::size_t kEndpoints = 1024;        // of one participant
  // Largest burst of announcements of new endpoints, per participant
  static constexpr std::int64_t kSaved = 1024;
  static constexpr std::int64_t kInterval = 20'000'000;  // ns until one more is accepted
  static constexpr std::int64_t kArrivals = 128;  // largest burst of new participants, per address
  static constexpr std::int64_t kArrivalInterval = 100'000'000;  // ns until one more is accepted

  explicit Discovered(DiscoveryLimits limits);

  void participant_found(const Prefix& prefix, bool endless);  // endless: infinite lease
  void participant_lost(const Prefix& prefix);
  void endpoint_found(const Guid& endpoint);
  void endpoint_lost(const Guid& endpoint);

  bool simple() const { return limits_.simple; }
  // Whether that participant may announce others than itself.
  bool is_server(const Prefix& prefix) const;
  // Whether its lease is infinite, so that no timer of a lease can fire while its end is processed.
  bool is_endless(const Prefix& prefix) const;
  bool has_participant(const Prefix& prefix) const;
  bool has_endpoint(const Guid& endpoint) const;
  std::size_t endpoints() const;

  // Whether a participant that is announced by itself, or by a server, from that address with that
  // lease (s) may take a place; counts it if it is new. Participants with too long a lease would
  // occupy places permanently.
  bool admits(const Prefix& prefix, const Prefix& by, const Address& from, std::uint32_t lease,
              std::int64_t now);
  // Whether that participant may announce that endpoint; counts it if it is new.
  bool admits(const Prefix& prefix, const Guid& endpoint, std::int64_t now);
  // The participant announced the end of this endpoint. Its place is free at once: the library
  // processes discovery samples in order, so it may be waiting for an announcement that found no
  // place.
  void ends(const Guid& endpoint);

 private:
  static constexpr std::int64_t kNever = std::numeric_limits<std::int64_t>::min();

  struct Participant {
    bool endless = false;
    std::size_t endpoints = 0;    // number of endpoints whose end was not announced
    std::int64_t spent = kNever;  // time up to which all tokens are spent
  };

  std::int64_t& arrivals_from(const Address& address);
  bool arrives(const Prefix& prefix, const Address& from, std::int64_t now);

  const DiscoveryLimits limits_;
  mutable std::mutex mutex_;
  std::map<Prefix, Participant> participants_;
  std::map<Guid, bool> endpoints_;  // true: its end was announced
  // The times up to which the tokens of an address are spent. Addresses can be forged: they share
  // 64 buckets, by a keyed hash that no sender can compute.
  std::array<std::int64_t, 64> arrivals_{};
  const std::uint64_t key_;
  // Participants that were counted as new and are not discovered yet, so that they are not counted
  // again. This participant receives its own announcements, too, and is never discovered.
  std::array<Prefix, 64> awaited_{};
  std::size_t next_awaited_ = 0;
};

}  // namespace linegate::dds::guard

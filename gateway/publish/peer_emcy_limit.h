// SPDX-License-Identifier: Apache-2.0
// How many EMCYs of one line of another gateway are passed on: a device that fails again and again,
// or a gateway that publishes more than a bus can carry, must not fill the bus, the events and the
// journal of the lines here.
//
// A line that loses its supply sends an EMCY of each node at once, so many are permitted at once,
// and few on average. Each line has a share of its own, whatever the others send.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <utility>

#include "gateway/publish/rate_limit.h"
#include "stack/base/time.h"

namespace linegate::gateway {

// One for each line of another gateway.
class PeerEmcyLimit {
 public:
  // Of one source: a node of a network.
  static constexpr double kNodeBurst = 16;
  static constexpr double kNodePerSecond = 4;
  static constexpr double kLineBurst = 128;
  static constexpr double kLinePerSecond = 40;
  // Of one gateway on that bus, which forwards EMCYs in the names of their sources: parts of what
  // its line may have. A device that invents sources leaves the rest to the others.
  static constexpr double kCarrierBurst = 0.875;
  static constexpr double kCarrierPerSecond = 0.75;
  // Of all lines together; each has an equal share of it, and no more than one line may have.
  static constexpr double kAllBurst = 256;
  static constexpr double kAllPerSecond = 80;

  // The number of lines that share, at least 1.
  void share_among(std::size_t lines);
  // carrier: node-ID of the gateway on that bus that forwarded it; 0: its source itself sent it.
  bool admit(std::uint8_t carrier, std::uint16_t network, std::uint8_t node, Instant now);

  // Sources whose bucket is not full.
  std::size_t sources() const { return sources_.size(); }

 private:
  TokenBucket& carrier_of(std::uint8_t node);

  double burst_ = kLineBurst;
  double per_second_ = kLinePerSecond;
  TokenBucket line_{burst_, per_second_};
  std::map<std::uint8_t, TokenBucket> carriers_;
  // Each has passed an EMCY within the time to fill its bucket, so the bucket of the line bounds
  // their number.
  std::map<std::pair<std::uint16_t, std::uint8_t>, TokenBucket> sources_;
};

}  // namespace linegate::gateway

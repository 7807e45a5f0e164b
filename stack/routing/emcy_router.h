// SPDX-License-Identifier: Apache-2.0
// Forwards EMCYs to other networks (CiA 302-7), selected by object 1F2Fh.
//
//   1F2Fh:0       U8   const  127
//   1F2Fh:1..127  U32  rw     for EMCYs of the node with that node-ID (sub-index as in 1028h):
//                             bit k-1 set = they are forwarded to network k, 1..32
//
// EMCYs of a gateway are forwarded EMCYs, and are forwarded again as those of their source. None is
// sent back to its source network, to a line that it was on before, or over more than kMaxHops; so
// an EMCY does not circulate in a loop of gateways.
#pragma once

#include <array>
#include <bitset>
#include <cstddef>
#include <cstdint>

#include "stack/base/event_log.h"
#include "stack/emcy/producer.h"
#include "stack/od/dictionary.h"
#include "stack/routing/config.h"
#include "stack/routing/emcy_frame.h"
#include "stack/routing/post.h"

namespace linegate::routing {

class EmcyRouter {
 public:
  // network: network-ID of this line. All references must outlive this object.
  EmcyRouter(const Config& config, std::uint16_t network, const od::Dictionary& dictionary,
             emcy::Producer& producer, Post& post, EventLog& events, Counters& counters);

  // Call it after the routes of the configuration have changed.
  void update_gateways();

  // A node of this line sent an EMCY.
  void heard(std::uint8_t node, const emcy::Message& message, Instant now);
  // Another line forwards an EMCY to this line, on which the own node sends it, within its inhibit
  // time (1015h).
  void deliver(const Message& message, Instant now);

 private:
  // The last EMCYs on this line, kept for as long as they may arrive again over another route.
  // Older ones are forgotten, so that a restarted gateway, which numbers from 0 again, is not
  // ignored.
  static constexpr std::size_t kRemembered = 128;
  static constexpr Duration kRememberedFor = std::chrono::seconds(2);

  struct Seen {
    ForwardedEmcy emcy;  // network 0: unused
    Instant time{};
  };

  bool is_gateway(std::uint8_t node) const { return gateways_.test(node); }
  bool is_new(const ForwardedEmcy& emcy, Instant now);
  bool may_enter(std::uint16_t network) const;
  void forward(const ForwardedEmcy& emcy, std::uint32_t networks, Instant now);
  void report(const ForwardedEmcy& emcy, std::uint8_t from, Instant now);

  const Config& config_;
  std::uint16_t network_;
  const od::Dictionary& dictionary_;
  emcy::Producer& producer_;
  Post& post_;
  EventLog& events_;
  Counters& counters_;
  std::bitset<can::kMaxNodeId + 1> gateways_;
  std::uint8_t number_ = 0;
  std::array<Seen, kRemembered> seen_{};
  std::size_t next_seen_ = 0;
};

}  // namespace linegate::routing

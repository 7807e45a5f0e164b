// SPDX-License-Identifier: Apache-2.0
// EMCYs that go on to other networks (CiA 302-7): object 1F2Fh says to which.
//
//   1F2Fh:0       U8   const  127
//   1F2Fh:1..127  U32  rw     of the EMCYs of the node with that node-ID, as 1028h: bit k-1 set =
//                             they are forwarded to network k, 1..32
//
// Of a gateway, a node that is to be asked for other networks, the EMCYs are forwarded ones: they
// go on as those of their source. None goes back to its source network, none goes to a line that it
// was on already, and none further than kMaxHops; so a loop of gateways settles.
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
  // Of the line with that network-ID. All must outlive it.
  EmcyRouter(const Config& config, std::uint16_t network, const od::Dictionary& dictionary,
             emcy::Producer& producer, Post& post, EventLog& events, Counters& counters);

  // The routes of the configuration are others.
  void take_gateways();

  // A node of this line sent one.
  void heard(std::uint8_t node, const emcy::Message& message, Instant now);
  // Another line forwards one to this line, where the own node sends it, within its inhibit time
  // (1015h).
  void deliver(const Message& message, Instant now);

 private:
  // The last ones that were on this line, for as long as they may come again on another way: a
  // gateway that was started again, and numbers from 0, is heard.
  static constexpr std::size_t kRemembered = 128;
  static constexpr Duration kRememberedFor = std::chrono::seconds(2);

  struct Seen {
    ForwardedEmcy emcy;  // network 0: none
    Instant time{};
  };

  bool is_gateway(std::uint8_t node) const { return gateways_.test(node); }
  bool is_new(const ForwardedEmcy& emcy, Instant now);
  bool may_enter(std::uint16_t network) const;
  void forward(const ForwardedEmcy& emcy, std::uint32_t networks, Instant now);
  void tell(const ForwardedEmcy& emcy, std::uint8_t from, Instant now);

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

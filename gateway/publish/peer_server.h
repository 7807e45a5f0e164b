// SPDX-License-Identifier: Apache-2.0
// The client of other gateways in a process of its own: carries out the messages of RemotePeers
// (remote_peers.h) with the client of this process. No DDS, thread or clock here.
//
// Samples that the gateway would not accept are left out here, since it replaces a process that
// passes one on: a single host could keep all routes down.
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <set>

#include "gateway/publish/peer_messages.h"
#include "gateway/publish/peer_routes.h"

namespace linegate::gateway {

// All functions from one thread.
class PeerServer final : private PeerHandler {
 public:
  // Returns false if there is no room.
  using Send = std::function<bool(PeerBytes message)>;
  // States and events that find no room are left out: other states follow, and the gateway counts
  // the events by their numbers.
  static constexpr std::size_t kMostWaiting = 1'024;
  static constexpr std::size_t kMostEventsWaiting = 4'096;

  // client must outlive it. now: the monotonic clock of both processes.
  PeerServer(PeerClient& client, std::function<Instant()> now);

  // Carries out a message after ToPeers::configure. Returns false if it asks to end, or is
  // malformed.
  bool handle(PeerBytes message);
  // Waits for samples, at most `timeout`, and sends what there is. Returns false if there was no
  // room: try again soon.
  bool poll(Duration timeout, const Send& send);
  void report_expiry(std::int64_t time);

 private:
  void on_state(const routing::GatewayLine& line, std::uint64_t incarnation, std::int64_t time,
                std::uint16_t network) override;
  void on_event(const routing::GatewayLine& line, std::uint64_t incarnation,
                const PeerEvent& event) override;
  void on_gone(const routing::GatewayLine& line) override;
  void on_answer(std::uint64_t id, const line::Reply& reply) override;

  bool set_lines(PeerBytes message);
  bool start(PeerBytes message);
  bool cancel(PeerBytes message);

  PeerClient& client_;
  const std::function<Instant()> now_;
  std::set<routing::GatewayLine> lines_;             // of both kinds
  std::map<std::uint64_t, std::uint64_t> requests_;  // IDs of the gateway by those of the client
  std::deque<PeerMessage> waiting_;
  std::int64_t expiry_ = 0;
};

}  // namespace linegate::gateway

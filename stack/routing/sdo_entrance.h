// SPDX-License-Identifier: Apache-2.0
// SDO connections whose clients are on this line: from the network indication of a client to the
// end of its transfer. The other half, on the line where the target is, is SdoExit.
//
//   opening -- sdo_opened --> armed -- initiate --> forward -- last frame, abort --> (gone)
//      |  sdo_refused: the next route, or the refusal        |
//      +-- nobody answers                 arm_timeout, frame_timeout: abort 0504 0000h
//
// Nothing is allocated while frames are forwarded.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "stack/od/dictionary.h"
#include "stack/routing/config.h"
#include "stack/routing/post.h"
#include "stack/routing/sdo_phase.h"
#include "stack/routing/trace.h"

namespace linegate::routing {

// Where a connection begins: an SDO server of the own node, or a client in this process.
class ClientSide {
 public:
  virtual ~ClientSide() = default;
  // A frame for the client: the response to its indication, the abort that refuses it, what the
  // server answers. False: there is no room, try again in a millisecond.
  virtual bool response(std::uint64_t word, Instant now) = 0;
  // There is no connection any more, and all frames were taken.
  virtual void released(Instant now) = 0;
  // Its frames are on the bus of this line.
  virtual bool on_bus() const = 0;
  // A device on the bus of this line, or a client that takes the place of one: the request comes
  // from the network of the line, and the way never goes back there.
  virtual bool is_device() const = 0;

 private:
  friend class SdoEntrance;
  std::uint32_t connection_ = 0;  // 0 = none
};

class SdoEntrance {
 public:
  static constexpr std::size_t kMaxConnections = 1024;

  // Of the line itself. node: the own one; sdo_timeout as LineConfig has it.
  struct Line {
    std::uint16_t network = 0;
    std::uint8_t node = 0;
    Duration sdo_timeout{};
  };

  // dictionary has 1F2Ch. All must outlive it.
  SdoEntrance(const Config& config, Line line, const od::Dictionary& dictionary, Post& post,
              EventLog& events, Counters& counters);
  ~SdoEntrance();

  // A frame of the client with command specifier 7 while it is not in a sub-block, or any other.
  // Answered through side.response(), then or later.
  void request(ClientSide& side, std::uint64_t word, Instant now);
  // The client is to be forgotten, without a word to it.
  void gone(ClientSide& side);
  // sdo_opened, sdo_refused, sdo_response.
  void deliver(const Message& message, Instant now);
  void advance(Instant now);
  Instant next_wake() const { return wake_; }
  // Ends all connections.
  void stop(Instant now);
  // Connections that open before are events.
  void trace_until(Instant end) { trace_.ask(end); }

 private:
  struct Connection;

  Connection* of(const ClientSide& side) const;
  Connection* find(std::uint32_t number) const;
  Connection* make(ClientSide& side);
  static void renumber(Connection& connection);
  void indication(ClientSide& side, std::uint64_t word, Instant now);
  AbortCode refusal_of(const ClientSide& side, std::uint64_t word) const;
  // The network that the request of this client comes from; 0 = this process itself.
  std::uint16_t source_of(const ClientSide& side) const;
  bool is_this_gateway(const Indication& wanted) const;
  void try_route(Connection& connection, Instant now);
  void route_failed(Connection& connection, AbortCode why, Instant now);
  void refuse(Connection& connection, AbortCode why, Instant now);
  void armed(Connection& connection, std::uint64_t word, Instant now);
  void forward(Connection& connection, std::uint64_t word, Instant now);
  void response(Connection& connection, const Message& message, Instant now);
  void give(Connection& connection, std::uint64_t word, Instant now);
  void flush(Connection& connection, Instant now);
  void expire(Connection& connection, Instant now);
  // Ends it with an abort to both sides.
  void break_down(Connection& connection, AbortCode why, Instant now);
  void count_end(Connection& connection, SdoPhase::End how, AbortCode why, Instant now);
  void tell(const Connection& connection, EventKind kind, AbortCode why, Instant now);
  void tell_exit(const Connection& connection, AbortCode why);
  // The frames that wait are still given, then the client's side is released.
  void release(Connection& connection, Instant now);
  void free(Connection& connection);
  void wait_until(Connection& connection, Instant deadline);
  Duration frame_timeout() const;
  Duration opening_timeout(unsigned hops) const;

  const Config& config_;
  const Line line_;
  const od::Dictionary& dictionary_;
  Post& post_;
  EventLog& events_;
  Counters& counters_;
  std::vector<std::unique_ptr<Connection>> connections_;
  Trace trace_;
  Instant now_{};  // newest time heard of
  Instant wake_ = kNever;
};

// How long a gateway waits for the next one's answer, the time until it could ask among it: less
// with each hop, so that the one that is nearest to what failed finds out first. hops: as it sends
// them, 1..kMaxHops.
Duration gateway_timeout(const Config& config, Duration sdo_timeout, unsigned hops);
Duration channel_wait(const Config& config, Duration sdo_timeout);

}  // namespace linegate::routing

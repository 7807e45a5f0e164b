// SPDX-License-Identifier: Apache-2.0
// SDO connections whose clients are on this line: from the network indication of a client to the
// end of its transfer. SdoEgress is the counterpart on the line of the target.
//
//   opening -- sdo_opened --> armed -- initiate --> forward -- last frame, abort --> (gone)
//      |  sdo_refused: the next route, or the refusal        |
//      +-- no answer                      arm_timeout, frame_timeout: abort 0504 0000h
//
// Forwarding frames allocates no memory.
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

// The client side of a connection: an SDO server of the own node, or a client in this process.
class ClientSide {
 public:
  virtual ~ClientSide() = default;
  // A frame for the client: the response to its indication, the abort that refuses it, or an answer
  // of the server. False if there is no room: it is repeated after a millisecond.
  virtual bool response(std::uint64_t word, Instant now) = 0;
  // The connection has ended, and all its frames were accepted.
  virtual void released(Instant now) = 0;
  // Whether its frames are on the bus of this line.
  virtual bool on_bus() const = 0;
  // Whether it is a device on the bus of this line, or a client that acts for one: the source of
  // the request is the network of the line, and a route never leads back there.
  virtual bool is_device() const = 0;
  // The number of the client of this process whose command it is, see sdo::Pace; 0 = nobody's.
  virtual std::uint32_t client() const { return 0; }
  // Its frames wait for the share of that client on the line of the target: no response is due yet.
  virtual void paced(Instant /*now*/) {}

 private:
  friend class SdoIngress;
  std::uint32_t connection_ = 0;  // 0 = none
};

class SdoIngress {
 public:
  static constexpr std::size_t kMaxConnections = 1024;

  // The own line. node: the own node-ID; sdo_timeout: LineConfig::sdo_timeout.
  struct Line {
    std::uint16_t network = 0;
    std::uint8_t node = 0;
    Duration sdo_timeout{};
  };

  // dictionary has 1F2Ch. All references must outlive this object.
  SdoIngress(const Config& config, Line line, const od::Dictionary& dictionary, Post& post,
             EventLog& events, Counters& counters);
  ~SdoIngress();

  // A frame of a client: an indication (command specifier 7, while the client is not in a
  // sub-block), or a frame of a connection. It is answered with side.response(), at once or later.
  void request(ClientSide& side, std::uint64_t word, Instant now);
  // The client no longer exists: its connection ends without a response.
  void gone(ClientSide& side);
  // Takes sdo_opened, sdo_refused, sdo_response and sdo_paced.
  void deliver(const Message& message, Instant now);
  void advance(Instant now);
  Instant next_wake() const { return wake_; }
  // Ends all connections.
  void stop(Instant now);
  // Connections that open before `end` are reported as events.
  void trace_until(Instant end) { trace_.ask(end); }

 private:
  struct Connection;

  Connection* of(const ClientSide& side) const;
  Connection* find(std::uint32_t number) const;
  Connection* make(ClientSide& side);
  static void renumber(Connection& connection);
  void indication(ClientSide& side, std::uint64_t word, Instant now);
  AbortCode refusal_of(const ClientSide& side, std::uint64_t word) const;
  // The source network of this client's request; 0 = this process itself.
  std::uint16_t source_of(const ClientSide& side) const;
  bool is_this_gateway(const Indication& wanted) const;
  void try_route(Connection& connection, Instant now);
  void route_failed(Connection& connection, AbortCode why, Instant now);
  void refuse(Connection& connection, AbortCode why, Instant now);
  void armed(Connection& connection, std::uint64_t word, Instant now);
  void forward(Connection& connection, std::uint64_t word, Instant now);
  void response(Connection& connection, const Message& message, Instant now);
  void paced(Connection& connection, Instant now);
  void give(Connection& connection, std::uint64_t word, Instant now);
  void flush(Connection& connection, Instant now);
  void expire(Connection& connection, Instant now);
  // Ends it with an abort to both sides.
  void break_down(Connection& connection, AbortCode why, Instant now);
  void count_end(Connection& connection, SdoPhase::End how, AbortCode why, Instant now);
  void report_opened(const Connection& connection, Instant now);
  void report_ended(const Connection& connection, AbortCode why, Instant now);
  void close_exit(const Connection& connection, AbortCode why);
  // Passes on the waiting frames, then releases the client's side.
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
  Instant now_{};  // the latest known time
  Instant wake_ = kNever;
};

// How long a gateway waits for the answer of the next gateway, including the wait for a client SDO:
// less with each hop, so that the gateway next to a failure detects it first. hops: the value it
// sends, 1..kMaxHops.
Duration gateway_timeout(const Config& config, Duration sdo_timeout, unsigned hops);
Duration channel_wait(const Config& config, Duration sdo_timeout);

}  // namespace linegate::routing

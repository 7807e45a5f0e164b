// SPDX-License-Identifier: Apache-2.0
// SDO requests of lines of this gateway to lines of other gateways (`routes:`, via: GATEWAY/LINE).
//
// Invariants:
// 1. A request is sent to one incarnation of the other gateway, so that a restart never carries it
//    out once more, nor another gateway of the same name. The client that sends it repeats it only
//    while the other gateway recognises the repetition, and with the time-out that is left
//    (bridges/dds/request_tracker.h).
// 2. Each request has one answer at most, with its number. A write that was sent is answered with
//    an abort only if the other gateway says that it was not carried out; else the result is
//    unknown.
// 3. Nothing is sent while two gateways publish the line at the same time, or none does.
// 4. At most kMostUnderWay requests to a line are under way; further ones are refused.
//
// All samples are foreign. No DDS, thread or clock here.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "stack/base/time.h"
#include "stack/line/command.h"
#include "stack/routing/emcy_frame.h"
#include "stack/routing/gateway_request.h"

namespace linegate::gateway {

// An event of a line of another gateway: only what its EMCYs need.
struct PeerEvent {
  std::uint64_t stream = 0;  // of the number, not 0
  std::uint64_t number = 0;
  std::int64_t time = 0;  // by the clock of its gateway
  // The EMCY of a device of that line, of network 0, or one of another network (routed), with the
  // node that sent it there; 0: the gateway. Nothing: another event.
  std::uint8_t node = 0;
  bool routed = false;
  std::optional<routing::ForwardedEmcy> emcy{};
};

// What a PeerClient receives. Called within PeerClient::poll().
class PeerHandler {
 public:
  virtual ~PeerHandler() = default;
  // The state of a line of any gateway. time: of the sample, by the clock of its gateway. network:
  // its network-ID.
  virtual void on_state(const routing::GatewayLine& line, std::uint64_t incarnation,
                        std::int64_t time, std::uint16_t network) = 0;
  // Only of a client with events.
  virtual void on_event(const routing::GatewayLine& line, std::uint64_t incarnation,
                        const PeerEvent& event) = 0;
  // The line was removed, or its gateway has left.
  virtual void on_gone(const routing::GatewayLine& line) = 0;
  // The answer to a request: of the gateway, or Refusal::timed_out.
  virtual void on_answer(std::uint64_t id, const line::Reply& reply) = 0;
};

// Sends commands to other gateways. All functions except wake() from one thread.
class PeerClient {
 public:
  virtual ~PeerClient() = default;
  // The lines that requests are addressed to, and those whose EMCYs are received. The states and
  // events of others need not be reported. Call it while no thread polls.
  virtual void set_lines(const std::vector<routing::GatewayLine>& addressed,
                         const std::vector<routing::GatewayLine>& emcys) = 0;
  // Returns the ID of the request. It is answered within the time-out, unless it is cancelled. 0:
  // there is no room for it, and it will not be carried out.
  virtual std::uint64_t send(const routing::GatewayLine& to, std::uint64_t incarnation,
                             const line::Request& request, Duration timeout) = 0;
  virtual void cancel(std::uint64_t id) = 0;
  // Waits until samples were received, wake() was called, or the timeout passed.
  virtual void poll(Duration timeout, PeerHandler& handler) = 0;
  virtual void wake() = 0;
};

class PeerRoutes {
 public:
  // The lines of this gateway.
  class Sink {
   public:
    virtual ~Sink() = default;
    // Returns false if there is no room: advance() retries. The line may be gone.
    virtual bool answer(const std::string& line, routing::GatewayAnswer& answer) = 0;
    // Of the lines of set_lines(), those that can be reached from now on.
    virtual void set_present(const std::vector<routing::GatewayLine>& present) = 0;
  };

  // A gateway publishes the state of each line once a second.
  static constexpr Duration kSilence = std::chrono::seconds(3);
  static constexpr std::size_t kMostUnderWay = 64;  // to one line
  // Of one line: former incarnations, and foreign ones. Further ones are ignored until one of them
  // was silent for kSilence.
  static constexpr std::size_t kMostPublishers = 4;

  // sink must outlive it.
  explicit PeerRoutes(Sink& sink) : sink_(sink) {}

  // The lines of other gateways that requests are addressed to. Reports the present ones anew.
  void set_lines(const std::vector<routing::GatewayLine>& lines, Instant now);
  // Lines that are not in set_lines() are ignored.
  void take_state(const routing::GatewayLine& line, std::uint64_t incarnation, std::int64_t time,
                  Instant now);
  void take_end(const routing::GatewayLine& line, Instant now);

  // The incarnation that publishes the line; nothing if none does, or two do.
  std::optional<std::uint64_t> publisher_of(const routing::GatewayLine& line, Instant now) const;

  // A request of a line of this gateway, or the end of one.
  void take(PeerClient& client, const std::string& line, routing::GatewayRequest request,
            Instant now);
  void take_answer(std::uint64_t id, const line::Reply& reply);
  // The line has ended: its requests are cancelled, and their answers discarded.
  void forget(PeerClient& client, const std::string& line);
  // The client is replaced: what it has sent is cancelled, and answered as unknown.
  void end_requests(PeerClient& client);

  // Call it periodically.
  void advance(Instant now);
  // Whether answers wait for room.
  bool is_waiting() const { return !answers_.empty(); }

 private:
  struct Publisher {
    std::uint64_t incarnation = 0;
    Instant began{};
    Instant heard{};
    std::int64_t time = 0;  // of its last state
  };
  struct Peer {
    std::vector<Publisher> publishers;
    std::size_t under_way = 0;
    bool is_present = false;
  };
  struct Request {
    std::string line;  // of this gateway
    std::uint64_t number = 0;
    bool write = false;
    routing::GatewayLine to;
  };
  struct Answer {
    std::string line;
    routing::GatewayAnswer answer;
  };

  static std::optional<std::uint64_t> incarnation_of(const Peer& peer, Instant now);
  void cancel(PeerClient& client, const std::string& line, std::uint64_t number);
  void answer(const std::string& line, routing::GatewayAnswer answer);
  void end(std::map<std::uint64_t, Request>::iterator request);
  void report_present(Instant now, bool anyway);

  Sink& sink_;
  std::map<routing::GatewayLine, Peer> peers_;
  std::map<std::uint64_t, Request> requests_;  // by ID
  std::deque<Answer> answers_;                 // without room yet
};

}  // namespace linegate::gateway

// SPDX-License-Identifier: Apache-2.0
// SDO connections whose target is reached over another gateway (Interface::way), which no bus joins
// to this one. SdoIngress of the same line is the counterpart.
//
// It serves the SDO protocol to the client, and passes on each transfer as one GatewayRequest, when
// its value is complete. The owner of the line carries the request to the other gateway
// (Line::pop_gateway_request()) and returns its answer.
//
//   open -- initiate, last byte of a download --> waiting -- answer, time-out --> (gone)
//
// Invariants:
// 1. A request is handed out at most once, and never after its deadline.
// 2. A write that was handed out and has no certain result ends with 0504 0000h and the event
//    routing-unanswered, whatever ended it: it may have been carried out.
// 3. An answer belongs to the request with its number. A number is never used again.
// 4. The requests of a client that ends are cancelled.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <span>
#include <vector>

#include "stack/base/event_log.h"
#include "stack/routing/config.h"
#include "stack/routing/gateway_request.h"
#include "stack/routing/post.h"
#include "stack/routing/value_server.h"

namespace linegate::routing {

class GatewayEgress {
 public:
  // Connections at a time; further ones are refused with 0504 0005h.
  static constexpr std::size_t kMost = 64;
  static constexpr std::size_t kMostOfOneClient = 32;
  static constexpr std::size_t kLongest = ValueServer::kLongest;  // bytes of a value

  // sdo_timeout: LineConfig::sdo_timeout. All references must outlive this object.
  GatewayEgress(const Config& config, Duration sdo_timeout, Post& post, EventLog& events,
                Counters& counters);
  ~GatewayEgress();

  // Takes sdo_open, sdo_request and sdo_close to an interface with a way.
  void deliver(const Message& message, Instant now);
  void advance(Instant now);
  Instant next_wake() const { return wake_; }
  // Ends all connections.
  void stop(Instant now);

  // The lines of other gateways that can be reached; none at first. Connections over others are
  // refused with 0504 0000h.
  void set_present(std::vector<GatewayLine> present) { present_ = std::move(present); }
  // The next request, or the end of one; false if there is none.
  bool pop(GatewayRequest& out);
  // An answer without a request, which may have timed out, is discarded.
  void answer(GatewayAnswer answer, Instant now);

 private:
  struct Passage;
  template <class Passages, class Egress>
  friend Instant advance_passages(const Passages& passages, Egress& egress, Instant now);

  Passage* find(std::uint8_t interface, std::uint32_t connection) const;
  Passage* find(std::uint64_t number) const;
  void open(const Message& message, Instant now);
  AbortCode refusal_of(const Message& message, const GatewayWay* way) const;
  Passage& make(const Message& open);
  void request(Passage& passage, std::uint64_t word, Instant now);
  void pump(Passage& passage);
  void respond(Passage& passage, ValueServer::Answer answer);
  // A transfer of the passage is to be carried out by the other gateway.
  void ask(Passage& passage, od::Address address, bool write, std::vector<std::byte> data);
  // The request under way needs no answer any more.
  void withdraw(Passage& passage);
  void finish(Passage& passage, AbortCode why, std::span<const std::byte> value, Instant now);
  void report_unknown(const Passage& passage, Instant now);
  void break_down(Passage& passage, AbortCode why);
  void release(Passage& passage);
  // See advance_passages().
  void keep_waiting(Passage& passage);
  void expire(Passage& passage);
  Duration client_timeout() const;

  const Config& config_;
  const Duration sdo_timeout_;
  Post& post_;
  EventLog& events_;
  Counters& counters_;
  std::vector<std::unique_ptr<Passage>> passages_;
  std::deque<GatewayRequest> outbox_;
  std::vector<GatewayLine> present_;
  std::uint64_t numbers_ = 0;
  Instant now_{};  // of the present call
  Instant wake_ = kNever;
};

}  // namespace linegate::routing

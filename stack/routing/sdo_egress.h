// SPDX-License-Identifier: Apache-2.0
// SDO connections that use a client SDO of this line: to the target, or to the next gateway.
// SdoIngress is the counterpart on the line of the client.
//
// Each goes through the arbiter of the line, so that no other user in this process accesses the
// same server meanwhile. Frames that a client of this process causes are limited by its share of
// this line (sdo::Pace), those of devices are not. A connection to the own node uses its dictionary
// at once.
//
//   waiting -- channel is free --> asking (next gateway) -- E0h --> open -- last frame --> (gone)
//                             \--> open (target)
//
// Frames that the bus has not accepted when a connection ends keep the client SDO reserved until
// they are sent or time out.
//
// Forwarding frames allocates no memory, except in the server of the own node.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "stack/can/transmit_queue.h"
#include "stack/od/dictionary.h"
#include "stack/routing/config.h"
#include "stack/routing/post.h"
#include "stack/routing/sdo_phase.h"
#include "stack/sdo/arbiter.h"
#include "stack/sdo/write_rule.h"

namespace linegate::routing {

class SdoEgress final : public sdo::ChannelUser {
 public:
  struct Line {
    std::uint16_t network = 0;
    std::uint8_t node = 0;  // the own node-ID
    Duration sdo_timeout{};
  };

  // All references must outlive this object. own: the dictionary of the own node.
  SdoEgress(const Config& config, Line line, od::Dictionary& own, sdo::Arbiter& arbiter,
            can::TransmitQueue& transmit, Post& post, EventLog& events, Counters& counters);
  ~SdoEgress() override;

  // Of the nodes of this line; it must outlive this object. Without a call all writes are
  // permitted.
  void set_write_rule(const sdo::WriteRule& rule) { rule_ = &rule; }
  // Whether SDOs can be sent on the line: its interface is usable, the own node not stopped.
  void set_usable(bool usable) { usable_ = usable; }

  // Takes sdo_open, sdo_request and sdo_close.
  void deliver(const Message& message, Instant now);
  void advance(Instant now);
  Instant next_wake() const;
  // Ends all connections.
  void stop(Instant now);

  // sdo::ChannelUser
  void granted(std::uint64_t number, Instant now) override;
  void response(std::uint64_t number, const can::Frame& frame) override;

 private:
  struct Passage;

  Passage* find(std::uint8_t from, std::uint32_t connection) const;
  Passage* find(std::uint64_t number) const;
  Passage& make(const Message& open);
  void open(const Message& message, Instant now);
  AbortCode reserve(Passage& passage, Instant now);
  void opened(Passage& passage, Instant now);
  void refuse(Passage& passage, AbortCode why, Instant now);
  void request(Passage& passage, std::uint64_t word, Instant now);
  AbortCode not_permitted(const Passage& passage, std::uint64_t word, Instant now) const;
  AbortCode refused_by_rule(const Passage& passage, std::uint64_t word, Instant now) const;
  void answered_by_gateway(Passage& passage, std::uint64_t word, Instant now);
  bool answer(Passage& passage, std::uint64_t word, Instant now);
  void serve_own(Passage& passage, std::uint64_t word, Instant now);
  void pump_own(Passage& passage, Instant now);
  void give(Passage& passage, std::uint64_t word, Instant now);
  void flush(Passage& passage, Instant now);
  bool put_on_bus(const Passage& passage, std::uint64_t word);
  void note_waiting(Passage& passage, Instant now);
  bool push(const Passage& passage, std::uint64_t word);
  // Ends the passage: sends an abort to a server that has state to clear, and sdo_refused to the
  // ingress.
  void break_down(Passage& passage, AbortCode why, Instant now);
  void abort_server(Passage& passage, AbortCode why, Instant now);
  void release(Passage& passage, AbortCode outcome, Instant now);
  void drain(Passage& passage, Instant now);
  void finish(Passage& passage, Instant now);
  Instant budget(const Passage& passage, unsigned hops, Instant now) const;
  void expire(Passage& passage, Instant now);
  void wait_until(Passage& passage, Instant deadline);
  Duration frame_timeout() const;

  const Config& config_;
  const Line line_;
  od::Dictionary& own_;
  sdo::Arbiter& arbiter_;
  can::TransmitQueue& transmit_;
  Post& post_;
  EventLog& events_;
  Counters& counters_;
  const sdo::WriteRule* rule_ = nullptr;
  bool usable_ = true;
  std::vector<std::unique_ptr<Passage>> passages_;
  std::uint64_t numbers_ = 0;               // of requests to the arbiter
  std::array<bool, 256> channels_taken_{};  // by number of the client SDO
  Instant wake_ = kNever;
};

}  // namespace linegate::routing

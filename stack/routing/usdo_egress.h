// SPDX-License-Identifier: Apache-2.0
// SDO connections that enter a line of CANopen FD: its devices have USDO instead of SDO, so no
// frame can be copied. SdoIngress is the counterpart on the line of the client.
//
// It serves the SDO protocol to the client, and passes each transfer, when its value is complete,
// to the arbiter of the line, which carries it out by USDO. Connections to the own node are those
// of SdoEgress.
//
//   open -- initiate, last byte of a download --> waiting -- result, channel_wait --> (gone)
//
// Invariants:
// 1. A transfer is passed to the arbiter at most once, with all bytes of the client.
// 2. The client receives the result of the device, its abort in the codes of SDO
//    (usdo/protocol.h), or an abort of the gateway: 060A 0023h and 0800 0022h state that nothing
//    was written; 0504 0000h that a write may have been carried out. If the client does not wait
//    for it, such a write is the event routing-unanswered.
// 3. A connection that ends withdraws its transfer: none is left in the arbiter.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "stack/base/event_log.h"
#include "stack/routing/config.h"
#include "stack/routing/post.h"
#include "stack/routing/value_server.h"
#include "stack/sdo/arbiter.h"
#include "stack/sdo/write_rule.h"

namespace linegate::routing {

class UsdoEgress final : public sdo::TransferOwner {
 public:
  // Connections at a time; further ones are refused with 0504 0005h.
  static constexpr std::size_t kMost = 64;
  static constexpr std::size_t kMostOfOneClient = 32;

  struct Line {
    std::uint8_t node = 0;  // the own node-ID
    Duration sdo_timeout{};
    // Bytes of the value of an object of a device, 0 = unknown; for expedited downloads that do not
    // indicate their size. Empty: of no object.
    std::function<std::size_t(std::uint8_t node, od::Address address)> size_of{};
  };

  // The clients of arbiter are those of USDO. All references must outlive this object.
  UsdoEgress(const Config& config, Line line, sdo::Arbiter& arbiter, Post& post, EventLog& events,
             Counters& counters);
  ~UsdoEgress() override;

  // See SdoEgress.
  void set_write_rule(const sdo::WriteRule& rule) { rule_ = &rule; }
  void set_usable(bool usable) { usable_ = usable; }

  // Whether the message opens a connection to a device, or belongs to one.
  bool takes(const Message& message) const;
  // Takes sdo_open, sdo_request and sdo_close. Precondition: takes(message).
  void deliver(const Message& message, Instant now);
  void advance(Instant now);
  Instant next_wake() const { return wake_; }
  // Ends all connections.
  void stop(Instant now);

  // sdo::TransferOwner
  void completed(sdo::Completion& completion, Instant now) override;

 private:
  struct Passage;
  template <class Passages, class Egress>
  friend Instant advance_passages(const Passages& passages, Egress& egress, Instant now);

  Passage* find(std::uint8_t from, std::uint32_t connection) const;
  void open(const Message& message, Instant now);
  AbortCode refusal_of(const Message& message) const;
  Passage& make(const Message& open);
  void request(Passage& passage, std::uint64_t word, Instant now);
  AbortCode ask(Passage& passage, od::Address address, bool write,
                std::span<const std::byte> value);
  void withdraw(Passage& passage);
  void report_unknown(const Passage& passage);
  void finish(Passage& passage, AbortCode why, std::span<const std::byte> value, Instant now);
  void pump(Passage& passage);
  void break_down(Passage& passage, AbortCode why);
  void release(Passage& passage);
  // See advance_passages().
  void keep_waiting(Passage& passage);
  void expire(Passage& passage);
  Duration client_timeout() const;

  const Config& config_;
  const Line line_;
  sdo::Arbiter& arbiter_;
  Post& post_;
  EventLog& events_;
  Counters& counters_;
  const sdo::WriteRule* rule_ = nullptr;
  bool usable_ = true;
  std::vector<std::unique_ptr<Passage>> passages_;
  std::uint64_t numbers_ = 0;  // of requests to the arbiter
  Instant now_{};              // of the present call
  Instant wake_ = kNever;
};

}  // namespace linegate::routing

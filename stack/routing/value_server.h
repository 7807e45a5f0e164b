// SPDX-License-Identifier: Apache-2.0
// Serves the SDO protocol to the client of one connection whose target is not reached by SDO
// frames: over another gateway, or by USDO. Each transfer, expedited, segmented or in blocks, is
// passed to the Target as one value.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "stack/base/event_log.h"
#include "stack/can/transmit_queue.h"
#include "stack/od/dictionary.h"
#include "stack/od/hook.h"
#include "stack/routing/sdo_phase.h"
#include "stack/sdo/server.h"

namespace linegate::routing {

class ValueServer final : od::Hook {
 public:
  // Bytes of a value; longer ones are refused with 0504 0005h.
  static constexpr std::size_t kLongest = std::size_t{128} * 1024;

  // Carries out the transfers.
  class Target {
   public:
    virtual ~Target() = default;
    // A read, or a write whose last byte has arrived. none: finish() follows, unless the request is
    // withdrawn; otherwise the abort code for the client.
    virtual AbortCode ask(od::Address address, bool write, std::span<const std::byte> value) = 0;
    // Bytes of the value of the object, 0 = unknown.
    virtual std::size_t size_of(od::Address /*address*/) const { return 0; }
    // The request under way needs no answer any more.
    virtual void withdrawn() = 0;
  };

  // target and events must outlive the server. A transfer without a frame of the client for
  // frame_timeout is aborted.
  ValueServer(Target& target, EventLog& events, Duration frame_timeout);

  // Whether a frame of the client begins a transfer now.
  bool begins(std::uint64_t word) const { return phase_.begins(word); }
  // A frame of the client. Returns whether it ends the transfer.
  SdoPhase::End request(std::uint64_t word, Instant now);
  // Aborts the transfer that the client's frame begins.
  void refuse(std::uint64_t word, AbortCode why);
  // The result of the request under way. Precondition: waits(). value: of a read without an error.
  void finish(AbortCode why, std::span<const std::byte> value, Instant now);
  bool waits() const { return ticket_ != 0; }

  struct Answer {
    std::uint64_t word = 0;
    SdoPhase::End end = SdoPhase::End::none;  // of the transfer, with this frame
  };
  // The next frame for the client.
  std::optional<Answer> pop();
  void advance(Instant now) { server_.advance(now, queue_); }
  Instant next_wake() const { return server_.next_wake(); }
  // Drops the transfer and the frames for the client; withdraws the request under way.
  void reset();

 private:
  std::uint64_t with_size(std::uint64_t word) const;
  AbortCode before_read(od::Address address, const od::Variable& variable) override;
  AbortCode check_write(od::Address address, std::span<const std::byte> value) override;
  void put_off(od::Address address, od::Ticket waiting) override;
  void cancelled(od::Ticket waiting) override;
  AbortCode ask(od::Address address, bool write, std::span<const std::byte> value);
  AbortCode prepare(od::Address address);

  Target& target_;
  SdoPhase phase_;
  od::Dictionary dictionary_;  // has the object of the transfer alone
  std::uint16_t index_ = 0;    // of that object; 0 = there is none
  std::uint64_t begun_ = 0;    // the frame that began the transfer
  sdo::Server server_;
  can::TransmitQueue queue_;
  od::Address asked_;
  bool reads_ = false;
  od::Ticket ticket_ = 0;  // of the access that waits for the result
};

}  // namespace linegate::routing

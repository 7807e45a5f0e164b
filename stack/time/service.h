// SPDX-License-Identifier: Apache-2.0
// TIME of one node (CiA 301, 7.2.6), producer and consumer, and its object:
//   1012h  U32  COB-ID TIME: bit 31 consume, bit 30 produce, bit 29 frame format, bits 0..28 CAN-ID
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "stack/base/time.h"
#include "stack/can/dispatch.h"
#include "stack/can/transmit_queue.h"
#include "stack/od/dictionary.h"
#include "stack/time/message.h"

namespace linegate::time {

inline constexpr std::uint32_t kConsumeBit = 0x8000'0000;
inline constexpr std::uint32_t kProduceBit = 0x4000'0000;

struct Received {
  TimeOfDay time;
  Instant at{};  // receive time
};

// Hook of 1012h: writes take effect at once. Without the object a node has no TIME.
class Service final : public od::Hook {
 public:
  // All must outlive this object. The owner sets the hook. A consumer's COB-ID is registered as
  // Service::time, index 0.
  Service(const od::Dictionary& dictionary, can::Dispatch& dispatch, can::TransmitQueue& transmit);
  ~Service() override;
  Service(const Service&) = delete;
  Service& operator=(const Service&) = delete;

  // Reads the object; discards the received time.
  void configure();
  // True in Pre-operational and Operational.
  void set_active(bool active);

  // --- producer ---------------------------------------------------------------------------------

  // UTC (since 1970-01-01) is protocol time + offset.
  void set_utc(Duration offset) { utc_offset_ = offset; }
  // Sends the time of `now` every period, from one period after the next apply_writes() or
  // advance(); 0 = no periodic transmission.
  void produce_every(Duration period);
  // Whether the node's application has a clock and calls send(). A node without it and without
  // periodic transmission refuses to be a producer.
  void set_clock(bool has_clock) { has_clock_ = has_clock; }
  // Queues a TIME message. Returns false if the node is not a producer or not active, or the queue
  // is full.
  bool send(const TimeOfDay& time);

  // --- consumer ---------------------------------------------------------------------------------

  // A frame on the COB-ID, received at frame.time. Returns false, without an effect, if it is
  // malformed: the owner reports it.
  bool receive(const can::Frame& frame);
  // The last TIME message; nothing if none was received since configure().
  const std::optional<Received>& received() const { return received_; }
  // UTC according to the network: the last TIME message plus the time since.
  std::optional<Duration> network_utc(Instant now) const;

  void apply_writes(Instant now);
  // Sends messages that are due. Missed messages are skipped, and no message is queued while
  // another one is still in the transmit queue. Without set_utc() nothing is sent.
  void advance(Instant now);
  // A time in the past (Instant{}) after a change: call apply_writes() or advance() at once.
  Instant next_wake() const { return next_; }

  // Returns invalid_value for an identifier that may not be configured, for another one while the
  // node produces or consumes and continues to, and for the producer bit if there is no clock.
  AbortCode check_write(od::Address address, std::span<const std::byte> value) override;
  void written(od::Address address) override;

 private:
  bool produces() const { return (cob_id_.raw & kProduceBit) != 0; }
  void restart();
  void register_cob_id(bool wanted);

  const od::Dictionary& dictionary_;
  can::Dispatch& dispatch_;
  can::TransmitQueue& transmit_;
  can::CobId cob_id_{0};
  can::CobId registered_{0};
  bool is_registered_ = false;
  bool active_ = false;
  bool has_clock_ = false;
  std::optional<Duration> utc_offset_;
  Duration period_{};
  bool anchored_ = true;  // next_ is a time, not a request for apply_writes()
  Instant next_ = kNever;
  std::optional<Received> received_;
};

}  // namespace linegate::time

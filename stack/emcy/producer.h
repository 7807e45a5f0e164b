// SPDX-License-Identifier: Apache-2.0
// The EMCY producer of the own node (CiA 301, 7.2.7), with its objects:
//   1001h  U8   error register, as in the last message
//   1003h       history of errors, see ErrorHistory
//   1014h  U32  COB-ID EMCY, bit 31 = not valid
//   1015h  U16  inhibit time in multiples of 100 us
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <utility>

#include "stack/base/event_log.h"
#include "stack/base/time.h"
#include "stack/can/cob_id.h"
#include "stack/can/dispatch.h"
#include "stack/can/transmit_queue.h"
#include "stack/emcy/error_history.h"
#include "stack/emcy/message.h"
#include "stack/od/dictionary.h"

namespace linegate::emcy {

enum class SendResult : std::uint8_t {
  sent,           // passed to the transmit queue
  queued,         // during the inhibit time: the message is sent when it is over
  inhibited,      // during the inhibit time with kWaiting messages waiting already, or with
                  // a full transmit queue: the message will not be sent
  disabled,       // there is no valid COB-ID, or the NMT state does not allow EMCY
  errors_remain,  // an error reset that is not sent because other errors remain
};

// Emits emcy_sent when the frame was acknowledged on the bus.
class SentReporter {
 public:
  virtual ~SentReporter() = default;
  // The frame is in the transmit queue. event: emcy_sent, to be emitted to `events`.
  virtual void emcy_queued(const can::Frame& frame, const Event& event, EventLog& events) = 0;
};

// Hook of 1014h and 1015h. Without a SentReporter, emits emcy_sent for every message that is passed
// to the transmit queue.
class Producer final : public od::Hook {
 public:
  static constexpr std::size_t kWaiting = 16;

  // All must outlive the producer; node_id is 1..127. The owner sets the hooks: the producer
  // itself, and history() for 1003h.
  Producer(od::Dictionary& dictionary, can::TransmitQueue& transmit, EventLog& events,
           std::uint8_t node_id);

  // Registers the target {emcy, index} for frames of other nodes on the COB-ID in 1014h, while that
  // is valid. dispatch must outlive the producer.
  void listen_for_others(can::Dispatch& dispatch, std::uint16_t index);

  // TIME_OF_DAY now; all 0: not known.
  using TimeSource = std::function<std::array<std::byte, 6>(Instant now)>;
  // From now on, messages of send() are EMCYs of CANopen FD, see message.h: with the profile of
  // 1000h, logical device 0, and the time of the error. A message with a code other than 0000h is
  // active.
  void be_fd(TimeSource time) { time_of_day_ = std::move(time); }

  // reporter must outlive the producer.
  void set_reporter(SentReporter* reporter) { reporter_ = reporter; }

  // Call it after a reset: discards waiting messages.
  void configure();
  // True in Pre-operational and Operational.
  void set_active(bool active) { active_ = active; }

  // Reports an error, or with code 0000h that errors are gone: error_register is written to 1001h,
  // and errors are added to 1003h, whatever the result. info: manufacturer bytes; missing bytes are
  // 0, bytes after the fifth are ignored.
  SendResult send(std::uint16_t code, std::uint8_t error_register, std::span<const std::byte> info,
                  Instant now);

  // Sends a message of another node as an EMCY of the own node (CiA 302-7): 1001h and 1003h are
  // unchanged.
  SendResult relay(const Message& message, Instant now);

  // The frame of the last message that was sent or queued.
  const can::Frame& newest() const { return newest_; }
  // Whether a message with that frame waits for the end of the inhibit time.
  bool waits(const can::Frame& frame) const;

  // The value of object 1001h.
  std::uint8_t error_register() const;
  // Sets 1001h without a message: for when some of several errors are gone.
  void set_error_register(std::uint8_t value);
  ErrorHistory& history() { return history_; }

  // Sends messages that waited for the end of the inhibit time.
  void advance(Instant now);
  Instant next_wake() const { return active_ && waiting_ > 0 ? inhibited_until_ : kNever; }

  AbortCode check_write(od::Address address, std::span<const std::byte> value) override;
  void written(od::Address address) override;

 private:
  can::CobId cob_id() const;
  bool transmit(const Message& message, Instant now);
  void follow_cob_id();
  event::FdEmcy fd_fields(std::uint16_t code, Instant now) const;

  od::Dictionary& dictionary_;
  can::TransmitQueue& transmit_;
  EventLog& events_;
  std::uint8_t node_id_;
  SentReporter* reporter_ = nullptr;
  can::Dispatch* dispatch_ = nullptr;
  std::uint16_t index_ = 0;  // index of the target in dispatch
  can::CobId listened_{};    // the COB-ID registered there
  ErrorHistory history_;
  TimeSource time_of_day_;  // empty: classical EMCYs
  bool active_ = false;
  Instant inhibited_until_{};
  std::array<Message, kWaiting> ring_{};
  std::size_t head_ = 0;
  std::size_t waiting_ = 0;
  can::Frame newest_{};
};

}  // namespace linegate::emcy

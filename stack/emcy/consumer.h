// SPDX-License-Identifier: Apache-2.0
// The EMCY consumer (CiA 301, 7.2.7): reports emergency messages of other nodes as events.
#pragma once

#include <array>
#include <cstdint>

#include "stack/base/event_log.h"
#include "stack/base/time.h"
#include "stack/can/cob_id.h"
#include "stack/can/dispatch.h"
#include "stack/can/frame.h"
#include "stack/emcy/message.h"

namespace linegate::emcy {

// Called within receive(), after the event was emitted.
class Listener {
 public:
  virtual ~Listener() = default;
  virtual void emergency(std::uint8_t node, const Message& message, Instant now) = 0;
};

// Emits event::Emcy. node is 1..127 everywhere; other values have no effect.
class Consumer {
 public:
  // Registers its frames as Service::emcy with index = mark | node-ID: with different marks
  // (multiples of 128) several consumers share one dispatch. Both must outlive this object.
  Consumer(can::Dispatch& dispatch, EventLog& events, std::uint16_t mark = 0);
  ~Consumer();
  Consumer(const Consumer&) = delete;
  Consumer& operator=(const Consumer&) = delete;

  void set_listener(Listener* listener) { listener_ = listener; }
  // Receives EMCYs of CANopen FD, too, see message.h.
  void accept_fd() { accepts_fd_ = true; }

  // Registers for the node's messages on cob_id; an invalid or restricted one has the effect of
  // ignore().
  void listen(std::uint8_t node, can::CobId cob_id);
  // Registers for all nodes except the own one, on 80h + node-ID.
  void listen_all(std::uint8_t own);
  void ignore(std::uint8_t node);

  // A frame of the node, received at frame.time. Returns false, without an effect, if it does not
  // have the length of an EMCY: the owner reports it.
  bool receive(std::uint8_t node, const can::Frame& frame);

  // Number of messages received.
  std::uint64_t received() const { return received_; }

 private:
  can::Dispatch& dispatch_;
  EventLog& events_;
  std::uint16_t mark_;
  Listener* listener_ = nullptr;
  bool accepts_fd_ = false;
  std::uint64_t received_ = 0;
  std::array<can::CobId, can::kMaxNodeId + 1> cob_ids_{};  // invalid = not registered
};

}  // namespace linegate::emcy

// SPDX-License-Identifier: Apache-2.0
// The SRDOs that the nodes of a line transmit: their frames, their times, and an event at each
// change of a safety state. The values go to the image by the Listener.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "stack/base/event_log.h"
#include "stack/base/time.h"
#include "stack/can/dispatch.h"
#include "stack/can/frame.h"
#include "stack/srdo/receiver.h"

namespace linegate::srdo {

// An SRDO to receive.
struct Source {
  std::uint8_t node = 0;     // that transmits it
  std::uint8_t number = 0;   // of the node's SRDO, 1..64
  std::uint8_t length = 0;   // of each frame in bytes
  std::uint16_t cob_id = 0;  // COB-ID 1
  std::uint16_t inverted_cob_id = 0;
  Duration validation{};  // SRVT
  Duration cycle{};       // SCT
  // Of its parameters, see srdo::signature(); nothing if the device has no 13FFh for it.
  std::optional<std::uint16_t> signature{};
};

class Listener {
 public:
  Listener() = default;
  Listener(const Listener&) = delete;
  Listener& operator=(const Listener&) = delete;
  virtual ~Listener() = default;

  // A valid pair was received. source: position in Consumer::sources(); normal:
  // Receiver::normal().
  virtual void srdo_received(std::size_t source, const can::Frame& normal) = 0;
  // The SRDO was valid and is unsafe now.
  virtual void srdo_unsafe(std::size_t source) = 0;
};

// Sums over all SRDOs.
struct Counters {
  std::uint64_t pairs = 0;   // valid ones
  std::uint64_t faults = 0;  // changes from valid to unsafe
};

class Consumer {
 public:
  // Registers the COB-IDs with Service::srdo. All references must outlive it.
  Consumer(can::Dispatch& dispatch, EventLog& events, Listener& listener,
           std::vector<Source> sources);

  // target: index of the target with Service::srdo. Returns true if a valid pair is complete.
  bool receive(std::uint16_t target, const can::Frame& frame);
  // The value that 13FFh of the device has for this SRDO. Precondition: the source exists.
  void check_signature(std::size_t source, std::uint16_t found, Instant now);
  void advance(Instant now);
  // See Receiver::forget(). Its event has the time of the last call of receive() or advance().
  void forget(std::size_t source);
  Instant next_wake() const;

  // The position in sources() of a target.
  static std::size_t source_of(std::uint16_t target) { return target / 2U; }
  std::span<const Source> sources() const { return sources_; }
  // Fault::none: valid. Precondition: the source exists.
  Fault fault(std::size_t source) const { return receivers_[source].fault(); }
  const Counters& counters() const { return counters_; }

 private:
  void expire(std::size_t source, Instant received);
  void follow(std::size_t source, Fault before, Instant now);

  EventLog& events_;
  Listener& listener_;
  std::vector<Source> sources_;
  std::vector<Receiver> receivers_;
  Counters counters_;
  Instant now_{};
};

}  // namespace linegate::srdo

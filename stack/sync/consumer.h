// SPDX-License-Identifier: Apache-2.0
// The SYNC consumer (CiA 301, 7.2.5): checks received SYNCs and detects missing ones.
#pragma once

#include <cstdint>
#include <utility>

#include "stack/base/event_log.h"
#include "stack/base/time.h"
#include "stack/can/dispatch.h"
#include "stack/can/frame.h"
#include "stack/sync/parameters.h"

namespace linegate::sync {

struct Reception {
  bool is_sync = false;        // it counts as a SYNC
  std::uint8_t counter = 0;    // 0 = without counter
  bool wrong_length = false;   // not the length required by 1019h: malformed
  bool wrong_counter = false;  // 0, or above 1019h: malformed, counts as a SYNC without counter
  bool error_begins = false;   // the first wrong length after a right one: EMCY 8240h
};

class Consumer {
 public:
  // Registers the COB-ID as Service::sync, index 0, unless the device is a producer. Both must
  // outlive the consumer.
  Consumer(can::Dispatch& dispatch, EventLog& events);
  ~Consumer();
  Consumer(const Consumer&) = delete;
  Consumer& operator=(const Consumer&) = delete;

  // Event::node of sync_lost; initially 0, the line.
  void set_node_id(std::uint8_t id) { node_id_ = id; }
  void configure(const Parameters& parameters);
  // False in Stopped and Initialising: then no SYNC is expected.
  void set_active(bool active);
  // While suspended no SYNC is missed; those received count.
  void set_suspended(bool suspended) {
    suspended_ = suspended;
    deadline_ = kNever;
  }

  // A frame on the COB-ID, received at frame.time. A missing or unexpected counter is a difference
  // in configuration: it is reported, but the frame counts as a SYNC (without counter). A longer
  // frame is not a SYNC.
  Reception receive(const can::Frame& frame);

  // With a period (1006h), emits sync_lost if no SYNC was received within 1.5 periods after the
  // previous one. Monitoring starts with the first SYNC.
  void advance(Instant now);
  Instant next_wake() const { return deadline_; }
  bool lost() const { return lost_; }

 private:
  void lose();
  bool consumes() const { return parameters_.exists && !parameters_.is_producer(); }
  void register_cob_id(bool wanted);

  can::Dispatch& dispatch_;
  EventLog& events_;
  Parameters parameters_;
  std::uint8_t node_id_ = 0;
  bool registered_ = false;
  bool active_ = false;
  bool suspended_ = false;
  bool length_was_wrong_ = false;
  bool lost_ = false;
  Instant deadline_ = kNever;
};

// Inline: the caller would otherwise stall on a result that is stored to memory byte by byte.
inline Reception Consumer::receive(const can::Frame& frame) {
  if (!active_ || !consumes()) {
    return {};
  }
  Reception out;
  out.wrong_length = frame.length != parameters_.length();
  out.error_begins = !std::exchange(length_was_wrong_, out.wrong_length) && out.wrong_length;
  out.is_sync = frame.length <= 1;
  if (!out.is_sync) {
    return out;
  }
  if (!out.wrong_length && frame.length == 1) {
    const auto counter = std::to_integer<std::uint8_t>(frame.data[0]);
    out.wrong_counter = counter == 0 || counter > parameters_.overflow;
    out.counter = out.wrong_counter ? std::uint8_t{0} : counter;
  }
  if (frame.time > deadline_) {
    lose();
  }
  lost_ = false;
  if (parameters_.period > Duration::zero() && !suspended_) {
    deadline_ = frame.time + parameters_.period + parameters_.period / 2;
  }
  return out;
}

}  // namespace linegate::sync

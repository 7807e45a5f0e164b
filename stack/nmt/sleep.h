// SPDX-License-Identifier: Apache-2.0
// Sleep of a whole network, as the emotas manual describes it for CiA 454 and CiA 447 (8.18): the
// NMT master checks whether all nodes may sleep, prepares them, and all fall asleep by timers.
//
// No public text has the messages, so these are defined here, with identifiers, bytes and times
// that are configured:
//   request identifier    byte 0: check, prepare or wake; the master sends check and prepare, any
//                         node wake
//   objection identifier  byte 0: objection; byte 1: node-ID of the node that objects
//
//   awake    all as usual
//   check    the master waits for objections for the check time; then awake, or prepare. Its time,
//            and that of prepare, begin when the bus acknowledged the message; without that within
//            the time, the master wakes again
//   prepare  the application is shut down, communication is possible; after the prepare time
//   silent.
//            An objection makes the master wake all nodes
//   silent   no frame is sent, frames are still received; after the silent time asleep
//   asleep   the first frame wakes the node
// Who wakes from prepare or later sends wake, unless that is what woke it, and boots.
#pragma once

#include <bitset>
#include <cstdint>
#include <utility>
#include <vector>

#include "stack/base/time.h"
#include "stack/can/frame.h"
#include "stack/nmt/sleep_protocol.h"

namespace linegate::nmt {

struct SleepChange {
  SleepPhase phase = SleepPhase::awake;
  SleepPhase before = SleepPhase::awake;
  SleepCause cause = SleepCause::command;
  std::uint8_t node = 0;  // that objected; else 0
  Instant time{};

  friend bool operator==(const SleepChange&, const SleepChange&) = default;
};

class Sleep {
 public:
  Sleep(const SleepProtocol& protocol, std::uint8_t own_node)
      : protocol_(protocol), own_node_(own_node) {}

  // Whether it sends check and prepare, and obeys none of them. A change ends a check.
  void set_master(bool master, Instant now);
  // Whether the own node objects to sleep: a slave from the next check or prepare on, a master also
  // at the end of a check.
  void set_objection(bool objects) { objects_ = objects; }
  bool objects() const { return objects_; }

  // Awake again, without a message: the line starts.
  void reset() { *this = Sleep(protocol_, own_node_); }

  // As master. Return false, without an effect, in another phase than awake.
  bool check(bool then_prepare, Instant now);
  bool prepare(Instant now);
  // Ends prepare, silent and asleep; also ends a check of the own master. Returns false if the node
  // is awake, or its master checks.
  bool wake(Instant now);
  // The own check or prepare is not acknowledged yet: call acknowledged() when the bus did so.
  bool awaits_acknowledge() const { return unacknowledged_; }
  // Byte 0 of that message.
  std::uint8_t awaited_byte() const {
    return phase_ == SleepPhase::check ? protocol_.check_byte : protocol_.prepare_byte;
  }
  void acknowledged(Instant now);
  // The own prepare is no longer waited for: wakes, unless it is acknowledged.
  void give_up(Instant now);
  // Neither the check nor objections reach their receivers: ends a check of the own master.
  void lose_bus(Instant now);

  // A frame with the request or objection identifier. Timers before frame.time count first. Returns
  // false if it is malformed.
  bool receive(const can::Frame& frame);
  // Call it with the receive time of any frame before the frame is processed, while sleeps() is
  // true: the frame wakes the node if it is asleep.
  void hear(Instant received);
  void advance(Instant now);
  Instant next_wake() const;

  SleepPhase phase() const { return phase_; }
  bool sleeps() const { return phase_ >= SleepPhase::prepare; }
  bool may_transmit() const { return phase_ < SleepPhase::silent; }
  // Nodes that objected since the last check or prepare.
  const std::bitset<128>& objections() const { return objections_; }

  // The changes of the phase since the last call, and the frames to send, in their order.
  std::vector<SleepChange> pop_changes() { return std::exchange(changes_, {}); }
  std::vector<can::Frame> pop_frames() { return std::exchange(frames_, {}); }

 private:
  void enter(SleepPhase phase, SleepCause cause, Instant now, std::uint8_t node = 0);
  void wake(SleepCause cause, Instant now, std::uint8_t node = 0);
  void receive_request(std::uint8_t code, Instant now);
  void object();
  void end_check(Instant now);
  void end_prepare(Instant end, Instant now);
  Duration time_of(SleepPhase phase) const;
  void send(std::uint8_t code);

  SleepProtocol protocol_;
  std::uint8_t own_node_;
  bool master_ = true;
  bool objects_ = false;
  bool then_prepare_ = false;
  bool unacknowledged_ = false;
  SleepPhase phase_ = SleepPhase::awake;
  Instant until_ = kNever;  // end of the phase
  std::bitset<128> objections_;
  std::vector<SleepChange> changes_;
  std::vector<can::Frame> frames_;
};

}  // namespace linegate::nmt

// SPDX-License-Identifier: Apache-2.0
// The queue of a line's events: services emit them, the line takes them out.
//
// A ring of fixed size. Events are numbered before any can be lost: when the ring is full, new
// events are counted, and as soon as there is room one EventKind::events_lost with the range of
// lost numbers takes their place in the sequence, with the number of the last lost one.
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "stack/base/event.h"
#include "stack/base/repeat_limit.h"

namespace linegate {

// Called with each event when it gets its number, before it is taken. Must not emit events.
class EventListener {
 public:
  virtual ~EventListener() = default;
  virtual void emitted(const Event& event) = 0;
};

class EventLog {
 public:
  explicit EventLog(std::size_t capacity = 1024);
  // A log without entries of its own: forwards the events of one of the line's own devices to
  // `line`, which identifies the device by `device`. Events without a node-ID, and events with the
  // node-ID that the device has on the bus (see set_own_node()), get the node-ID `device`. `line`
  // must outlive it.
  EventLog(EventLog& line, std::uint8_t device) : line_(&line), device_(device) {}

  // From now on RepeatLimit suppresses repeated malformed_frame, bus_error, output_refused and
  // command_refused: a suppressed event gets no number and does not count as lost. object_written
  // is limited after kWritesAtOnce writes of one object in a second; the newest value always gets
  // an event. The same for command_accepted and output_owner.
  void limit_repeats();
  static constexpr std::uint32_t kWritesAtOnce = 8;
  // The same for sdo_transfer and sdo_abort of an observer.
  void limit_overheard();
  // listener must outlive the log, or be replaced with nullptr before.
  void set_listener(EventListener* listener) { listener_ = listener; }
  // For a log that forwards: the node-ID of the device on the bus, 0 = none.
  void set_own_node(std::uint8_t node) { own_node_ = node; }
  // Emits suppressed events that no later event has reported.
  void advance(Instant now);
  Instant next_wake() const { return next_wake_; }

  // Numbers and keeps the event. event.number is ignored. Never allocates, never fails.
  void emit(Event event);

  // Moves up to out.size() of the oldest events to out; returns their number.
  std::size_t take(std::span<Event> out);

  // Copies up to out.size() of the newest events to out, taken or not, oldest first; returns their
  // number (0 for a log that forwards). For the report of a violated assertion.
  std::size_t newest(std::span<Event> out) const;

  bool empty() const { return count_ == 0 && lost_first_ == 0; }
  std::uint64_t emitted() const { return next_number_ - 1; }
  std::uint64_t lost() const { return lost_total_; }

 private:
  enum Limited : std::size_t {
    kMalformed,
    kBusError,
    kOutputs,
    kCommands,
    kTransfer,
    kAbort,
    kWritten,
    kAccepted,
    kOwner,
    kUnanswered,
    kSafety,
    kFree
  };
  static Limited limit_of(EventKind kind);
  void number(Event event);
  void append(const Event& event);
  void append_loss_marker();

  EventListener* listener_ = nullptr;
  EventLog* line_ = nullptr;  // the log to forward to
  std::uint8_t device_ = 0;
  std::uint8_t own_node_ = 0;
  std::array<std::optional<RepeatLimit>, kFree + 1> limits_;  // [kFree] is never set
  Instant next_wake_ = kNever;                                // or earlier than needed
  std::vector<Event> ring_;
  std::size_t head_ = 0;
  std::size_t count_ = 0;
  std::uint64_t next_number_ = 1;
  std::uint64_t lost_first_ = 0;  // 0 = nothing lost since the last marker
  std::uint64_t lost_last_ = 0;
  std::uint64_t lost_total_ = 0;
  Instant lost_time_{};
};

}  // namespace linegate

// SPDX-License-Identifier: Apache-2.0
// Where a line's services put events, and from where the line hands them out.
//
// A ring of fixed size. Numbers are given here, before anything can be lost: when the ring is full
// new events are counted, and as soon as there is room one EventKind::events_lost with the lost
// range takes their place in the sequence, carrying the number of the last one lost.
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "stack/base/event.h"
#include "stack/base/repeat_limit.h"

namespace linegate {

// Told each event as it gets its number, before it is taken. Must not emit any.
class EventListener {
 public:
  virtual ~EventListener() = default;
  virtual void told(const Event& event) = 0;
};

class EventLog {
 public:
  explicit EventLog(std::size_t capacity = 1024);
  // Keeps nothing: hands on to `line` the events of one of its own devices, which the line calls
  // `device`. They have the node-ID `device` if they have none, or that of the device on the bus,
  // see set_own_node(). `line` must outlive it.
  EventLog(EventLog& line, std::uint8_t device) : line_(&line), device_(device) {}

  // From now on malformed_frame, bus_error, output_refused and command_refused are held back as
  // RepeatLimit says: such an event gets no number and is not lost. So is object_written, after
  // kWritesAtOnce of one object in a second; its newest value always gets an event.
  void limit_repeats();
  static constexpr std::uint32_t kWritesAtOnce = 8;
  // The same of sdo_transfer and sdo_abort, for who hears those of others.
  void limit_overheard();
  // listener must outlive the log, or nullptr be set before it goes.
  void set_listener(EventListener* listener) { listener_ = listener; }
  // Of a log that hands on: the node-ID that the device has on the bus, 0 = none.
  void set_own_node(std::uint8_t node) { own_node_ = node; }
  // Emits what was held back and nothing has told of meanwhile.
  void advance(Instant now);
  Instant next_wake() const { return next_wake_; }

  // Numbers and keeps the event. event.number is ignored. Never allocates, never fails.
  void emit(Event event);

  // Moves up to out.size() of the oldest events to out; gives how many.
  std::size_t take(std::span<Event> out);

  // Copies up to out.size() of the newest events to out, taken or not, oldest first; gives how
  // many. Of a log that hands on there are none. For what is printed when an assertion is violated.
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
    kFree
  };
  static Limited limit_of(EventKind kind);
  void number(Event event);
  void append(const Event& event);
  void append_loss_marker();

  EventListener* listener_ = nullptr;
  EventLog* line_ = nullptr;  // it hands on
  std::uint8_t device_ = 0;
  std::uint8_t own_node_ = 0;
  std::array<std::optional<RepeatLimit>, kFree + 1> limits_;  // of kFree there is never one
  Instant next_wake_ = kNever;                                // or earlier
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

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

  // From now on malformed_frame, bus_error, output_refused and command_refused are held back as
  // RepeatLimit says: such an event gets no number and is not lost.
  void limit_repeats();
  // The same of sdo_transfer and sdo_abort, for who hears those of others.
  void limit_overheard();
  // listener must outlive the log, or nullptr be set before it goes.
  void set_listener(EventListener* listener) { listener_ = listener; }
  // Events without a node-ID are of this node from now on; 0 = of the line.
  void set_own_node(std::uint8_t node) { own_node_ = node; }
  // Events of node-ID `heard` are of the own device that the line calls `called` from now on: LSS
  // gave it another node-ID than the configuration. 0: no longer. heard: 1..127.
  void call_node(std::uint8_t heard, std::uint8_t called) { called_[heard] = called; }
  // Emits what was held back and nothing has told of meanwhile.
  void advance(Instant now);
  Instant next_wake() const { return next_wake_; }

  // Numbers and keeps the event. event.number is ignored. Never allocates, never fails.
  void emit(Event event);

  // Moves up to out.size() of the oldest events to out; gives how many.
  std::size_t take(std::span<Event> out);

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
    kFree
  };
  static Limited limit_of(EventKind kind);
  void number(Event event);
  void append(const Event& event);
  void append_loss_marker();

  EventListener* listener_ = nullptr;
  std::uint8_t own_node_ = 0;
  std::array<std::uint8_t, 128> called_{};                    // by node-ID, 0 = as it is
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

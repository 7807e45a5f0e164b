// SPDX-License-Identifier: Apache-2.0
// A CAN bus in virtual time: arbitration by identifier and frame times as on the wire.
//
// Deterministic and passive. Endpoints submit frames; whenever the bus is free, the frame that wins
// arbitration among those submitted by then occupies it for its exact number of bits, and all other
// endpoints get it with the time of its last bit. An endpoint sends its own frames in the order in
// which it submitted them, as a controller behind a queue does, unless it has several transmit
// buffers. As on the kernel's vcan, a frame leaves even when nobody else is there to acknowledge
// it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <span>
#include <vector>

#include "stack/base/time.h"
#include "stack/can/frame.h"

namespace linegate::sim {

struct BusOptions {
  std::uint32_t bit_rate = 1'000'000;  // bit/s, > 0
  std::uint32_t data_bit_rate = 0;     // bit/s of the FD data phase; 0 = bit_rate
  std::size_t queue_depth = 8;         // frames an endpoint may have waiting
  std::size_t history = 4096;          // delivered frames kept for endpoints that read late
  // Transmit buffers of a controller: so many of the frames that an endpoint has waiting take part
  // in the arbitration, and may overtake each other. Those of one identifier keep their order.
  std::size_t buffers = 1;
};

// What becomes of a frame that is on the wire.
enum class Fate : std::uint8_t {
  delivered,
  lost,       // sent and acknowledged, but no endpoint gets it
  disturbed,  // destroyed by an error frame; sent again after arbitration
  doubled,    // all endpoints have it when an error in its very last bit makes the sender repeat it
};

class Bus {
 public:
  using Endpoint = std::size_t;
  using Disturbance = std::function<Fate(const can::Frame& frame, Endpoint sender)>;

  explicit Bus(const BusOptions& options);

  // A new end, which gets what is sent from now on. Numbers are used again after detach().
  Endpoint attach();
  // Frames it still has waiting are gone.
  void detach(Endpoint endpoint);
  // A pulled cable: neither sends nor receives; what is waiting to be sent keeps waiting, what was
  // received before can be taken until it is plugged in again. Connected at first. A time before
  // that of an earlier call counts as that one.
  void set_connected(Endpoint endpoint, bool connected, Instant now);
  bool connected(Endpoint endpoint) const { return ends_[endpoint].connected; }
  // Asked for every frame at its end. An empty function = everything is delivered.
  void set_disturbance(Disturbance disturbance);

  // Frames submit() would take.
  std::size_t room(Endpoint endpoint) const;
  // False when the endpoint has no room: not taken. A time before that of an earlier call counts as
  // that one.
  bool submit(Endpoint endpoint, const can::Frame& frame, Instant now);

  // Delivers every frame whose last bit is not after now.
  void advance(Instant now);
  // When the next frame ends, given what is submitted now; kNever if there is nothing to send. An
  // earlier answer may come after a submit() at the same instant.
  Instant next_wake() const;

  // Frames others sent, oldest first, whose time is not after until; gives how many.
  std::size_t take(Endpoint endpoint, std::span<can::Frame> out, Instant until = kNever);
  // The time of the first frame take() would give; kNever if none.
  Instant first_waiting(Endpoint endpoint) const;
  // Frames that passed the endpoint because it read too late, since the last call.
  std::uint64_t take_lost(Endpoint endpoint);
  // Frames of this endpoint that have left: never goes back.
  std::uint64_t sent(Endpoint endpoint) const;
  // All frames of this endpoint up to that number, counted from 1 in the order of submit(), have
  // left: never goes back.
  std::uint64_t acknowledged(Endpoint endpoint) const;
  // A controller that loses its frames: what is waiting to be sent is gone, and counts as left.
  void flush(Endpoint endpoint);

  // Time the wire was occupied, intermissions included, and frames that ended on it.
  Duration busy() const { return busy_; }
  std::uint64_t frames() const { return frames_; }
  // The time a frame occupies this bus without the intermission, and with it.
  Duration time_to_last_bit(const can::Frame& frame) const;
  Duration time_on_wire(const can::Frame& frame) const;

 private:
  struct Waiting {
    can::Frame frame;
    Instant submitted{};
    std::uint64_t number = 0;  // among the frames of its endpoint
  };
  struct End {
    bool attached = false;
    bool connected = true;
    std::deque<Waiting> queue;
    std::uint64_t cursor = 0;        // number of the next delivered frame to look at
    std::uint64_t limit = kNoLimit;  // frames from this number on passed while disconnected
    std::uint64_t lost = 0;
    std::uint64_t sent = 0;
    std::uint64_t submitted = 0;
  };
  struct Delivered {
    can::Frame frame;
    Endpoint sender = 0;
  };
  struct Turn {
    Endpoint sender = 0;
    std::size_t place = 0;  // in its queue
    Instant start{};
  };
  static constexpr std::uint64_t kNoLimit = ~std::uint64_t{0};

  bool may_send(const End& end) const {
    return end.attached && end.connected && !end.queue.empty();
  }
  // Where the most urgent frame in the transmit buffers of an end is, of those submitted by then.
  // Precondition: the first is.
  std::size_t most_urgent(const End& end, Instant by) const;
  bool next_turn(Turn& turn) const;
  const can::Frame& frame_of(const Turn& turn) const {
    return ends_[turn.sender].queue[turn.place].frame;
  }
  void finish(const Turn& turn, Instant end);
  void deliver(Endpoint sender, const can::Frame& frame, Instant time);
  // The number of the next frame for this endpoint, or its limit.
  std::uint64_t next_for(Endpoint endpoint) const;
  std::uint64_t oldest_kept() const;

  BusOptions options_;
  Disturbance disturbance_;
  std::vector<End> ends_;
  std::vector<Delivered> history_;  // ring; number n is at n % size
  std::uint64_t delivered_ = 0;     // number of the next one
  Instant free_at_{};
  Instant latest_{};
  Duration busy_{};
  std::uint64_t frames_ = 0;
};

}  // namespace linegate::sim

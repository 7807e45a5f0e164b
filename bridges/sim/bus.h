// SPDX-License-Identifier: Apache-2.0
// A CAN bus in virtual time: arbitration by identifier, and frame times as on the wire.
//
// Deterministic and passive. Endpoints submit frames. Whenever the bus is free, the frame that wins
// arbitration among the submitted ones occupies it for its exact number of bits, and all other
// endpoints receive it with the time of its last bit. An endpoint sends its own frames in the order
// of submission, as a controller behind a queue does, unless it has several transmit buffers. As
// with the kernel's vcan, a frame is sent even if no other endpoint acknowledges it.
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
  std::size_t queue_depth = 8;         // frames that an endpoint may queue
  std::size_t history = 4096;  // delivered frames that are kept for endpoints that read late
  // Transmit buffers of a controller: this many of an endpoint's queued frames take part in the
  // arbitration and may overtake each other. Frames with the same identifier keep their order.
  std::size_t buffers = 1;
};

// The outcome of a frame on the wire.
enum class Fate : std::uint8_t {
  delivered,
  lost,       // sent and acknowledged, but received by no endpoint
  disturbed,  // destroyed by an error frame; retransmitted after arbitration
  doubled,    // received by all endpoints, and retransmitted because of an error in its last bit
};

class Bus {
 public:
  using Endpoint = std::size_t;
  using Disturbance = std::function<Fate(const can::Frame& frame, Endpoint sender)>;

  explicit Bus(const BusOptions& options);

  // Adds an endpoint, which receives what is sent from now on. detach() frees its number for reuse.
  Endpoint attach();
  // Discards the frames that the endpoint has queued.
  void detach(Endpoint endpoint);
  // false: the cable is unplugged, so that the endpoint neither sends nor receives. Its queued
  // frames stay queued, and frames that it received before can be taken until it is plugged in
  // again. Endpoints start connected. A `now` before that of an earlier call counts as that one.
  void set_connected(Endpoint endpoint, bool connected, Instant now);
  bool connected(Endpoint endpoint) const { return ends_[endpoint].connected; }
  // Called for every frame when it ends. An empty function delivers every frame.
  void set_disturbance(Disturbance disturbance);

  // Number of frames that submit() would accept.
  std::size_t room(Endpoint endpoint) const;
  // Returns false, without queueing the frame, if the endpoint has no room. A `now` before that of
  // an earlier call counts as that one.
  bool submit(Endpoint endpoint, const can::Frame& frame, Instant now);

  // Delivers every frame that ends at `now` or earlier.
  void advance(Instant now);
  // When the next frame ends, as far as frames are queued now; kNever if none is. A submit() at the
  // same instant may make it earlier.
  Instant next_wake() const;

  // Moves received frames with a time up to `until` to `out`, oldest first, and returns their
  // number.
  std::size_t take(Endpoint endpoint, std::span<can::Frame> out, Instant until = kNever);
  // The time of the first frame that take() would return; kNever if none.
  Instant first_waiting(Endpoint endpoint) const;
  // Number of frames since the last call that the endpoint missed because it read too late.
  std::uint64_t pop_lost(Endpoint endpoint);
  // Number of frames that this endpoint has sent. Never decreases.
  std::uint64_t sent(Endpoint endpoint) const;
  // Every frame of this endpoint up to this number has been sent. Frames are counted from 1 in the
  // order of submit(). Never decreases.
  std::uint64_t acknowledged(Endpoint endpoint) const;
  // Discards the endpoint's queued frames, as a controller does at bus-off; they count as sent.
  void flush(Endpoint endpoint);

  // The time for which the wire was occupied, intermissions included, and the number of frames that
  // ended.
  Duration busy() const { return busy_; }
  std::uint64_t frames() const { return frames_; }
  // How long a frame occupies the bus, without and with the intermission.
  Duration time_to_last_bit(const can::Frame& frame) const;
  Duration time_on_wire(const can::Frame& frame) const;

 private:
  struct Waiting {
    can::Frame frame;
    Instant submitted{};
    std::uint64_t number = 0;  // frame number within its endpoint
  };
  struct End {
    bool attached = false;
    bool connected = true;
    std::deque<Waiting> queue;
    std::uint64_t cursor = 0;  // number of the next delivered frame to examine
    // Frames from this number on were delivered while it was disconnected
    std::uint64_t limit = kNoLimit;
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
    std::size_t place = 0;  // position in its queue
    Instant start{};
  };
  static constexpr std::uint64_t kNoLimit = ~std::uint64_t{0};

  bool may_send(const End& end) const {
    return end.attached && end.connected && !end.queue.empty();
  }
  // Position of the most urgent frame in the endpoint's transmit buffers that was submitted at `by`
  // or earlier. Precondition: the first frame was.
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

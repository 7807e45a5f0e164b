// SPDX-License-Identifier: Apache-2.0
// A CAN channel: one end of a bus, as the gateway's executor drives it. Passive: it starts no
// thread and never blocks; whoever owns the thread waits for the descriptor and for next_wake().
//
// How to drive it:
//   - wait until descriptor() is readable (EPOLLIN, EPOLLERR and EPOLLHUP count the same; EPOLLOUT
//     too while wants_writable()) or next_wake() has come, then call read();
//   - read until it gives fewer frames than there was room for: then the channel is drained;
//   - ask descriptor() again after each read(): it is -1 while there is nothing to wait for but
//     next_wake(), and never changes from one descriptor to another without being -1 in between;
//   - whenever room() > 0 pull up to that many frames from the line and write() them. What write()
//     did not take stays with the caller and goes first the next time.
// A new channel has next_wake() in the past: the first read() opens it.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>

#include "bridges/can/controller_setup.h"
#include "stack/base/time.h"
#include "stack/can/bus_state.h"
#include "stack/can/frame.h"

namespace linegate::can_bridge {

// What a channel observed besides frames during one read(), in order of occurrence, each with its
// position among the frames of that read(). The size is fixed: read() stops before it could
// overflow, so no event is lost. Clear it before each read().
class BusEvents {
 public:
  static constexpr std::size_t kCapacity = 32;
  // The largest number of events that one frame can cause.
  static constexpr std::size_t kPerFrame = 4;

  // Appends an event. Consecutive errors are merged into one event (errors or-ed, counts added),
  // and so are consecutive losses, so that a burst of error frames stays small. Time and position
  // are those of the last one. Precondition: room() > 0.
  void push(const can::BusEvent& event);
  // read() has returned `count` more frames; they precede every event that is pushed later.
  void frames_given(std::size_t count) { frames_ += count; }

  std::span<const can::BusEvent> view() const { return {events_.data(), count_}; }
  // Number of frames of this read() that precede view()[event]. Never decreases along view().
  std::size_t frames_before(std::size_t event) const { return frames_before_[event]; }
  std::size_t room() const { return kCapacity - count_; }
  bool empty() const { return count_ == 0; }
  void clear() { count_ = frames_ = 0; }

 private:
  std::size_t count_ = 0;  // first: a read() without events uses only these two
  std::size_t frames_ = 0;
  std::array<can::BusEvent, kCapacity> events_{};
  std::array<std::size_t, kCapacity> frames_before_{};
};

// Counters that never decrease, not even when the interface fails and returns. `acknowledged`,
// `skipped` and `flushed` are frame numbers, counted from 1 in the order in which write() accepted
// the frames, refused ones included.
struct ChannelCounters {
  // Every frame up to this number was acknowledged on the bus, except those that were refused,
  // skipped or flushed. On a bus that does not report acknowledgements, a frame counts as
  // acknowledged when the bus accepts it.
  std::uint64_t acknowledged = 0;
  // The fate of the frames up to this number that were not reported as acknowledged is unknown: a
  // later frame was acknowledged first.
  std::uint64_t skipped = 0;
  // The frames up to this number that were not acknowledged by then are lost: the interface failed,
  // or its controller went bus-off.
  std::uint64_t flushed = 0;
  std::uint64_t received = 0;   // frames that read() returned
  std::uint64_t sent = 0;       // frames that write() accepted
  std::uint64_t confirmed = 0;  // own frames that were seen on the bus
  std::uint64_t refused = 0;    // frames that this channel can never send: accepted and dropped
  std::uint64_t lost = 0;       // frames the kernel or controller lost before read()
  // Number of times that write() could not accept every frame (ENOBUFS, EAGAIN)
  std::uint64_t stalled = 0;
  std::uint64_t malformed = 0;  // received datagrams that are not CAN frames

  // Number of frames that write() accepted.
  std::uint64_t taken() const { return sent + refused; }
};

class Channel {
 public:
  virtual ~Channel() = default;

  // A descriptor for epoll, or -1 while the interface is not open.
  virtual int descriptor() const = 0;

  // Returns received frames, oldest first, at most out.size(). Receive times never decrease. A
  // receive time may be later than `now`, because frames that arrived after the caller read the
  // clock are included. Own frames are excluded. read() also opens the interface, detects failures
  // and retries. Each event in `events` states which frames precede it:
  //   interface_failed  once for each failure; code: errno, see describe_failure()
  //   interface_ready   after the first successful opening, and after each failure
  //   state             on every change; stopped or absent after interface_failed
  //   error, frames_lost
  virtual std::size_t read(std::span<can::Frame> out, BusEvents& events, Instant now) = 0;
  // The last read() returned early, although `out` had room and more datagrams may be pending: it
  // examines a bounded number of datagrams that are not frames for the caller, and on a bus that
  // reports acknowledgements it ends with that of an own NMT command (COB-ID 0). So frames before
  // and after a command on the bus are not returned together.
  virtual bool more() const { return false; }

  // Sends the frames in order and returns how many it accepted, from the first on. Fewer than given
  // is back-pressure, never loss. Frames that the channel can never send (CAN FD on a classical
  // interface, an impossible length) are accepted, counted as refused, and dropped.
  virtual std::size_t write(std::span<const can::Frame> frames, Instant now) = 0;

  // Number of frames that write() would accept at `now`, as far as known. 0 while the interface is
  // unusable, its queue is full, or back-pressure lasts. Increases in read() and at next_wake().
  virtual std::size_t room(Instant now) const = 0;

  // Back-pressure ends when the descriptor becomes writable: wait for EPOLLOUT.
  virtual bool wants_writable() const = 0;

  // When to call read() although the descriptor is not readable; kNever if never.
  virtual Instant next_wake() const = 0;

  // The same object for the lifetime of the channel.
  virtual const ChannelCounters& counters() const = 0;

  // Restarts a controller that is bus-off; the following read()s report the outcome. Returns 0, or
  // errno: EBUSY: the controller is not bus-off; EOPNOTSUPP: there is no controller; EPERM:
  // CAP_NET_ADMIN is missing.
  virtual int restart(Instant now);

  // Changes the simulated faults of a virtual bus, in the syntax of change_faults()
  // (virtual_faults.h); an empty text changes nothing. Returns 0 with all faults of the bus in
  // `said`; EINVAL with an error message in `said`; EOPNOTSUPP: a real bus.
  virtual int fault(std::string_view change, std::string& said, Instant now);

  // The settings of the controller at the last interface_ready. Members that are 0 or absent are
  // unknown, as on a bus without a controller.
  virtual ControllerSetup settings() const { return {}; }

  // Whether the channel can send CAN FD frames, as far as known.
  virtual bool carries_fd() const { return true; }
};

// The code of an interface_failed event in words, with a remedy where there is one: "no such
// interface: can9".
std::string describe_failure(std::string_view interface, std::uint32_t code);

}  // namespace linegate::can_bridge

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

// What a channel noticed besides frames, in the order in which it happened, and between which of
// the frames of the same read(). Of fixed size; read() stops reading before it could overflow, so
// nothing is lost here. To be cleared before each read().
class BusEvents {
 public:
  static constexpr std::size_t kCapacity = 32;
  // The most events one frame can cause.
  static constexpr std::size_t kPerFrame = 4;

  // Appends it. Consecutive errors become one event (errors or-ed, count added), as do consecutive
  // losses, so that a storm of error frames stays small; its time and place among the frames are
  // those of the last. Precondition: room() > 0.
  void push(const can::BusEvent& event);
  // read() gives so many frames more, which came before what is pushed from now on.
  void frames_given(std::size_t count) { frames_ += count; }

  std::span<const can::BusEvent> view() const { return {events_.data(), count_}; }
  // How many frames of this read() came before view()[event]; never decreases along view().
  std::size_t frames_before(std::size_t event) const { return frames_before_[event]; }
  std::size_t room() const { return kCapacity - count_; }
  bool empty() const { return count_ == 0; }
  void clear() { count_ = frames_ = 0; }

 private:
  std::array<can::BusEvent, kCapacity> events_{};
  std::array<std::size_t, kCapacity> frames_before_{};
  std::size_t count_ = 0;
  std::size_t frames_ = 0;
};

// Plain counters; they never go back, also when the interface does. `acknowledged` and `flushed`
// are numbers of frames, counted from 1 in the order in which write() took them, refused ones
// included.
struct ChannelCounters {
  // All up to this one were acknowledged on the bus, but those that were refused, skipped or
  // flushed. A bus that reports no acknowledgement acknowledges what it takes.
  std::uint64_t acknowledged = 0;
  // Of those up to this one whose acknowledgement was not reported before, nothing is known: a
  // later one was acknowledged instead.
  std::uint64_t skipped = 0;
  // Those up to this one that had not been acknowledged then are lost: the interface failed, or its
  // controller went off the bus.
  std::uint64_t flushed = 0;
  std::uint64_t received = 0;   // frames given by read()
  std::uint64_t sent = 0;       // frames taken by write()
  std::uint64_t confirmed = 0;  // own frames that are known to have been on the bus
  std::uint64_t refused = 0;    // frames this channel can never send: taken and dropped
  std::uint64_t lost = 0;       // frames the kernel or controller lost before read()
  std::uint64_t stalled = 0;    // times write() could not take all (ENOBUFS, EAGAIN)
  std::uint64_t malformed = 0;  // what was received is no CAN frame

  // Frames that write() took.
  std::uint64_t taken() const { return sent + refused; }
};

class Channel {
 public:
  virtual ~Channel() = default;

  // Pollable, or -1 while there is none.
  virtual int descriptor() const = 0;

  // What arrived, oldest first, each frame with its receive time (never before that of the frame
  // given before it), at most out.size(). It may be later than `now`: what arrived since the caller
  // looked at the clock is read, too. Also opens, notices failures, and tries again.
  // Frames this channel sent are not among them. Events say which frames came before them; kinds:
  //   interface_failed  once per failure; code: errno, see describe_failure()
  //   interface_ready   after the first opening and after each failure that is over
  //   state             on every change; stopped or absent after interface_failed
  //   error, frames_lost
  virtual std::size_t read(std::span<can::Frame> out, BusEvents& events, Instant now) = 0;
  // The last read() returned although more may have arrived and `out` had room: it looks at a
  // bounded number of things that are no frames for the caller.
  virtual bool more() const { return false; }

  // Sends in the given order; gives how many of the first frames were taken. Fewer than given:
  // back-pressure, never loss. Frames the channel can never send (FD on a classical interface,
  // impossible length) are taken, counted as refused, and dropped.
  virtual std::size_t write(std::span<const can::Frame> frames, Instant now) = 0;

  // How many frames write() would take now as far as is known. 0 while the interface cannot be
  // used, the queue holds enough, or back-pressure lasts. Grows in read(), and at next_wake().
  virtual std::size_t room(Instant now) const = 0;

  // Back-pressure ends when the descriptor becomes writable.
  virtual bool wants_writable() const = 0;

  // When read() wants to be called although the descriptor is not readable; kNever if never.
  virtual Instant next_wake() const = 0;

  virtual const ChannelCounters& counters() const = 0;

  // Brings a controller that is off the bus back; what comes of it is told by the next read()s.
  // 0, or errno: EBUSY: it is not off the bus; EOPNOTSUPP: there is no controller; EPERM: not
  // permitted (CAP_NET_ADMIN).
  virtual int restart(Instant now);

  // Changes the faults of a bus that has none of its own, as change_faults() (virtual_faults.h)
  // reads it; an empty text changes nothing. 0, and all its faults in `said`; EINVAL, and a
  // sentence about what is wrong; EOPNOTSUPP: this bus has its own.
  virtual int fault(std::string_view change, std::string& said, Instant now);

  // What the controller was set to when interface_ready was told last; what is 0 or absent is not
  // known, as with a bus that has no controller.
  virtual ControllerSetup settings() const { return {}; }

  // Whether it can send CAN FD frames, as far as is known.
  virtual bool carries_fd() const { return true; }
};

// The code of an interface_failed event in words, with what to do about it where there is
// something: "no such interface: can9".
std::string describe_failure(std::string_view interface, std::uint32_t code);

}  // namespace linegate::can_bridge

// SPDX-License-Identifier: Apache-2.0
#include "bridges/can/socket_channel.h"

#include <algorithm>
#include <cerrno>
#include <utility>

#include <linux/can/error.h>
#include <net/if.h>

#include "bridges/can/frame_codec.h"
#include "bridges/can/interface.h"
#include "bridges/can/sendable.h"
#include "stack/can/cob_id.h"

namespace linegate::can_bridge {
namespace {

using can::BusEvent;
using can::BusState;

// Pause after ENOBUFS: about the time to send a few frames. No event signals that there is room.
constexpr Duration kNoBuffersPause = std::chrono::milliseconds(1);

bool again(int error) {
  return error == EAGAIN || error == EWOULDBLOCK || error == EINTR;
}

// The state to report after the interface failed with that errno.
BusState state_after(int error) {
  switch (error) {
    case ENETDOWN:
      return BusState::stopped;
    case EPERM:
    case EACCES:
      return BusState::unknown;
    default:
      return BusState::absent;
  }
}

}  // namespace

SocketChannel::SocketChannel(std::string interface, const SocketOptions& options)
    : adopted_(false),
      window_(options.queue_depth),
      interface_(std::move(interface)),
      options_(options) {
}

SocketChannel::SocketChannel(int descriptor) : adopted_(true), window_(TransmitWindow::kMaxDepth) {
  fd_ = true;
  socket_.reset(descriptor);
}

int SocketChannel::restart(Instant /*now*/) {
  if (adopted()) {
    return EOPNOTSUPP;
  }
  return bus_off() ? restart_controller(static_cast<int>(::if_nametoindex(interface_.c_str())))
                   : EBUSY;
}

// --- opening and failing ------------------------------------------------------------------------

void SocketChannel::open(BusEvents& events, Instant now) {
  if (adopted()) {
    report_ready(BusState::error_active, events, now);
    return;
  }
  const OpenedInterface opened =
      open_interface(interface_, options_.receive_buffer, options_.setup);
  if (opened.error != 0) {
    fail(opened.error, events, now);
    return;
  }
  socket_.reset(opened.descriptor);
  fd_ = opened.fd;
  settings_ = opened.settings;
  report_ready(opened.state, events, now);
}

void SocketChannel::report_ready(BusState state, BusEvents& events, Instant now) {
  ready_ = true;
  reported_ = 0;
  dropped_ = 0;
  flush_window();
  BusEvent event;
  event.kind = BusEvent::Kind::interface_ready;
  event.time = now;
  events.push(event);
  errors_.set_state(state, now, events);
}

void SocketChannel::fail(int error, BusEvents& events, Instant now) {
  socket_.reset(-1);
  flush_window();
  const bool was_ready = std::exchange(ready_, false);
  failure_ = 0;
  wants_writable_ = false;
  batch_next_ = batch_end_ = 0;
  // An interface that worked until now may have been set down and up: retry at once.
  const Duration pause = was_ready ? Duration{} : options_.retry_period;
  retry_at_ = adopted() ? kNever : now + pause;
  if (error == reported_) {
    return;
  }
  reported_ = error;
  BusEvent event;
  event.kind = BusEvent::Kind::interface_failed;
  event.code = static_cast<std::uint32_t>(error);
  event.time = now;
  events.push(event);
  errors_.set_state(state_after(error), now, events);
}

// --- receiving ----------------------------------------------------------------------------------

// The three parts of read() are called from one place each.

// Returns true if it is a frame for the caller.
[[gnu::hot, gnu::always_inline]] inline bool SocketChannel::take(
    const FrameSocket::Received& received, can::Frame& out, BusEvents& events, Instant now) {
  const Instant time = clock_.instant(received.stamp_ns, received.hardware_ns);
  if (received.has_dropped && received.dropped != dropped_) {
    count_dropped(received.dropped, events, time);
  }
  if (received.bytes == 0 && adopted()) {
    failure_ = EPIPE;
    return false;
  }
  if (received.bytes >= CAN_MTU && (received.raw->can_id & CAN_ERR_FLAG) != 0) {
    receive_error_frame(*received.raw, events, time);
    return false;
  }
  if (!decode(*received.raw, received.bytes, out)) {
    ++counters_.malformed;
    return false;
  }
  if (received.own) {
    counters_.confirmed += window_.confirmed(out, now);
    counters_.acknowledged = window_.confirmed_to();
    counters_.skipped = window_.skipped_to();
    write_again_ = Instant{};
    ends_ = out.id == can::kNmtId && !out.extended();
    return false;
  }
  if (bus_off()) {
    // A controller that receives has recovered, whether its driver reported it or not.
    errors_.set_state(BusState::error_active, time, events);
  }
  out.time = time;
  return true;
}

[[gnu::hot, gnu::always_inline]] inline std::size_t SocketChannel::receive_batch(
    std::span<can::Frame> out, BusEvents& events, Instant now) {
  std::size_t count = 0;
  while (batch_next_ < batch_end_ && !ends_ && count < out.size() &&
         events.room() >= BusEvents::kPerFrame) {
    const bool given = take(socket_.received(batch_next_++), out[count], events, now);
    count += given ? 1U : 0U;
    events.frames_given(given ? 1U : 0U);
  }
  return count;
}

// Reads the next batch. Returns false if nothing is left to read. If the interface failed after
// frames were received, those frames are returned first and the failure is reported afterwards.
[[gnu::hot, gnu::always_inline]] inline bool SocketChannel::refill(std::size_t room) {
  if (drained_) {
    return false;
  }
  const std::size_t wanted = std::min(room, FrameSocket::kBatch);
  int got = socket_.receive(wanted);
  if (got < 0 && !again(-got)) {
    failure_ = -got;
    got = socket_.receive(wanted);
  }
  if (got <= 0) {
    return false;
  }
  clock_.begin_batch();
  batch_next_ = 0;
  batch_end_ = static_cast<std::size_t>(got);
  drained_ = batch_end_ < wanted;
  return true;
}

[[gnu::hot]] std::size_t SocketChannel::read(std::span<can::Frame> out, BusEvents& events,
                                             Instant now) {
  wants_writable_ = false;
  if (now >= write_again_) {
    write_again_ = Instant{};
  }
  stall_seen_ = now >= window_.next_try();
  if (events.room() < BusEvents::kPerFrame) {
    return 0;
  }
  if (!ready_ && now >= retry_at_) {
    open(events, now);
  }
  std::size_t count = 0;
  bool empty = false;
  drained_ = false;
  ends_ = false;
  while (ready_ && !ends_ && count < out.size() && events.room() >= BusEvents::kPerFrame) {
    empty = batch_next_ == batch_end_ && !refill(out.size() - count);
    if (empty) {
      break;
    }
    count += receive_batch(out.subspan(count), events, now);
  }
  if (failure_ != 0 && empty) {
    fail(failure_, events, std::max(now, clock_.latest()));
  }
  counters_.received += count;
  return count;
}

void SocketChannel::count_dropped(std::uint32_t dropped, BusEvents& events, Instant time) {
  BusEvent event;
  event.kind = BusEvent::Kind::frames_lost;
  event.count = dropped - dropped_;
  event.time = time;
  events.push(event);
  counters_.lost += event.count;
  dropped_ = dropped;
}

void SocketChannel::receive_error_frame(const canfd_frame& raw, BusEvents& events, Instant time) {
  errors_.decode(raw, time, events);
  if ((raw.can_id & (CAN_ERR_BUSOFF | CAN_ERR_RESTARTED)) != 0) {
    flush_window();
  }
}

// The controller has discarded its queued frames.
void SocketChannel::flush_window() {
  window_.clear();
  counters_.flushed = counters_.taken();
}

// --- sending ------------------------------------------------------------------------------------

[[gnu::hot]] inline std::size_t SocketChannel::room_now(Instant now) const {
  if (!usable() || bus_off() || wants_writable_ || now < write_again_) {
    return 0;
  }
  return adopted() ? FrameSocket::kBatch : window_.room(now);
}

[[gnu::hot]] std::size_t SocketChannel::room(Instant now) const {
  return room_now(now);
}

std::size_t SocketChannel::sendable_prefix(std::span<const can::Frame> frames) const {
  const auto end = std::ranges::find_if_not(
      frames, [this](const can::Frame& frame) { return sendable(frame, fd_); });
  return static_cast<std::size_t>(end - frames.begin());
}

[[gnu::hot]] std::size_t SocketChannel::write(std::span<const can::Frame> frames, Instant now) {
  if (frames.size() == 1 && sendable(frames.front(), fd_)) [[likely]] {
    const std::size_t sent = room_now(now) == 0 ? 0 : send(frames, now);
    counters_.stalled += 1 - sent;
    return sent;
  }
  return write_batch(frames, now);
}

[[gnu::noinline]] std::size_t SocketChannel::write_batch(std::span<const can::Frame> frames,
                                                         Instant now) {
  std::size_t taken = 0;
  while (taken < frames.size()) {
    const std::size_t good = sendable_prefix(frames.subspan(taken));
    const std::size_t room_now = good == 0 ? 0 : std::min(good, room(now));
    const std::size_t sent = room_now == 0 ? 0 : send(frames.subspan(taken, room_now), now);
    taken += sent;
    if (sent == good && taken < frames.size()) {
      ++counters_.refused;
      ++taken;
    } else if (sent == 0) {
      break;
    }
  }
  counters_.stalled += taken < frames.size() ? 1U : 0U;
  return taken;
}

[[gnu::hot]] std::size_t SocketChannel::send(std::span<const can::Frame> frames, Instant now) {
  const int result = socket_.send(frames);
  if (result < 0) {
    report_back_pressure(-result, now);
    return 0;
  }
  const auto sent = static_cast<std::size_t>(result);
  std::uint64_t number = counters_.taken();
  for (const can::Frame& frame : frames.first(adopted() ? 0 : sent)) {
    window_.sent(frame, now, ++number);
  }
  stall_seen_ = false;
  counters_.sent += sent;
  if (adopted()) {
    counters_.acknowledged = counters_.taken();
  }
  return sent;
}

void SocketChannel::report_back_pressure(int error, Instant now) {
  if (error == ENOBUFS) {
    write_again_ = now + kNoBuffersPause;
  } else if (again(error)) {
    wants_writable_ = true;
  } else {
    failure_ = error;
  }
}

[[gnu::hot]] Instant SocketChannel::next_wake() const {
  if (!ready_) {
    return retry_at_;
  }
  if (failure_ != 0 || batch_next_ < batch_end_) {
    return Instant{};
  }
  if (write_again_ != Instant{}) {
    return write_again_;
  }
  return bus_off() || stall_seen_ ? kNever : window_.next_try();
}

// --- factories ----------------------------------------------------------------------------------

std::unique_ptr<Channel> open_socketcan(std::string_view interface, const SocketOptions& options) {
  return std::make_unique<SocketChannel>(std::string(interface), options);
}

std::unique_ptr<Channel> open_on_descriptor(int descriptor) {
  return std::make_unique<SocketChannel>(descriptor);
}

}  // namespace linegate::can_bridge

// SPDX-License-Identifier: Apache-2.0
// The channel over a CAN_RAW socket, or over any other datagram socket that carries frames.
#pragma once

#include <string>

#include "bridges/can/channel.h"
#include "bridges/can/error_frame.h"
#include "bridges/can/frame_socket.h"
#include "bridges/can/receive_clock.h"
#include "bridges/can/socketcan.h"
#include "bridges/can/transmit_window.h"

namespace linegate::can_bridge {

class SocketChannel final : public Channel {
 public:
  // Opens the interface, and reopens it after a failure.
  SocketChannel(std::string interface, const SocketOptions& options);
  // Takes ownership of an open descriptor, without echoes and without reopening.
  explicit SocketChannel(int descriptor);

  [[gnu::hot]] int descriptor() const override { return socket_.descriptor(); }
  std::size_t read(std::span<can::Frame> out, BusEvents& events, Instant now) override;
  [[gnu::hot]] bool more() const override { return ends_; }
  std::size_t write(std::span<const can::Frame> frames, Instant now) override;
  std::size_t room(Instant now) const override;
  [[gnu::hot]] bool wants_writable() const override { return wants_writable_; }
  Instant next_wake() const override;
  [[gnu::hot]] const ChannelCounters& counters() const override { return counters_; }
  ControllerSetup settings() const override { return settings_; }
  bool carries_fd() const override { return fd_; }
  int restart(Instant now) override;

 private:
  bool adopted() const { return adopted_; }
  bool usable() const { return ready_ && failure_ == 0; }
  bool bus_off() const { return errors_.state() == can::BusState::bus_off; }

  void open(BusEvents& events, Instant now);
  void report_ready(can::BusState state, BusEvents& events, Instant now);
  void fail(int error, BusEvents& events, Instant now);

  bool refill(std::size_t room);
  std::size_t receive_batch(std::span<can::Frame> out, BusEvents& events, Instant now);
  bool take(const FrameSocket::Received& received, can::Frame& out, BusEvents& events, Instant now);
  void count_dropped(std::uint32_t dropped, BusEvents& events, Instant time);
  void receive_error_frame(const canfd_frame& raw, BusEvents& events, Instant time);

  std::size_t room_now(Instant now) const;
  std::size_t write_batch(std::span<const can::Frame> frames, Instant now);
  std::size_t sendable_prefix(std::span<const can::Frame> frames) const;
  std::size_t send(std::span<const can::Frame> frames, Instant now);
  void report_back_pressure(int error, Instant now);
  void flush_window();

  // The members that each frame uses are adjacent, to occupy few cache lines: other programs on the
  // processor evict them between two frames.
  FrameSocket socket_;
  std::size_t batch_next_ = 0;  // position in the batch that was read last
  std::size_t batch_end_ = 0;
  Instant write_again_{};  // end of the pause after ENOBUFS
  int failure_ = 0;        // detected; the next read() reports it
  const bool adopted_;     // a descriptor that cannot be opened again
  bool ready_ = false;
  bool fd_ = false;
  bool wants_writable_ = false;
  bool stall_seen_ = false;  // the window's next_try() has passed and the caller was informed
  bool drained_ = false;
  bool ends_ = false;  // read() ends with the acknowledgement that was just read
  ErrorDecoder errors_;
  std::uint32_t dropped_ = 0;
  ReceiveClock clock_;
  ChannelCounters counters_;
  TransmitWindow window_;

  Instant retry_at_{};  // next attempt to open; kNever = none
  int reported_ = 0;    // the last reported failure, while it lasts
  const std::string interface_;
  const SocketOptions options_;
  ControllerSetup settings_;
};

}  // namespace linegate::can_bridge

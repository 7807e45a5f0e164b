// SPDX-License-Identifier: Apache-2.0
// Batches of frames from and to a datagram socket, in storage that is allocated once.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

#include <linux/can.h>
#include <sys/socket.h>

#include "stack/can/frame.h"

namespace linegate::can_bridge {

class FrameSocket {
 public:
  static constexpr std::size_t kBatch = 64;

  // A received datagram with the kernel's ancillary data.
  struct Received {
    const canfd_frame* raw = nullptr;
    std::size_t bytes = 0;
    bool own = false;              // sent by this socket (MSG_CONFIRM)
    std::int64_t stamp_ns = 0;     // wall clock, ns since 1970; 0 = none
    std::int64_t hardware_ns = 0;  // the controller's own clock; 0 = none
    std::uint32_t dropped = 0;     // datagrams lost so far; valid with has_dropped
    bool has_dropped = false;
  };
  // What the control messages of a datagram say.
  static void read_control(const msghdr& header, Received& out);

  FrameSocket();
  ~FrameSocket();
  FrameSocket(const FrameSocket&) = delete;
  FrameSocket& operator=(const FrameSocket&) = delete;

  // Takes ownership; closes the one before. -1 = none.
  void reset(int descriptor);
  int descriptor() const { return descriptor_; }

  // Reads up to count (at most kBatch) datagrams without waiting. Gives how many, or -errno
  // (-EAGAIN: none there). They stay until the next call.
  int receive(std::size_t count);
  Received received(std::size_t index) const;

  // Sends up to kBatch frames without waiting. Gives how many, or -errno if not even the first.
  int send(std::span<const can::Frame> frames);

 private:
  struct Buffers;
  int descriptor_ = -1;
  std::size_t used_ = kBatch;  // headers that the kernel may have written to since they were set
  std::unique_ptr<Buffers> buffers_;
};

}  // namespace linegate::can_bridge

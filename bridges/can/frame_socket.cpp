// SPDX-License-Identifier: Apache-2.0
#include "bridges/can/frame_socket.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>

#include <sys/socket.h>
#include <sys/uio.h>
#include <time.h>
#include <unistd.h>

#include "bridges/can/frame_codec.h"
#include "bridges/can/socket_parts.h"

namespace linegate::can_bridge {
namespace {

// The time stamp at that position of a control message; 0: none.
std::int64_t nanoseconds_in(const cmsghdr* message, std::size_t place) {
  timespec stamp;
  std::memcpy(&stamp, CMSG_DATA(message) + place * sizeof stamp, sizeof stamp);
  return std::int64_t{stamp.tv_sec} * 1'000'000'000 + stamp.tv_nsec;
}

}  // namespace

// The parts of one datagram are adjacent, and those of the first one next to its header: most
// batches have a single one.
struct FrameSocket::Buffers {
  static constexpr std::size_t kLine = 64;  // bytes of a cache line

  struct alignas(kLine) Incoming {
    iovec vector{};
    Control control{};
    canfd_frame frame{};
  };
  struct Outgoing {
    canfd_frame frame{};
    iovec vector{};
  };
  Incoming& in(std::size_t i) { return incoming[kBatch - 1 - i]; }
  const Incoming& in(std::size_t i) const { return incoming[kBatch - 1 - i]; }

  std::array<Incoming, kBatch> incoming{};  // the first datagram's last, see in()
  std::array<mmsghdr, kBatch> receive_headers{};
  std::array<mmsghdr, kBatch> send_headers{};
  std::array<Outgoing, kBatch> outgoing{};
};

FrameSocket::FrameSocket() : buffers_(std::make_unique<Buffers>()) {
  Buffers& b = *buffers_;
  for (std::size_t i = 0; i < kBatch; ++i) {
    Buffers::Incoming& in = b.in(i);
    in.vector = {&in.frame, sizeof(canfd_frame)};
    b.receive_headers[i].msg_hdr.msg_iov = &in.vector;
    b.receive_headers[i].msg_hdr.msg_iovlen = 1;
    b.receive_headers[i].msg_hdr.msg_control = in.control.bytes.data();
    b.outgoing[i].vector.iov_base = &b.outgoing[i].frame;
    b.send_headers[i].msg_hdr.msg_iov = &b.outgoing[i].vector;
    b.send_headers[i].msg_hdr.msg_iovlen = 1;
  }
}

FrameSocket::~FrameSocket() {
  reset(-1);
}

void FrameSocket::reset(int descriptor) {
  if (descriptor_ >= 0) {
    ::close(descriptor_);
  }
  descriptor_ = descriptor;
}

[[gnu::hot]] int FrameSocket::receive(std::size_t count) {
  Buffers& b = *buffers_;
  count = std::min(count, kBatch);
  // Only the used part: a whole batch is 4 KiB, which a loop that receives one frame at a time
  // should not touch.
  for (std::size_t i = 0; i < used_; ++i) {
    b.receive_headers[i].msg_hdr.msg_controllen = kControl;
    b.receive_headers[i].msg_hdr.msg_flags = 0;
  }
  const int got = ::recvmmsg(descriptor_, b.receive_headers.data(), static_cast<unsigned>(count),
                             MSG_DONTWAIT, nullptr);
  used_ = got > 0 ? static_cast<std::size_t>(got) : 0;
  return got >= 0 ? got : -errno;
}

[[gnu::hot]] FrameSocket::Received FrameSocket::received(std::size_t index) const {
  const Buffers& b = *buffers_;
  const mmsghdr& header = b.receive_headers[index];
  Received result;
  result.raw = &b.in(index).frame;
  result.bytes = header.msg_len;
  result.own = (header.msg_hdr.msg_flags & MSG_CONFIRM) != 0;
  read_control(header.msg_hdr, result);
  return result;
}

[[gnu::hot]] void FrameSocket::read_control(const msghdr& header, Received& out) {
  msghdr walk = header;  // CMSG_NXTHDR takes a non-const header
  for (cmsghdr* c = CMSG_FIRSTHDR(&walk); c != nullptr; c = CMSG_NXTHDR(&walk, c)) {
    if (c->cmsg_level != SOL_SOCKET) {
      continue;
    }
    if (c->cmsg_type == SCM_TIMESTAMPNS) {
      out.stamp_ns = nanoseconds_in(c, 0);
    } else if (c->cmsg_type == SCM_TIMESTAMPING) {
      out.stamp_ns = nanoseconds_in(c, 0);
      out.hardware_ns = nanoseconds_in(c, 2);  // [1] is deprecated
    } else if (c->cmsg_type == SO_RXQ_OVFL) {
      std::memcpy(&out.dropped, CMSG_DATA(c), sizeof out.dropped);
      out.has_dropped = true;
    }
  }
}

[[gnu::hot]] int FrameSocket::send(std::span<const can::Frame> frames) {
  const std::size_t count = std::min(frames.size(), kBatch);
  constexpr int kFlags = MSG_DONTWAIT | MSG_NOSIGNAL;
  if (count == 1) {  // the usual case: without a batch header, and from the stack, which is cached
    canfd_frame only;
    return ::send(descriptor_, &only, encode(frames[0], only), kFlags) >= 0 ? 1 : -errno;
  }
  Buffers& b = *buffers_;
  for (std::size_t i = 0; i < count; ++i) {
    b.outgoing[i].vector.iov_len = encode(frames[i], b.outgoing[i].frame);
  }
  const int sent =
      ::sendmmsg(descriptor_, b.send_headers.data(), static_cast<unsigned>(count), kFlags);
  return sent >= 0 ? sent : -errno;
}

}  // namespace linegate::can_bridge

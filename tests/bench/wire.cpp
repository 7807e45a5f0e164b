// SPDX-License-Identifier: Apache-2.0
#include "tests/bench/wire.h"

#include <algorithm>
#include <array>
#include <cstring>

#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include "stack/can/cob_id.h"

#include "tests/bench/measure.h"

namespace linegate::bench {
namespace {

constexpr int kBuffer = 8 << 20;  // bytes; the kernel counts about 800 for each frame
constexpr std::size_t kBatch = 64;

can_frame boot_up(int node) {
  can_frame out{};
  out.can_id = 0x700U + static_cast<unsigned>(node);
  out.len = 1;
  return out;
}

// Answers success, and zero for every value.
can_frame answer_to(const can_frame& request) {
  can_frame out = request;
  out.can_id = request.can_id - can::kSdoRequestBase + can::kSdoResponseBase;
  const bool upload = (request.data[0] & 0xE0U) == 0x40U;
  out.data[0] = upload ? 0x43 : 0x60;
  std::memset(out.data + 4, 0, 4);
  return out;
}

}  // namespace

Wire::Wire() {
  int ends[2] = {-1, -1};
  require(socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0, ends) == 0,
          "the socket pair cannot be created");
  near_ = ends[0];
  far_ = ends[1];
  const int on = 1;
  require(setsockopt(far_, SOL_SOCKET, SO_TIMESTAMPNS, &on, sizeof on) == 0, "no stamps");
  if (setsockopt(near_, SOL_SOCKET, SO_SNDBUFFORCE, &kBuffer, sizeof kBuffer) != 0) {
    require(setsockopt(near_, SOL_SOCKET, SO_SNDBUF, &kBuffer, sizeof kBuffer) == 0, "no buffer");
  }
}

Wire::~Wire() {
  close(near_);
}

void Wire::send(std::span<can_frame> frames) const {
  std::array<mmsghdr, kBatch> headers{};
  std::array<iovec, kBatch> vectors{};
  while (!frames.empty()) {
    const std::size_t count = std::min(frames.size(), kBatch);
    for (std::size_t i = 0; i < count; ++i) {
      vectors[i] = {&frames[i], sizeof(can_frame)};
      headers[i].msg_hdr.msg_iov = &vectors[i];
      headers[i].msg_hdr.msg_iovlen = 1;
    }
    const int sent = sendmmsg(near_, headers.data(), static_cast<unsigned>(count), MSG_NOSIGNAL);
    require(sent > 0, "the socket pair does not accept frames");
    frames = frames.subspan(static_cast<std::size_t>(sent));
  }
}

void Wire::play_devices(int count, int milliseconds) const {
  for (int node = 1; node <= count; ++node) {
    can_frame frame = boot_up(node);
    send(std::span(&frame, 1));
  }
  pollfd readable{near_, POLLIN, 0};
  while (poll(&readable, 1, milliseconds) == 1) {
    can_frame frame{};
    require(recv(near_, &frame, sizeof frame, 0) > 0, "the peer closed the socket");
    if (frame.can_id > can::kSdoRequestBase && frame.can_id <= can::kSdoRequestBase + 127U) {
      can_frame answer = answer_to(frame);
      send(std::span(&answer, 1));
    }
  }
}

std::vector<can_frame> raw(std::span<const can::Frame> frames) {
  std::vector<can_frame> out(frames.size());
  for (std::size_t i = 0; i < frames.size(); ++i) {
    out[i].can_id = frames[i].id;
    out[i].len = frames[i].length;
    std::memcpy(out[i].data, frames[i].data.data(), sizeof out[i].data);
  }
  return out;
}

}  // namespace linegate::bench

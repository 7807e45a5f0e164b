// SPDX-License-Identifier: Apache-2.0
#include "tests/bench/bare_loop.h"

#include <algorithm>
#include <cstring>

#include <sys/epoll.h>
#include <unistd.h>

namespace linegate::bench {

BareLoop::BareLoop(int descriptor) : descriptor_(descriptor), epoll_(epoll_create1(EPOLL_CLOEXEC)) {
  epoll_event event{};
  event.events = EPOLLIN;
  epoll_ctl(epoll_, EPOLL_CTL_ADD, descriptor_, &event);
  for (std::size_t i = 0; i < kBatch; ++i) {
    vectors_[i] = {&frames_[i], sizeof(can_frame)};
    headers_[i].msg_hdr.msg_iov = &vectors_[i];
    headers_[i].msg_hdr.msg_iovlen = 1;
    headers_[i].msg_hdr.msg_control = controls_[i].bytes.data();
  }
}

BareLoop::~BareLoop() {
  close(epoll_);
}

void BareLoop::wait(std::int64_t at_most) {
  std::array<epoll_event, 16> events{};
  const std::int64_t left = std::max<std::int64_t>(at_most, 0);
  const timespec time{left / 1'000'000'000, static_cast<long>(left % 1'000'000'000)};
  epoll_pwait2(epoll_, events.data(), static_cast<int>(events.size()), &time, nullptr);
}

std::size_t BareLoop::read() {
  for (mmsghdr& header : headers_) {
    header.msg_hdr.msg_controllen = sizeof(Control);
  }
  const int count = recvmmsg(descriptor_, headers_.data(), kBatch, MSG_DONTWAIT, nullptr);
  return count < 0 ? 0 : static_cast<std::size_t>(count);
}

std::int64_t BareLoop::stamp(std::size_t i) {
  const cmsghdr* control = CMSG_FIRSTHDR(&headers_[i].msg_hdr);
  if (control == nullptr || control->cmsg_type != SCM_TIMESTAMPNS) {
    return 0;
  }
  timespec time;
  std::memcpy(&time, CMSG_DATA(control), sizeof time);
  return std::int64_t{time.tv_sec} * 1'000'000'000 + time.tv_nsec;
}

}  // namespace linegate::bench

// SPDX-License-Identifier: Apache-2.0
// What the sockets of CAN and of multicast have in common; private to bridges/can.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include <linux/errqueue.h>
#include <sys/socket.h>
#include <time.h>

namespace linegate::can_bridge {

inline constexpr int kOn = 1;

// False, and errno, if the kernel refuses.
template <class T>
bool set_option(int descriptor, int level, int option, const T& value) {
  return ::setsockopt(descriptor, level, option, &value, sizeof value) == 0;
}

// What the kernel adds to each datagram: its time (SCM_TIMESTAMPNS, or the three of
// SCM_TIMESTAMPING) and how many were lost.
inline constexpr std::size_t kControl =
    CMSG_SPACE(sizeof(scm_timestamping)) + CMSG_SPACE(sizeof(std::uint32_t));

struct alignas(cmsghdr) Control {
  std::array<std::byte, kControl> bytes;
};

}  // namespace linegate::can_bridge

// SPDX-License-Identifier: Apache-2.0
// Helpers shared by CAN sockets and multicast sockets; private to bridges/can.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include <linux/errqueue.h>
#include <sys/socket.h>
#include <time.h>

namespace linegate::can_bridge {

inline constexpr int kOn = 1;

// Returns false, with errno set, if the kernel refuses.
template <class T>
bool set_option(int descriptor, int level, int option, const T& value) {
  return ::setsockopt(descriptor, level, option, &value, sizeof value) == 0;
}

// Room for the kernel's ancillary data of one datagram: its time stamp (SCM_TIMESTAMPNS, or the
// three of SCM_TIMESTAMPING) and the count of lost datagrams.
inline constexpr std::size_t kControl =
    CMSG_SPACE(sizeof(scm_timestamping)) + CMSG_SPACE(sizeof(std::uint32_t));

struct alignas(cmsghdr) Control {
  std::array<std::byte, kControl> bytes;
};

}  // namespace linegate::can_bridge

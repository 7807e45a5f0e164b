// SPDX-License-Identifier: Apache-2.0
// Reserves a DDS domain for the tests of this process, so that test programs may run in parallel.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <string>

#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

namespace linegate::test {

// Returns false if another process has the name. The name is released when this process ends, even
// if it is killed.
inline bool bind_name(const std::string& name) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;  // without a path: a name of the abstract namespace needs no file
  std::memcpy(address.sun_path + 1, name.data(), name.size());
  const auto length = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + 1 + name.size());
  const int held = ::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  if (held < 0 || ::bind(held, reinterpret_cast<const sockaddr*>(&address), length) == 0) {
    return held >= 0;
  }
  ::close(held);
  return false;
}

// A domain from 50 to 189, the same at each call. The other numbers are left to the demo and to
// manual experiments.
inline std::uint32_t own_domain() {
  constexpr std::uint32_t kFirst = 50;
  constexpr std::uint32_t kCount = 140;
  static const std::uint32_t domain = [] {
    const auto begin = static_cast<std::uint32_t>(::getpid());
    for (std::uint32_t i = 0; i < kCount; ++i) {
      const std::uint32_t candidate = kFirst + (begin + i) % kCount;
      if (bind_name("linegate-test-domain-" + std::to_string(candidate))) {
        return candidate;
      }
    }
    std::abort();  // every domain is in use: no test can run
  }();
  return domain;
}

}  // namespace linegate::test

// SPDX-License-Identifier: Apache-2.0
// A guard, and datagrams for it.
#pragma once

#include <cstdint>

#include <gtest/gtest.h>

#include "bridges/dds/guard/guard.h"

#include "tests/dds/guard/datagram.h"

namespace linegate::test {

inline constexpr std::int64_t kSecond = 1'000'000'000;

class GuardTest : public testing::Test {
 protected:
  using Guard = dds::guard::Guard;
  using Reason = dds::guard::Reason;

  Reason judge(Datagram datagram) {
    const Guard::Verdict verdict = guard.judge(datagram.get(), now);
    passed = verdict.size;
    return verdict.reason;
  }
  Reason beat(std::int64_t last, Sender from = 1, std::uint32_t writer = kWriter) {
    return judge(Datagram(from).add(0x07, heartbeat(last, last, true, writer)));
  }
  Reason skip(std::int64_t to, Sender from = 1) {
    return judge(Datagram(from).add(0x08, gap(1, to + 1)));
  }

  Guard guard{false};
  std::int64_t now = 1'000 * kSecond;
  std::size_t passed = 0;
  dds::guard::PassedOn written;
};

}  // namespace linegate::test

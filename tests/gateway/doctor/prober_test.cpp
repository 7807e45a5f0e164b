// SPDX-License-Identifier: Apache-2.0
#include "gateway/doctor/prober.h"

#include <gtest/gtest.h>

namespace linegate::doctor {
namespace {

std::size_t ports_of(const Prober& prober) {
  std::size_t out = 0;
  for (const ProbedHost& host : prober.results())
    out += host.ports.size();
  return out;
}

// Announcements are foreign. Loopback, so that nothing leaves this host.
TEST(ProberTest, APlaceThatAStrangerChoosesIsNotProbedWithoutABound) {
  Prober prober(7);
  prober.add_place({"239.255.0.1", 7400}, "10.0.0.1");
  prober.add_place({"255.255.255.255", 9160}, "10.0.0.1");
  prober.add_place({"127.0.0.1", 9160}, "10.0.0.1");
  prober.add_place({"0.0.0.0", 9160}, "10.0.0.1");
  EXPECT_EQ(ports_of(prober), 0U);
  for (std::uint16_t port = 20'000; port < 21'000; ++port)
    prober.add_place({"127.0.0.1", port}, "127.0.0.1");
  EXPECT_EQ(ports_of(prober), 16U);
  for (unsigned host = 2; host < 200; ++host) {
    const std::string address = "127.0.0." + std::to_string(host);
    for (std::uint16_t port = 20'000; port < 20'010; ++port)
      prober.add_place({address, port}, address);
  }
  EXPECT_EQ(ports_of(prober), 128U);
  prober.add_place({"127.0.0.1", 20'000}, "127.0.0.1");
  EXPECT_EQ(ports_of(prober), 128U);
}

}  // namespace
}  // namespace linegate::doctor

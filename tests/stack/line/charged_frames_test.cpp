// SPDX-License-Identifier: Apache-2.0
// Invariant: each frame of a procedure that a command started counts once, for the client of that
// command, and none after the end of the procedure.
#include <cstdint>
#include <functional>
#include <map>
#include <string>

#include <gtest/gtest.h>

#include "tests/stack/line/service_fixture.h"

namespace linegate::line {
namespace {

constexpr std::uint32_t kBooting = 7;

TEST(BootProcessOfAClient, EndsWithItsClient) {
  const std::map<std::string, std::function<void(manager::Manager&, Instant)>> ends{
      {"stop", [](auto& manager, Instant now) { manager.stop(now); }},
      {"halt", [](auto& manager, Instant now) { manager.halt(now); }},
      {"hand over", [](auto& manager, Instant now) { manager.hand_over(now); }},
      {"boot by the line", [](auto& manager, Instant now) { manager.boot(5, now); }},
      {"download",
       [](auto& manager, Instant now) {
         manager.hold(5);
         manager.release(5, now);
       }},
  };
  for (const auto& [name, end] : ends) {
    ManagerParts parts;
    parts.manager.boot(5, parts.now, kBooting);
    EXPECT_EQ(parts.manager.client_of(5), kBooting) << name;
    end(parts.manager, parts.now);
    EXPECT_EQ(parts.manager.client_of(5), 0U) << name;
  }
}

}  // namespace
}  // namespace linegate::line

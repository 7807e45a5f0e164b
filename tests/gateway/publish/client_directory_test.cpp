// SPDX-License-Identifier: Apache-2.0
#include "gateway/publish/client_directory.h"

#include <cstdint>

#include <gtest/gtest.h>

namespace linegate::gateway {
namespace {

ClientIdentity identity(std::uint32_t number, const char* host = "panel3") {
  ClientIdentity out{.host = host};
  for (std::size_t i = 0; i < 4; ++i) {
    out.id[i] = static_cast<std::uint8_t>(number >> 8 * i);
  }
  return out;
}

TEST(ClientDirectory, AParticipantIsOneClientUnderAnyName) {
  ClientDirectory clients;
  const std::uint32_t first = clients.number(identity(1), "hmi");
  EXPECT_EQ(first, 1U);
  EXPECT_EQ(clients.number(identity(2), "hmi"), 2U);
  EXPECT_EQ(clients.describe(first), "hmi at panel3");
  EXPECT_EQ(clients.number(identity(1, "panel4"), "other"), first);
  EXPECT_EQ(clients.describe(first), "other at panel4");
}

TEST(ClientDirectory, TextOfStrangersIsPrintable) {
  ClientDirectory clients;
  (void)clients.number(identity(1, "a\nb"), "\x1b[2J");
  EXPECT_EQ(clients.describe(1), ".[2J at a.b");
  (void)clients.number(identity(2, ""), "");
  EXPECT_EQ(clients.describe(2), "a client");
  EXPECT_EQ(clients.describe(77), "client 77");
}

// A participant that appears under new identities does not grow the directory.
TEST(ClientDirectory, ForgetsTheClientThatIsSilentTheLongest) {
  ClientDirectory clients;
  const std::uint32_t kept = clients.number(identity(1), "kept");
  const std::uint32_t gone = clients.number(identity(2), "gone");
  for (std::uint32_t i = 3; i <= ClientDirectory::kMost + 1; ++i) {
    (void)clients.number(identity(i), "more");
    EXPECT_EQ(clients.number(identity(1), "kept"), kept);
  }
  EXPECT_EQ(clients.describe(kept), "kept at panel3");
  EXPECT_EQ(clients.describe(gone), "client " + std::to_string(gone));
  EXPECT_GT(clients.number(identity(2), "gone"), ClientDirectory::kMost)
      << "a number is not reused";
}

}  // namespace
}  // namespace linegate::gateway

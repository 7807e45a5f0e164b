// SPDX-License-Identifier: Apache-2.0
// linegate_wake() is for any thread, also while another one polls or closes the client.
#include <atomic>
#include <thread>

#include <gtest/gtest.h>

#include "bridges/client/c_api.h"

#include "fake_link.h"

namespace linegate::client {
namespace {

TEST(ClientThreads, AWakeUpMeetsTheEndOfTheClient) {
  for (int round = 0; round < 200; ++round) {
    linegate_client* const client = adopt(fake_client(std::make_shared<FakeWorld>()));
    std::atomic<int> woken = 0;
    std::thread other([&] {
      while (linegate_wake(client) == LINEGATE_OK)
        ++woken;
    });
    while (woken == 0)
      ASSERT_EQ(linegate_poll(client, 0), LINEGATE_OK);
    EXPECT_EQ(linegate_close(client), LINEGATE_OK);
    other.join();
    EXPECT_EQ(linegate_wake(client), LINEGATE_ERROR_CLOSED);
  }
}

}  // namespace
}  // namespace linegate::client

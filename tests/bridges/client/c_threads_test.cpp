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

// The command has no answer, so the wait ends by the other thread alone.
TEST(ClientThreads, ACommandIsCancelledWhileAnotherThreadWaitsForIt) {
  const auto world = std::make_shared<FakeWorld>();
  linegate_client* const client = adopt(fake_client(world));
  world->whole_line(1);
  ASSERT_EQ(linegate_poll(client, 0), LINEGATE_OK);
  const int line = linegate_line(client, "press");
  for (int i = 0; i < 20; ++i) {
    const int call = linegate_sdo_read(client, line, 1, 0x1000, 0, 10'000);
    ASSERT_GT(call, 0);
    int result = 0;
    std::thread waits([&] { result = linegate_call_wait(client, call); });
    EXPECT_EQ(linegate_call_cancel(client, call), LINEGATE_OK);
    waits.join();
    EXPECT_EQ(result, LINEGATE_ERROR_FAILED);
    EXPECT_EQ(linegate_free(client, call), LINEGATE_OK);
  }
  std::thread waits([&] {
    EXPECT_EQ(linegate_line_wait(client, linegate_line(client, "none"), 3'600'000),
              LINEGATE_ERROR_CLOSED);
  });
  while (linegate_close(client) == LINEGATE_ERROR_ARGUMENT) {  // within a poll
  }
  waits.join();
}

}  // namespace
}  // namespace linegate::client

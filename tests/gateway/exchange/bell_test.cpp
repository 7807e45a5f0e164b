// SPDX-License-Identifier: Apache-2.0
#include "gateway/exchange/bell.h"

#include <array>
#include <chrono>
#include <system_error>
#include <thread>
#include <vector>

#include <gtest/gtest.h>
#include <unistd.h>

#include "gateway/exchange/byte_ring.h"

namespace linegate::exchange {
namespace {

// A wake-up that is lost would cost 10 min here.
TEST(Bell, EachMessageEndsTheWaitOfItsConsumer) {
  constexpr int kMessages = 5'000;
  alignas(8) std::array<std::byte, 256> bytes{};
  ByteRingHeader header;
  ByteRingProducer producer{header, bytes};
  ByteRingConsumer consumer{header, bytes};
  Bell bell;
  std::thread waiting([&] {
    Bell other(bell.descriptor());
    std::vector<std::byte> out;
    for (int i = 0; i < kMessages;) {
      if (!consumer.front(out)) {
        other.arm();
        if (!consumer.front(out)) {
          other.wait(std::chrono::minutes(10));
        }
        other.disarm();
        continue;
      }
      consumer.pop();
      ++i;
    }
  });
  const std::array<std::byte, 5> message{};
  for (int i = 0; i < kMessages;) {
    if (producer.push(message)) {
      bell.ring();
      ++i;
    } else {
      std::this_thread::yield();
    }
  }
  waiting.join();
  EXPECT_EQ(producer.consumed(), producer.position());
}

TEST(Bell, AWaitEndsWithItsTimeoutAndNotWithoutArming) {
  Bell bell;
  bell.arm();
  bell.wait(std::chrono::milliseconds(1));
  bell.disarm();
  bell.wait(std::chrono::minutes(10));  // at once: it is not armed
}

TEST(Bell, RefusesAnyOtherDescriptor) {
  EXPECT_THROW(Bell{STDIN_FILENO}, std::system_error);
  const SharedMemory longer(8'192, SharedMemory::Other::writes);
  EXPECT_THROW(Bell{longer.descriptor()}, std::system_error);
}

}  // namespace
}  // namespace linegate::exchange

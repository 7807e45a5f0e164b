// SPDX-License-Identifier: Apache-2.0
#include "gateway/exchange/byte_ring.h"

#include <array>
#include <chrono>
#include <cstdint>
#include <cstring>
#include <random>
#include <thread>
#include <vector>

#include <gtest/gtest.h>
#include <unistd.h>

#include "gateway/exchange/shared_rings.h"

namespace linegate::exchange {
namespace {

using Message = std::vector<std::byte>;

Message message_of(std::size_t length, std::uint64_t seed) {
  Message out(length);
  for (std::size_t i = 0; i < length; ++i) {
    out[i] = static_cast<std::byte>((seed + i * 7) & 0xFFU);
  }
  return out;
}

struct SmallRing {
  alignas(64) std::array<std::byte, 512> memory{};
  ByteRingHeader header;
  // Bytes before and after the ring must never change.
  std::span<std::byte> bytes{memory.data() + 128, 256};
  ByteRingProducer producer{header, bytes};
  ByteRingConsumer consumer{header, bytes};

  bool untouched_around() const {
    for (std::size_t i = 0; i < 128; ++i) {
      if (memory[i] != std::byte{0} || memory[384 + i] != std::byte{0}) {
        return false;
      }
    }
    return true;
  }
};

TEST(ByteRing, KeepsMessagesOfEachLengthAcrossItsEnd) {
  SmallRing ring;
  Message out;
  for (std::size_t round = 0; round < 50; ++round) {
    for (std::size_t length = 1; length <= ring.producer.longest(); ++length) {
      const Message in = message_of(length, round);
      ASSERT_TRUE(ring.producer.push(in));
      ASSERT_TRUE(ring.consumer.front(out));
      ASSERT_EQ(out, in);
      ring.consumer.pop();
      ASSERT_EQ(ring.producer.consumed(), ring.producer.position());
    }
  }
  EXPECT_FALSE(ring.consumer.front(out));
  EXPECT_FALSE(ring.consumer.broken());
  EXPECT_TRUE(ring.untouched_around());
}

TEST(ByteRing, RefusesWhatHasNoRoomOrCannotHaveAny) {
  SmallRing ring;
  EXPECT_FALSE(ring.producer.push({}));
  EXPECT_FALSE(ring.producer.push(message_of(ring.producer.longest() + 1, 0)));
  int pushed = 0;
  while (ring.producer.push(message_of(20, 0))) {
    ++pushed;
  }
  EXPECT_EQ(pushed, 256 / 24);
  Message out;
  ASSERT_TRUE(ring.consumer.front(out));
  EXPECT_FALSE(ring.producer.push(message_of(20, 0))) << "the message is read, but not removed";
  ring.consumer.pop();
  EXPECT_TRUE(ring.producer.push(message_of(20, 0)));
}

TEST(ByteRing, AMessageStaysUntilItIsRemoved) {
  SmallRing ring;
  ring.producer.push(message_of(5, 1));
  Message first;
  Message again;
  ASSERT_TRUE(ring.consumer.front(first));
  ASSERT_TRUE(ring.consumer.front(again));
  EXPECT_EQ(first, again);
}

TEST(ByteRing, TheProducerReportsOnlyAConsumerThatIsAboutToWait) {
  SmallRing ring;
  ring.producer.push(message_of(5, 1));
  EXPECT_FALSE(ring.producer.pop_waiting());
  EXPECT_FALSE(ring.consumer.prepare_wait()) << "there is a message";
  Message out;
  ring.consumer.front(out);
  ring.consumer.pop();
  EXPECT_TRUE(ring.consumer.prepare_wait());
  ring.producer.push(message_of(5, 1));
  EXPECT_TRUE(ring.producer.pop_waiting());
  EXPECT_FALSE(ring.producer.pop_waiting());
}

TEST(ByteRing, AConsumerThatReportsAnImpossiblePositionIsBroken) {
  for (const std::uint64_t head :
       {std::uint64_t{1} << 40U, ~std::uint64_t{0}, std::uint64_t{4096}}) {
    SmallRing ring;
    ring.producer.push(message_of(5, 1));
    ring.header.head.store(head);
    EXPECT_FALSE(ring.producer.push(message_of(5, 1)));
    EXPECT_TRUE(ring.producer.broken());
    EXPECT_EQ(ring.producer.consumed(), 0U);
  }
}

TEST(ByteRing, AConsumerCannotTakeBackAPosition) {
  SmallRing ring;
  ring.producer.push(message_of(5, 1));
  Message out;
  ring.consumer.front(out);
  ring.consumer.pop();
  EXPECT_EQ(ring.producer.consumed(), 16U);
  ring.header.head.store(0);
  EXPECT_EQ(ring.producer.consumed(), 16U);
  EXPECT_TRUE(ring.producer.broken());
}

TEST(ByteRing, AProducerThatReportsAnImpossiblePositionOrLengthIsBroken) {
  Message out;
  for (const std::uint64_t tail : {std::uint64_t{257}, std::uint64_t{1} << 40U, ~std::uint64_t{0},
                                   std::uint64_t{1}, std::uint64_t{7}}) {
    SmallRing ring;
    ring.header.tail.store(tail);
    EXPECT_FALSE(ring.consumer.front(out)) << tail;
    EXPECT_TRUE(ring.consumer.broken()) << tail;
  }
  for (const std::uint32_t length : {0U, 13U, 125U, 0x7FFF'FFFFU, 0xFFFF'FFFFU}) {
    SmallRing ring;
    ring.producer.push(message_of(12, 1));
    std::memcpy(ring.bytes.data(), &length, 4);
    EXPECT_FALSE(ring.consumer.front(out)) << length;
    EXPECT_TRUE(ring.consumer.broken()) << length;
  }
}

// A hostile process writes anything into the shared memory at any time. No end may write outside of
// the ring, and no message may be longer than permitted.
TEST(ByteRing, SurvivesAnyContentOfTheSharedMemory) {
  std::mt19937_64 random(20'240'601);
  Message out;
  std::uint64_t read = 0;
  for (int round = 0; round < 20'000; ++round) {
    SmallRing ring;
    for (int step = 0; step < 12; ++step) {
      switch (random() % 6) {
        case 0:
          ring.header.tail.store(random() >> random() % 64);
          break;
        case 1:
          ring.header.head.store(random() >> random() % 64);
          break;
        case 2:
          ring.bytes[random() % 256] = static_cast<std::byte>(random() & 0xFFU);
          break;
        case 3:
          ring.producer.push(message_of(1 + random() % 120, random()));
          break;
        default:
          if (ring.consumer.front(out)) {
            ++read;
            ASSERT_LE(out.size(), ring.consumer.longest());
            ring.consumer.pop();
          }
      }
    }
    ASSERT_TRUE(ring.untouched_around());
  }
  EXPECT_GT(read, 1'000U);
}

TEST(ByteRing, TwoThreadsSeeEveryMessageInOrder) {
  SharedRings rings;
  constexpr std::uint64_t kCount = 50'000;
  std::thread other([&] {
    SharedRings same(rings.descriptor());
    ByteRingProducer producer = same.other_outgoing();
    for (std::uint64_t i = 0; i < kCount;) {
      if (producer.push(message_of(1 + i % 3'000, i))) {
        ++i;
      } else {
        std::this_thread::yield();
      }
    }
  });
  ByteRingConsumer consumer = rings.incoming();
  std::uint64_t wrong = 0;
  Message out;
  for (std::uint64_t i = 0; i < kCount;) {
    if (!consumer.front(out)) {
      ASSERT_FALSE(consumer.broken());
      std::this_thread::yield();
      continue;
    }
    consumer.pop();
    wrong += out == message_of(1 + i % 3'000, i) ? 0U : 1U;
    ++i;
  }
  other.join();
  EXPECT_EQ(wrong, 0U);
}

TEST(SharedRings, CannotBeTruncatedByTheOtherProcess) {
  const SharedRings rings;
  EXPECT_NE(ftruncate(rings.descriptor(), 0), 0);
  EXPECT_NE(ftruncate(rings.descriptor(), std::int64_t{1} << 30), 0);
}

TEST(SharedRings, RefusesAnyOtherDescriptor) {
  EXPECT_THROW(SharedRings(-1), std::system_error);
  std::array<int, 2> pipes{};
  ASSERT_EQ(pipe(pipes.data()), 0);
  EXPECT_THROW(SharedRings{pipes[0]}, std::system_error);
  close(pipes[0]);
  close(pipes[1]);
}

TEST(SharedRings, TheOtherProcessShowsItsProgress) {
  SharedRings rings;
  SharedRings same(rings.descriptor());
  EXPECT_EQ(rings.progress(0), 0U);
  same.add_progress(1);
  EXPECT_EQ(rings.progress(0), 0U);
  EXPECT_EQ(rings.progress(1), 1U);
}

}  // namespace
}  // namespace linegate::exchange

// SPDX-License-Identifier: Apache-2.0
// Client and server, connected by a bus that can lose, repeat and corrupt frames.
#include <random>

#include "tests/stack/sdo/pair_fixture.h"

namespace linegate::sdo::test {
namespace {

TEST_F(TransferPair, EverySizeThereAndBack) {
  std::vector<std::size_t> sizes(101);
  for (std::size_t i = 0; i < sizes.size(); ++i) {
    sizes[i] = i;
  }
  sizes.push_back(10'000);
  for (const std::size_t size : sizes) {
    SCOPED_TRACE(size);
    const std::vector<std::byte> value = pattern(size);
    write({0x2100, 0}, value, {.transfer = Transfer::segmented});
    ASSERT_EQ(run().abort, AbortCode::none);
    const bool expedited = size >= 1 && size <= 4;
    const int segments = expedited ? 0 : std::max(1, static_cast<int>((size + 6) / 7));
    EXPECT_EQ(frames, 2 + 2 * segments);
    ASSERT_EQ(numbers(dictionary.find({0x2100, 0})->bytes()), numbers(value));
    read({0x2100, 0}, {.transfer = Transfer::segmented});
    const Outcome outcome = run();
    ASSERT_EQ(outcome.abort, AbortCode::none);
    EXPECT_EQ(numbers(outcome.data), numbers(value));
    EXPECT_EQ(frames, 2 + 2 * segments);
    EXPECT_FALSE(server.busy());
  }
}

TEST_F(TransferPair, AnAbortOfTheServerReachesTheCaller) {
  read({0x2000, 6});
  EXPECT_EQ(run().abort, AbortCode::write_only);
  write({0x2000, 5}, pattern(9));
  EXPECT_EQ(run().abort, AbortCode::length_too_high);
}

// Each single frame is lost, corrupted or repeated: the transfer ends, a download is stored
// completely or not at all, an upload is right or aborted, and the next transfer works.
TEST_F(TransferPair, EveryFaultAtEveryFrame) {
  const Bytes old_value(20, 0xEE);
  const std::vector<std::byte> new_value = pattern(20);
  for (const Fault fault : {Fault::lose, Fault::repeat, Fault::shorten}) {
    for (int faulty = 0; faulty < 8; ++faulty) {
      for (const bool writing : {false, true}) {
        SCOPED_TRACE(testing::Message()
                     << static_cast<int>(fault) << ' ' << faulty << ' ' << writing);
        ASSERT_TRUE(dictionary.set({0x2100, 0}, std::span<const std::byte>(bytes(old_value))));
        writing ? write({0x2100, 0}, new_value) : read({0x2100, 0});
        const Outcome outcome = run(fault, faulty);
        const Bytes stored = numbers(dictionary.find({0x2100, 0})->bytes());
        EXPECT_TRUE(stored == old_value || (writing && stored == numbers(new_value)));
        if (outcome.abort == AbortCode::none) {
          EXPECT_EQ(writing ? stored : numbers(outcome.data),
                    writing ? numbers(new_value) : old_value);
        }
        if (fault != Fault::repeat) {
          EXPECT_EQ(outcome.abort, AbortCode::timeout);
        }
        settle();
        read({0x1000, 0});
        const Outcome next = run();
        EXPECT_EQ(next.abort, AbortCode::none);
        EXPECT_EQ(numbers(next.data), (Bytes{1, 2, 3, 4}));
      }
    }
  }
}

TEST_F(TransferPair, ATransferRightAfterAnInterruptedOneWorks) {
  for (int faulty = 0; faulty < 8; ++faulty) {
    SCOPED_TRACE(faulty);
    write({0x2100, 0}, pattern(20));
    run(Fault::lose, faulty);
    read({0x1008, 0});
    const Outcome next = run();
    EXPECT_EQ(next.abort, AbortCode::none);
    EXPECT_EQ(next.data.size(), 15U);
  }
}

TEST_F(TransferPair, RandomAnswersNeverBreakTheClient) {
  std::mt19937 random(7);
  std::uniform_int_distribution<unsigned> any(0, 255);
  for (int round = 0; round < 5'000; ++round) {
    round % 2 == 0 ? read({0x1008, 0}) : write({0x2100, 0}, pattern(20));
    for (int i = 0; i < 4; ++i) {
      Bytes answer(any(random) % 16 == 0 ? 5 : 8);
      for (std::uint8_t& b : answer) {
        b = static_cast<std::uint8_t>(any(random));
      }
      client.receive(frame(kResponseId, answer, now), to_server);
    }
    client.advance(now + kTimeout, to_server);
    ASSERT_FALSE(client.busy());
    ASSERT_TRUE(client.take().has_value());
    settle();
    read({0x1000, 0});
    ASSERT_EQ(numbers(run().data), (Bytes{1, 2, 3, 4})) << "round " << round;
  }
}

}  // namespace
}  // namespace linegate::sdo::test

// SPDX-License-Identifier: Apache-2.0
// Block transfer between client and server on a bus that loses, repeats and corrupts frames.
#include <algorithm>
#include <iterator>
#include <random>
#include <utility>

#include "tests/stack/sdo/pair_fixture.h"

namespace linegate::sdo::test {
namespace {

constexpr od::Address kDomain{0x2100, 0};
constexpr TransferOptions kBlock{.transfer = Transfer::block};

bool carries_segment(const can::Frame& frame) {
  const auto command = std::to_integer<std::uint8_t>(frame.data[0]);
  const bool end = (command & 0xE3U) == 0xC1 &&
                   load_le(std::span<const std::byte>(frame.data).subspan(3, 5)) == 0;
  return !end && command != 0x80;
}

// Whether a frame of the sender of the value carries a part of it. The first frame does not.
class SegmentFilter {
 public:
  explicit SegmentFilter(std::uint32_t id) : id_(id) {}
  bool operator()(const can::Frame& frame) {
    if (frame.id != id_) {
      return false;
    }
    return std::exchange(begun_, true) && carries_segment(frame);
  }

 private:
  std::uint32_t id_;
  bool begun_ = false;
};

class BlockPair : public TransferPair {
 protected:
  void store(std::size_t size) {
    ASSERT_TRUE(dictionary.set(kDomain, std::span<const std::byte>(pattern(size))));
  }
  Bytes stored() { return numbers(dictionary.find(kDomain)->bytes()); }
  void begin(bool writing, std::size_t size, TransferOptions options) {
    store(writing ? 0 : size);
    if (writing) {
      write(kDomain, pattern(size), options);
    } else {
      read(kDomain, options);
    }
  }
  void expect_right(bool writing, const Outcome& outcome, std::size_t size) {
    ASSERT_EQ(outcome.abort, AbortCode::none);
    EXPECT_EQ(writing ? stored() : numbers(outcome.data), numbers(pattern(size)));
  }
  // The value is right, or the transfer ended with an abort code for a lost frame and without a
  // partial value.
  void expect_clean(bool writing, const Outcome& outcome, std::size_t size) {
    if (outcome.abort == AbortCode::none) {
      expect_right(writing, outcome, size);
      return;
    }
    const AbortCode clean[] = {AbortCode::timeout, AbortCode::block_size,
                               AbortCode::sequence_number, AbortCode::crc,
                               AbortCode::out_of_memory};
    EXPECT_NE(std::ranges::find(clean, outcome.abort), std::end(clean)) << describe(outcome.abort);
    EXPECT_TRUE(!writing || stored().empty() || stored() == numbers(pattern(size)));
  }
};

TEST_F(BlockPair, EverySizeThereAndBack) {
  std::vector<std::size_t> sizes(60);
  for (std::size_t i = 0; i < sizes.size(); ++i) {
    sizes[i] = i;
  }
  for (const std::size_t segments : {127U, 128U, 129U, 253U, 254U, 255U, 1000U}) {
    sizes.insert(sizes.end(), {segments * 7 - 6, segments * 7 - 1, segments * 7});
  }
  for (const std::size_t size : sizes) {
    SCOPED_TRACE(size);
    for (const bool writing : {true, false}) {
      begin(writing, size, kBlock);
      expect_right(writing, run(), size);
      settle();
    }
  }
}

TEST_F(BlockPair, LargeValuesGoInBlocksByThemselves) {
  for (const bool writing : {true, false}) {
    begin(writing, 7000, {});
    expect_right(writing, run(), 7000);
    EXPECT_LT(frames, 1000 + 20);  // segmented transfer takes 2002
  }
}

TEST_F(BlockPair, AnyOneLostSegmentIsRepeated) {
  for (const bool writing : {true, false}) {
    for (int faulty = 0; faulty < 20; ++faulty) {
      SCOPED_TRACE(faulty);
      begin(writing, 140, kBlock);
      int seen = 0;
      const Outcome outcome =
          run([&, is_segment = SegmentFilter(writing ? kRequestId : kResponseId)](
                  const can::Frame& frame, int) mutable {
            return is_segment(frame) && seen++ == faulty ? Fault::lose : Fault::none;
          });
      expect_right(writing, outcome, 140);
      settle();
    }
  }
}

// All segments of a value that has few of them are lost, once or twice. Shorter values are not read
// in blocks: the server switches to segments.
TEST_F(BlockPair, AllSegmentsOfAShortValueAreRepeated) {
  for (const bool writing : {true, false}) {
    for (std::size_t count = writing ? 1 : 4; count <= 8; ++count) {
      for (const std::size_t times : {1U, 2U}) {
        SCOPED_TRACE(testing::Message() << writing << ' ' << count << ' ' << times);
        begin(writing, 7 * count, kBlock);
        std::size_t seen = 0;
        const Outcome outcome =
            run([&, is_segment = SegmentFilter(writing ? kRequestId : kResponseId)](
                    const can::Frame& frame, int) mutable {
              return is_segment(frame) && seen++ < times * count ? Fault::lose : Fault::none;
            });
        EXPECT_EQ(seen, (times + 1) * count);
        expect_right(writing, outcome, 7 * count);
        settle();
      }
    }
  }
}

// 1 % to 30 % of the segments are lost, at any position: the value arrives.
TEST_F(BlockPair, ManyLostSegmentsAreRepeated) {
  std::mt19937 random(4711);
  std::uniform_int_distribution<unsigned> percent(0, 99);
  for (const unsigned loss : {1U, 5U, 10U, 30U}) {
    for (int round = 0; round < 20; ++round) {
      SCOPED_TRACE(testing::Message() << loss << " % round " << round);
      const bool writing = round % 2 == 0;
      const std::size_t size = 500 + random() % 5000;
      begin(writing, size, {});
      const Outcome outcome =
          run([&, is_segment = SegmentFilter(writing ? kRequestId : kResponseId)](
                  const can::Frame& frame, int number) mutable {
            // A read begins with segments; its first response starts the block transfer.
            const bool segment = is_segment(frame) && (writing || number > 4);
            return segment && percent(random) < loss ? Fault::lose : Fault::none;
          });
      expect_right(writing, outcome, size);
      settle();
    }
  }
}

// A server that follows the losses with its block size needs at most 1.25 times the time: each
// segment after a lost one is sent again. With 127 segments in each sub-block it is twice the time.
TEST_F(BlockPair, ADownloadKeepsFourFifthsOfItsRateIfOnePercentIsLost) {
  constexpr std::size_t kSize = 120'000;
  const auto time_of = [&](const Faults& faults) {
    begin(true, kSize, kBlock);
    const Instant begun = now;
    expect_right(true, run(faults), kSize);
    const Duration time = now - begun;
    settle();
    return time;
  };
  const Duration without = time_of([](const can::Frame&, int) { return Fault::none; });
  constexpr int kTransfers = 10;
  std::mt19937 random(1);
  Duration with{};
  for (int i = 0; i < kTransfers; ++i) {
    with +=
        time_of([&, is_segment = SegmentFilter(kRequestId)](const can::Frame& frame, int) mutable {
          return is_segment(frame) && random() % 100 == 0 ? Fault::lose : Fault::none;
        });
  }
  EXPECT_LE(with, kTransfers * without * 5 / 4) << with.count() << " ns";
}

// The loss of any frame that is not a segment is a time-out without a partial value. The transfer
// is repeated if requested, except a write after its last segment. Without a response to the
// initiate request the transfer continues in segments.
TEST_F(BlockPair, AnyOtherLostFrameIsATimeOut) {
  constexpr std::size_t kSize = 2100;  // three sub-blocks
  for (const bool writing : {true, false}) {
    // Initiate (and start), 3 acknowledgements, end.
    for (int faulty = 0; faulty < 7; ++faulty) {
      for (const unsigned repeats : {0U, 1U}) {
        SCOPED_TRACE(testing::Message() << writing << ' ' << faulty << ' ' << repeats);
        begin(writing, kSize, {.transfer = Transfer::block, .repeats = repeats});
        int others = 0;
        const Outcome outcome =
            run([&, is_segment = SegmentFilter(writing ? kRequestId : kResponseId)](
                    const can::Frame& frame, int) mutable {
              return !is_segment(frame) && others++ == faulty ? Fault::lose : Fault::none;
            });
        EXPECT_GT(others, faulty);
        const bool initiate = faulty < 2;
        const bool after_last = writing && faulty >= 4;
        if (initiate || (repeats == 1 && !after_last)) {
          expect_right(writing, outcome, kSize);
        } else {
          EXPECT_EQ(outcome.abort, AbortCode::timeout);
          EXPECT_TRUE(!writing || stored().empty() || stored() == numbers(pattern(kSize)));
        }
        settle();
        read({0x1000, 0});
        EXPECT_EQ(numbers(run().data), (Bytes{1, 2, 3, 4}));
      }
    }
  }
}

// A sub-block whose first segment has the same bytes as the last segment of the previous sub-block.
TEST_F(BlockPair, ALostSegmentOfEqualBytesIsRepeated) {
  constexpr std::size_t kSize = 140;
  const std::vector<std::byte> zeros(kSize);
  for (const bool writing : {true, false}) {
    for (int faulty = 0; faulty < 20; ++faulty) {
      SCOPED_TRACE(testing::Message() << writing << ' ' << faulty);
      ASSERT_TRUE(
          dictionary.set(kDomain, std::span<const std::byte>(zeros).first(writing ? 0 : kSize)));
      writing ? write(kDomain, zeros, kBlock) : read(kDomain, kBlock);
      int seen = 0;
      const Outcome outcome =
          run([&, is_segment = SegmentFilter(writing ? kRequestId : kResponseId)](
                  const can::Frame& frame, int number) mutable {
            EXPECT_LT(number, 100);
            return number >= 100 || (is_segment(frame) && seen++ == faulty) ? Fault::lose
                                                                            : Fault::none;
          });
      EXPECT_EQ(outcome.abort, AbortCode::none);
      EXPECT_EQ(writing ? stored() : numbers(outcome.data), numbers(zeros));
      settle();
    }
  }
}

// The rules of CiA 301, 7.2.4.3.9 and 7.2.4.3.12, for lost frames: ackseq selects the segments of
// the last sub-block that are sent again. A transfer that cannot be repaired in this way ends with
// 0504 0000h, or with 0504 0002h to 0504 0005h if one side detects it. Any two frames are lost,
// with values so short that only a few segments follow an acknowledgement, all of which may be lost
// as well.
TEST_F(BlockPair, AnyTwoLostFramesEndCleanly) {
  for (const std::size_t size : {25U, 56U, 63U, 140U}) {
    for (const bool writing : {true, false}) {
      const int last = 10 + static_cast<int>(size / 7) * 2;
      for (int first = 0; first < last; ++first) {
        for (int second = first; second < last; ++second) {
          SCOPED_TRACE(testing::Message()
                       << size << ' ' << writing << ' ' << first << ' ' << second);
          const auto lose = [&](const can::Frame&, int number) {
            EXPECT_LT(number, 300);
            return number == first || number == second ? Fault::lose : Fault::none;
          };
          begin(writing, size, kBlock);
          expect_clean(writing, run(lose), size);
          settle();
          begin(writing, size, {.transfer = Transfer::block, .repeats = 2});
          const Outcome repeated = run(lose);
          writing ? expect_clean(writing, repeated, size) : expect_right(writing, repeated, size);
          settle();
        }
      }
    }
  }
}

// The two sides refer to different sub-blocks: the last segment is lost, and then the
// acknowledgement that requests it again. The server repeats that request; the client relates it to
// the previous sub-block.
TEST_F(BlockPair, ALostAcknowledgementBeforeAFewSegmentsIsASequenceError) {
  for (const bool writing : {true, false}) {
    for (const unsigned repeats : {0U, 1U}) {
      begin(writing, 140, {.transfer = Transfer::block, .repeats = repeats});
      bool segment_lost = false;
      bool ack_lost = false;
      const Outcome outcome = run([&](const can::Frame& frame, int) {
        const auto command = std::to_integer<std::uint8_t>(frame.data[0]);
        const bool sends = frame.id == (writing ? kRequestId : kResponseId);
        if (sends && command == 0x94) {  // segment 20, the last one
          return std::exchange(segment_lost, true) ? Fault::none : Fault::lose;
        }
        const bool ack = !sends && command == 0xA2 && frame.data[1] == std::byte{19};
        return ack && !std::exchange(ack_lost, true) ? Fault::lose : Fault::none;
      });
      EXPECT_TRUE(segment_lost && ack_lost);
      if (repeats == 0) {
        EXPECT_EQ(outcome.abort, AbortCode::sequence_number);
        EXPECT_TRUE(!writing || stored().empty());
      } else {
        expect_right(writing, outcome, 140);
      }
      settle();
    }
  }
}

TEST_F(BlockPair, AnUploadIsGoodWithoutItsLastAnswer) {
  begin(false, 2100, kBlock);
  expect_right(false, run(), 2100);
  to_server.clear();
  EXPECT_TRUE(server.busy());
  server.advance(server.next_wake(), to_client);
  EXPECT_FALSE(server.busy());
}

TEST_F(BlockPair, AnyFrameTwiceDoesNotHarm) {
  for (const bool writing : {true, false}) {
    for (int faulty = 0; faulty < 30; ++faulty) {
      SCOPED_TRACE(testing::Message() << writing << ' ' << faulty);
      begin(writing, 140, kBlock);
      expect_right(writing, run(Fault::repeat, faulty), 140);
      settle();
    }
  }
}

TEST_F(BlockPair, AMalformedFrameIsAsGoodAsLost) {
  for (const bool writing : {true, false}) {
    for (int faulty = 0; faulty < 30; ++faulty) {
      SCOPED_TRACE(testing::Message() << writing << ' ' << faulty);
      begin(writing, 140, {.transfer = Transfer::block, .repeats = 1});
      const Outcome outcome = run(Fault::shorten, faulty);
      writing ? expect_clean(writing, outcome, 140) : expect_right(writing, outcome, 140);
      settle();
    }
  }
}

// Random faults of any frames: a value is complete or absent, and the next transfer works.
TEST_F(BlockPair, RandomFaultsNeverSpoilAValue) {
  std::mt19937 random(1234);
  for (int round = 0; round < 300; ++round) {
    SCOPED_TRACE(round);
    const bool writing = round % 2 == 0;
    const std::size_t size = 200 + random() % 3000;
    begin(writing, size, {.transfer = Transfer::block, .repeats = 2});
    const Outcome outcome = run([&](const can::Frame&, int) {
      const auto chance = random() % 300;
      return chance < 4 ? static_cast<Fault>(chance) : Fault::none;
    });
    if (outcome.abort == AbortCode::none) {
      expect_right(writing, outcome, size);
    } else if (writing) {
      EXPECT_TRUE(stored().empty() || stored() == numbers(pattern(size)));
    }
    settle();
    read({0x1000, 0});
    ASSERT_EQ(numbers(run().data), (Bytes{1, 2, 3, 4}));
  }
}

}  // namespace
}  // namespace linegate::sdo::test

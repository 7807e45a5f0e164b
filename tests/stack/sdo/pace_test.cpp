// SPDX-License-Identifier: Apache-2.0
// A pace limits the frames of requests by commands, and of no other request.
#include "stack/sdo/pace.h"

#include <cstdint>
#include <map>

#include "tests/stack/sdo/arbiter_fixture.h"

namespace linegate::sdo::test {
namespace {

class CountedPace final : public Pace {
 public:
  bool permits(std::uint8_t /*node*/) const override { return left > 0; }
  void count(std::uint8_t node) override {
    --left;
    ++counted[node];
  }

  int left = 0;
  std::map<std::uint8_t, int> counted;
};

class PaceTest : public ArbiterTest {
 protected:
  PaceTest() { arbiter.set_pace(pace); }
  ~PaceTest() override { arbiter.disown(client); }

  void pass(Duration time) {
    for (const Instant end = now + time; now < end;) {
      now += Outbox::kRetry;
      arbiter.advance(now);
    }
  }

  CountedPace pace;
};

TEST_F(PaceTest, ARequestWaitsAndItsTimeOutBeginsWhenItIsSent) {
  ASSERT_TRUE(submit(1));
  pass(3 * kTimeout);
  EXPECT_TRUE(drain(queue, 0x605).empty());
  EXPECT_TRUE(completions().empty()) << "the server was not asked yet";
  EXPECT_LE(arbiter.next_wake(), now + Outbox::kRetry);
  pace.left = 1;
  pass(1ms);
  EXPECT_EQ(drain(queue, 0x605), (std::vector<Bytes>{kRead}));
  pass(kTimeout - 2ms);
  EXPECT_TRUE(completions().empty());
  pass(3ms);
  const auto done = completions();
  ASSERT_EQ(done.size(), 1U);
  EXPECT_EQ(done[0].abort, AbortCode::timeout);
}

TEST_F(PaceTest, CountsTheFramesOfBothSides) {
  pace.left = 100;
  ASSERT_TRUE(submit(1));
  serve();
  EXPECT_EQ(pace.counted[5], 2);
  EXPECT_EQ(ended(), std::vector<std::uint64_t>{1});
}

TEST_F(PaceTest, EachSegmentWaits) {
  pace.left = 2;
  ASSERT_TRUE(submit(1));
  serve({0x41, 0x18, 0x10, 1, 14, 0, 0, 0});  // 14 bytes follow in segments
  pass(kTimeout);
  EXPECT_TRUE(drain(queue, 0x605).empty());
  pace.left = 1;
  pass(1ms);
  EXPECT_EQ(drain(queue, 0x605).size(), 1U);
}

TEST_F(PaceTest, BlocksWaitToo) {
  pace.left = 2;
  ASSERT_TRUE(arbiter.submit({.owner = &client,
                              .number = 1,
                              .node = 5,
                              .address = {0x2000, 0},
                              .write = true,
                              .data = pattern(500)},
                             now));
  serve({0xA4, 0x00, 0x20, 0, 127, 0, 0, 0});
  EXPECT_TRUE(drain(queue, 0x605).empty());
  pace.left = 10;
  pass(20ms);
  EXPECT_EQ(drain(queue, 0x605).size(), 10U);
  pace.left = 10;
  pass(20ms);
  EXPECT_EQ(drain(queue, 0x605).size(), 10U);
}

TEST_F(PaceTest, OtherPrioritiesDoNotWait) {
  ASSERT_TRUE(submit(1, Priority::boot));
  EXPECT_EQ(drain(queue, 0x605).size(), 1U);
  answer();
  EXPECT_EQ(ended(), std::vector<std::uint64_t>{1});
  EXPECT_TRUE(pace.counted.empty());
  ASSERT_TRUE(submit(2));
  EXPECT_TRUE(drain(queue, 0x605).empty()) << "the next command waits again";
}

TEST_F(PaceTest, AnAbortDoesNotWait) {
  pace.left = 1;
  ASSERT_TRUE(submit(1));
  EXPECT_EQ(drain(queue, 0x605).size(), 1U);
  arbiter.cancel(client, 5, 1);
  EXPECT_EQ(drain(queue, 0x605).size(), 1U);
}

}  // namespace
}  // namespace linegate::sdo::test

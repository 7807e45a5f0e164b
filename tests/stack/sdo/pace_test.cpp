// SPDX-License-Identifier: Apache-2.0
// A pace limits the frames of requests that have a client, and of no other request. Invariant: a
// request that its client may not send yet occupies no server.
#include "stack/sdo/pace.h"

#include <cstdint>
#include <map>

#include "tests/stack/sdo/arbiter_fixture.h"

namespace linegate::sdo::test {
namespace {

constexpr std::uint32_t kClient = 1;
constexpr std::uint32_t kOther = 2;

class CountedPace final : public Pace {
 public:
  bool permits(std::uint32_t of, bool awaited) const override {
    const auto found = left.find(of);
    return found != left.end() && found->second > (awaited ? -overdraft : 0);
  }
  void count(std::uint32_t of, const can::Header& /*frame*/) override {
    --left[of];
    ++counted[of];
  }

  std::map<std::uint32_t, int> left;
  int overdraft = 0;
  std::map<std::uint32_t, int> counted;
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
  bool submit_for(std::uint32_t of, std::uint64_t number, Priority priority = Priority::command,
                  unsigned repeats = 0) {
    return arbiter.submit({.owner = &client,
                           .number = number,
                           .node = 5,
                           .address = {0x1018, 1},
                           .timeout = kTimeout,
                           .priority = priority,
                           .client = of,
                           .options = {.repeats = repeats}},
                          now);
  }

  CountedPace pace;
};

TEST_F(PaceTest, ARequestWaitsAndItsTimeOutBeginsWhenItIsSent) {
  ASSERT_TRUE(submit_for(kClient, 1));
  pass(3 * kTimeout);
  EXPECT_TRUE(drain(queue, 0x605).empty());
  EXPECT_TRUE(completions().empty()) << "the server was not asked yet";
  EXPECT_LE(arbiter.next_wake(), now + Outbox::kRetry);
  pace.left[kClient] = 1;
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
  pace.left[kClient] = 100;
  ASSERT_TRUE(submit_for(kClient, 1));
  serve();
  EXPECT_EQ(pace.counted, (std::map<std::uint32_t, int>{{kClient, 2}}));
  EXPECT_EQ(ended(), std::vector<std::uint64_t>{1});
}

TEST_F(PaceTest, EachSegmentWaits) {
  pace.left[kClient] = 2;
  ASSERT_TRUE(submit_for(kClient, 1));
  serve({0x41, 0x18, 0x10, 1, 14, 0, 0, 0});  // 14 bytes follow in segments
  pass(kTimeout);
  EXPECT_TRUE(drain(queue, 0x605).empty());
  pace.left[kClient] = 1;
  pass(1ms);
  EXPECT_EQ(drain(queue, 0x605).size(), 1U);
}

TEST_F(PaceTest, BlocksWaitToo) {
  pace.left[kClient] = 2;
  ASSERT_TRUE(arbiter.submit({.owner = &client,
                              .number = 1,
                              .node = 5,
                              .address = {0x2000, 0},
                              .write = true,
                              .data = pattern(500),
                              .priority = Priority::boot,
                              .client = kClient},
                             now));
  serve({0xA4, 0x00, 0x20, 0, 127, 0, 0, 0});
  EXPECT_TRUE(drain(queue, 0x605).empty());
  pace.left[kClient] = 10;
  pass(20ms);
  EXPECT_EQ(drain(queue, 0x605).size(), 10U);
  pace.left[kClient] = 10;
  pass(20ms);
  EXPECT_EQ(drain(queue, 0x605).size(), 10U);
}

TEST_F(PaceTest, RequestsWithoutAClientDoNotWait) {
  for (const Priority priority : {Priority::boot, Priority::command}) {
    ASSERT_TRUE(submit(1, priority));
    EXPECT_EQ(drain(queue, 0x605).size(), 1U);
    answer();
    EXPECT_EQ(ended(), std::vector<std::uint64_t>{1});
  }
  EXPECT_TRUE(pace.counted.empty());
  ASSERT_TRUE(submit_for(kClient, 2));
  EXPECT_TRUE(drain(queue, 0x605).empty()) << "the next command waits again";
}

TEST_F(PaceTest, EachPriorityOfAClientWaits) {
  std::uint64_t number = 0;
  for (const Priority priority : {Priority::command, Priority::boot, Priority::background}) {
    ASSERT_TRUE(submit_for(kClient, ++number, priority));
  }
  pass(10ms);
  EXPECT_TRUE(drain(queue, 0x605).empty());
  EXPECT_EQ(arbiter.load(5), 3U);
}

TEST_F(PaceTest, ARequestThatWaitsDoesNotOccupyTheServer) {
  ASSERT_TRUE(submit_for(kClient, 1));
  ASSERT_TRUE(submit_for(kClient, 2, Priority::boot));
  pass(10ms);
  pace.left[kOther] = 100;
  ASSERT_TRUE(submit_for(kOther, 3, Priority::background));
  EXPECT_EQ(drain(queue, 0x605).size(), 1U) << "least urgent, but the only one that may be sent";
  answer();
  EXPECT_EQ(ended(), std::vector<std::uint64_t>{3});
  ASSERT_TRUE(submit(4, Priority::boot));
  serve();
  EXPECT_EQ(ended(), std::vector<std::uint64_t>{4}) << "that of the line itself";
  pace.left[kClient] = 100;
  pass(1ms);
  serve();
  serve();
  EXPECT_EQ(ended(), (std::vector<std::uint64_t>{1, 2}));
}

TEST_F(PaceTest, ATransferForWhichAnotherClientWaitsMayEndEarlier) {
  pace.overdraft = 10;
  pace.left[kClient] = 2;
  ASSERT_TRUE(submit_for(kClient, 1));
  serve({0x41, 0x18, 0x10, 1, 14, 0, 0, 0});  // 14 bytes follow in segments
  pass(10ms);
  EXPECT_TRUE(drain(queue, 0x605).empty());
  ASSERT_TRUE(submit_for(kOther, 2));
  pass(10ms);
  EXPECT_TRUE(drain(queue, 0x605).empty()) << "the other one may not send either";
  pace.left[kOther] = 2;
  pass(1ms);
  serve({0x00, 1, 2, 3, 4, 5, 6, 7});
  serve({0x11, 1, 2, 3, 4, 5, 6, 7});
  serve();
  EXPECT_EQ(ended(), (std::vector<std::uint64_t>{1, 2}));
  EXPECT_EQ(pace.counted, (std::map<std::uint32_t, int>{{kClient, 6}, {kOther, 2}}));
}

// A flood to a node that does not answer is a flood of repetitions.
TEST_F(PaceTest, ARepetitionWaitsLikeTheFirstAttempt) {
  pace.left[kClient] = 1;
  ASSERT_TRUE(submit_for(kClient, 1, Priority::command, 1));
  EXPECT_EQ(drain(queue, 0x605).size(), 1U);
  pass(kTimeout + 1ms);
  EXPECT_EQ(drain(queue, 0x605).size(), 1U) << "the abort, which does not wait";
  EXPECT_EQ(pace.counted[kClient], 2);
  pass(10ms);
  EXPECT_TRUE(drain(queue, 0x605).empty());
  pace.left[kClient] = 1;
  pass(1ms);
  EXPECT_EQ(drain(queue, 0x605), (std::vector<Bytes>{kRead}));
}

TEST_F(PaceTest, AnAbortDoesNotWait) {
  pace.left[kClient] = 1;
  ASSERT_TRUE(submit_for(kClient, 1));
  EXPECT_EQ(drain(queue, 0x605).size(), 1U);
  arbiter.cancel(client, 5, 1);
  EXPECT_EQ(drain(queue, 0x605).size(), 1U);
  EXPECT_EQ(pace.counted[kClient], 2);
}

TEST_F(PaceTest, FramesBesideTransfersAreThoseOfTheirClient) {
  EXPECT_TRUE(arbiter.permits(0));
  EXPECT_FALSE(arbiter.permits(kClient));
  pace.left[kClient] = 1;
  EXPECT_TRUE(arbiter.permits(kClient));
  arbiter.charge(0, 3);
  arbiter.charge(kClient, 3);
  EXPECT_EQ(pace.counted, (std::map<std::uint32_t, int>{{kClient, 3}}));
}

}  // namespace
}  // namespace linegate::sdo::test

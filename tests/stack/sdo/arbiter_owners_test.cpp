// SPDX-License-Identifier: Apache-2.0
// The owner that receives a completion, and the requests of an owner that is destroyed.
#include <optional>

#include "tests/stack/sdo/arbiter_fixture.h"

namespace linegate::sdo::test {
namespace {

class TwoOwnersTest : public ArbiterTest {
 protected:
  bool submit_second(std::uint64_t number, std::uint8_t node = 5) {
    return arbiter.submit({.owner = &*second,
                           .number = number,
                           .node = node,
                           .address = {0x1018, 2},
                           .timeout = kTimeout},
                          now);
  }

  std::optional<Requester> second{std::in_place, arbiter};
};

// Each owner numbers its own requests: the same number means two requests.
TEST_F(TwoOwnersTest, ACompletionGoesToItsOwner) {
  submit(1);
  submit_second(1);
  serve();
  serve({0x43, 0x18, 0x10, 2, 9, 9, 9, 9});
  const std::vector<Completion> done = completions();
  ASSERT_EQ(done.size(), 1U);
  EXPECT_EQ(done[0].address, (od::Address{0x1018, 1}));
  const std::vector<Completion> of_second = second->take();
  ASSERT_EQ(of_second.size(), 1U);
  EXPECT_EQ(of_second[0].number, 1U);
  EXPECT_EQ(of_second[0].address, (od::Address{0x1018, 2}));
}

TEST_F(TwoOwnersTest, CancelLeavesTheRequestsOfOthers) {
  submit(1);
  submit_second(1);
  arbiter.cancel(*second, 5, 1);
  serve();
  const std::vector<Completion> done = completions();
  ASSERT_EQ(done.size(), 1U);
  EXPECT_EQ(done[0].abort, AbortCode::none);
  ASSERT_EQ(second->take().size(), 1U);
}

TEST_F(TwoOwnersTest, AnOwnerMaySubmitWhenATransferHasEnded) {
  client.on_completed = [this](const Completion& completion) {
    if (completion.number < 3) {
      submit(completion.number + 1);
      arbiter.cancel(client, 5, completion.number + 1);
    }
  };
  submit(1);
  serve();
  EXPECT_EQ(ended(), (std::vector<std::uint64_t>{1, 2, 3}));
}

TEST_F(TwoOwnersTest, TheRequestsOfAnOwnerThatGoesAreCancelled) {
  submit_second(1);
  submit(2);
  submit_second(3);
  drain(queue, 0x605);
  second.reset();
  EXPECT_EQ(arbiter.load(5), 1U);
  EXPECT_EQ(arbiter.counters().aborts, 2U);
  arbiter.advance(now);
  EXPECT_EQ(drain(queue, 0x605), (std::vector<Bytes>{abort_bytes(0x1018, 2, 0x0800'0000), kRead}));
  answer();
  EXPECT_EQ(ended(), (std::vector<std::uint64_t>{2}));
}

TEST_F(TwoOwnersTest, TheyAreCancelledAtEveryNode) {
  submit(1);
  drain(queue, 0x605);
  submit_second(1, 6);
  submit_second(2, 7);
  second.reset();
  EXPECT_EQ(arbiter.load(5), 1U);
  EXPECT_EQ(arbiter.load(6), 0U);
  EXPECT_EQ(arbiter.load(7), 0U);
}

TEST_F(TwoOwnersTest, WhatEndedIsNotDeliveredToAnOwnerThatHasGone) {
  submit_second(1);
  serve({0x43, 0x18, 0x10, 2, 9, 9, 9, 9});
  second.reset();
  EXPECT_TRUE(completions().empty());
}

class ArbiterDeathTest : public ArbiterTest {};

TEST_F(ArbiterDeathTest, AnOwnerMayNotGoBeforeItsRequests) {
  struct Careless final : TransferOwner {
    void completed(Completion& /*completion*/, Instant /*now*/) override {}
  };
  EXPECT_DEATH(
      {
        Careless careless;
        (void)arbiter.submit({.owner = &careless, .node = 5}, now);
      },
      "");
}

TEST_F(ArbiterDeathTest, CompletionsAreNotDeliveredByAnOwner) {
  client.on_completed = [this](const Completion& /*completion*/) {
    arbiter.deliver_completions(now);
  };
  submit(1);
  serve();
  EXPECT_DEATH(arbiter.deliver_completions(now), "");
}

}  // namespace
}  // namespace linegate::sdo::test

// SPDX-License-Identifier: Apache-2.0
#include "stack/sdo/request_queue.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace linegate::sdo {
namespace {

using testing::ElementsAre;

Request request(std::uint64_t owner, std::uint64_t number, Priority priority = Priority::boot) {
  Request out;
  out.token = owner << 48U | number;
  out.priority = priority;
  return out;
}

std::uint64_t token(std::uint64_t owner, std::uint64_t number) {
  return owner << 48U | number;
}

std::vector<std::uint64_t> pop_all(RequestQueue& queue) {
  std::vector<std::uint64_t> out;
  Request next;
  while (queue.pop(next)) {
    out.push_back(next.token);
  }
  return out;
}

TEST(RequestQueue, KeepsTheOrderOfOneOwner) {
  RequestQueue queue(8);
  for (std::uint64_t i = 1; i <= 4; ++i) {
    ASSERT_TRUE(queue.push(request(0, i)));
  }
  EXPECT_THAT(pop_all(queue), ElementsAre(1, 2, 3, 4));
}

TEST(RequestQueue, TakesTheMostUrgentFirst) {
  RequestQueue queue(8);
  queue.push(request(0, 1, Priority::background));
  queue.push(request(0, 2, Priority::routing));
  queue.push(request(0, 3, Priority::boot));
  queue.push(request(0, 4, Priority::command));
  EXPECT_THAT(pop_all(queue), ElementsAre(4, 3, 2, 1));
}

TEST(RequestQueue, OwnersTakeTurns) {
  RequestQueue queue(8);
  queue.push(request(1, 1));
  queue.push(request(1, 2));
  queue.push(request(1, 3));
  queue.push(request(2, 1));
  queue.push(request(2, 2));
  EXPECT_THAT(pop_all(queue),
              ElementsAre(token(1, 1), token(2, 1), token(1, 2), token(2, 2), token(1, 3)));
}

TEST(RequestQueue, AnOwnerThatAsksOneByOneDoesNotOvertakeTheOthers) {
  RequestQueue queue(8);
  queue.push(request(1, 1));
  queue.push(request(3, 1));
  queue.push(request(3, 2));
  Request next;
  std::vector<std::uint64_t> order;
  for (std::uint64_t i = 2; i <= 4; ++i) {
    ASSERT_TRUE(queue.pop(next));
    order.push_back(next.token);
    if (RequestQueue::owner(next) == 1) {
      queue.push(request(1, i));
    }
  }
  EXPECT_THAT(order, ElementsAre(token(1, 1), token(3, 1), token(3, 2)));
}

TEST(RequestQueue, EveryEighthIsTheOldest) {
  RequestQueue queue(64);
  queue.push(request(0, 99, Priority::background));
  for (std::uint64_t i = 1; i <= 20; ++i) {
    queue.push(request(0, i, Priority::command));
  }
  EXPECT_THAT(pop_all(queue), ElementsAre(1, 2, 3, 4, 5, 6, 7, 99, 8, 9, 10, 11, 12, 13, 14, 15, 16,
                                          17, 18, 19, 20));
}

TEST(RequestQueue, RefusesWhenFull) {
  RequestQueue queue(2);
  EXPECT_TRUE(queue.push(request(0, 1)));
  EXPECT_TRUE(queue.push(request(0, 2)));
  EXPECT_FALSE(queue.push(request(0, 3)));
  EXPECT_EQ(queue.size(), 2U);
}

TEST(RequestQueue, RemovesByToken) {
  RequestQueue queue(4);
  queue.push(request(0, 1));
  queue.push(request(0, 2));
  Request removed;
  EXPECT_FALSE(queue.remove(7, removed));
  EXPECT_TRUE(queue.remove(1, removed));
  EXPECT_EQ(removed.token, 1U);
  EXPECT_THAT(pop_all(queue), ElementsAre(2));
}

}  // namespace
}  // namespace linegate::sdo

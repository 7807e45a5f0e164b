// SPDX-License-Identifier: Apache-2.0
#include "stack/sdo/request_queue.h"

#include <array>
#include <utility>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace linegate::sdo {
namespace {

using testing::ElementsAre;

struct Owner final : TransferOwner {
  void completed(Completion& /*completion*/, Instant /*now*/) override {}
};
std::array<Owner, 4> owners;

Request request(std::size_t owner, std::uint64_t number, Priority priority = Priority::boot) {
  return {.owner = &owners.at(owner), .number = number, .priority = priority};
}

// A request: owner and number.
using Name = std::pair<std::size_t, std::uint64_t>;

Name name(const Request& request) {
  return {static_cast<std::size_t>(static_cast<Owner*>(request.owner) - owners.data()),
          request.number};
}

std::vector<Name> pop_all(RequestQueue& queue) {
  std::vector<Name> out;
  Request next;
  while (queue.pop(next)) {
    out.push_back(name(next));
  }
  return out;
}

// The numbers of the requests of owner 0.
std::vector<std::uint64_t> pop_numbers(RequestQueue& queue) {
  std::vector<std::uint64_t> out;
  for (const Name& each : pop_all(queue)) {
    EXPECT_EQ(each.first, 0U);
    out.push_back(each.second);
  }
  return out;
}

TEST(RequestQueue, KeepsTheOrderOfOneOwner) {
  RequestQueue queue(8);
  for (std::uint64_t i = 1; i <= 4; ++i) {
    ASSERT_TRUE(queue.push(request(0, i)));
  }
  EXPECT_THAT(pop_numbers(queue), ElementsAre(1, 2, 3, 4));
}

TEST(RequestQueue, TakesTheMostUrgentFirst) {
  RequestQueue queue(8);
  queue.push(request(0, 1, Priority::background));
  queue.push(request(0, 2, Priority::routing));
  queue.push(request(0, 3, Priority::boot));
  queue.push(request(0, 4, Priority::command));
  EXPECT_THAT(pop_numbers(queue), ElementsAre(4, 3, 2, 1));
}

TEST(RequestQueue, OwnersTakeTurns) {
  RequestQueue queue(8);
  queue.push(request(1, 1));
  queue.push(request(1, 2));
  queue.push(request(1, 3));
  queue.push(request(2, 1));
  queue.push(request(2, 2));
  EXPECT_THAT(pop_all(queue),
              ElementsAre(Name(1, 1), Name(2, 1), Name(1, 2), Name(2, 2), Name(1, 3)));
}

TEST(RequestQueue, GroupsOfAnOwnerTakeTurns) {
  RequestQueue queue(8);
  const auto of_group = [](std::uint8_t group, std::uint64_t number) {
    Request out = request(0, number);
    out.group = group;
    return out;
  };
  queue.push(of_group(1, 1));
  queue.push(of_group(1, 2));
  queue.push(of_group(2, 3));
  EXPECT_THAT(pop_numbers(queue), ElementsAre(1, 3, 2));
}

TEST(RequestQueue, AnOwnerThatAsksOneByOneDoesNotOvertakeTheOthers) {
  RequestQueue queue(8);
  queue.push(request(1, 1));
  queue.push(request(3, 1));
  queue.push(request(3, 2));
  Request next;
  std::vector<Name> order;
  for (std::uint64_t i = 2; i <= 4; ++i) {
    ASSERT_TRUE(queue.pop(next));
    order.push_back(name(next));
    if (order.back().first == 1) {
      queue.push(request(1, i));
    }
  }
  EXPECT_THAT(order, ElementsAre(Name(1, 1), Name(3, 1), Name(3, 2)));
}

TEST(RequestQueue, EveryEighthIsTheOldest) {
  RequestQueue queue(64);
  queue.push(request(0, 99, Priority::background));
  for (std::uint64_t i = 1; i <= 20; ++i) {
    queue.push(request(0, i, Priority::command));
  }
  EXPECT_THAT(pop_numbers(queue), ElementsAre(1, 2, 3, 4, 5, 6, 7, 99, 8, 9, 10, 11, 12, 13, 14, 15,
                                              16, 17, 18, 19, 20));
}

TEST(RequestQueue, RefusesWhenFull) {
  RequestQueue queue(2);
  EXPECT_TRUE(queue.push(request(0, 1)));
  EXPECT_TRUE(queue.push(request(0, 2)));
  EXPECT_FALSE(queue.push(request(0, 3)));
  EXPECT_EQ(queue.size(), 2U);
}

TEST(RequestQueue, RemovesByOwnerAndNumber) {
  RequestQueue queue(4);
  queue.push(request(0, 1));
  queue.push(request(0, 2));
  Request removed;
  EXPECT_FALSE(queue.remove(owners[0], 7, removed));
  EXPECT_FALSE(queue.remove(owners[1], 1, removed));
  EXPECT_TRUE(queue.remove(owners[0], 1, removed));
  EXPECT_EQ(removed.number, 1U);
  EXPECT_THAT(pop_numbers(queue), ElementsAre(2));
}

TEST(RequestQueue, RemovesAllOfAnOwner) {
  RequestQueue queue(4);
  queue.push(request(0, 1));
  queue.push(request(1, 1));
  queue.push(request(0, 2));
  EXPECT_EQ(queue.remove_all(owners[0]), 2U);
  EXPECT_THAT(pop_all(queue), ElementsAre(Name(1, 1)));
}

class OnePermitted final : public Pace {
 public:
  explicit OnePermitted(std::uint32_t client) : client_(client) {}
  bool permits(std::uint32_t client, bool /*awaited*/) const override { return client == client_; }
  void count(std::uint32_t /*client*/, const can::Header& /*frame*/) override {}

 private:
  std::uint32_t client_;
};

// Also at the turn of the one that waits longest.
TEST(RequestQueue, PassesOverRequestsThatThePaceDoesNotPermit) {
  RequestQueue queue(32);
  const auto of = [](std::uint32_t client, std::uint64_t number, Priority priority) {
    Request out = request(0, number, priority);
    out.client = client;
    return out;
  };
  ASSERT_TRUE(queue.push(of(1, 1, Priority::command)));
  for (std::uint64_t i = 2; i <= 2 * RequestQueue::kOldestEvery; ++i) {
    ASSERT_TRUE(queue.push(of(2, i, Priority::background)));
  }
  ASSERT_TRUE(queue.push(of(0, 100, Priority::background)));
  const OnePermitted second(2);
  Request next;
  for (std::uint64_t i = 2; i <= 2 * RequestQueue::kOldestEvery; ++i) {
    ASSERT_TRUE(queue.pop(next, &second));
    EXPECT_EQ(next.number, i);
  }
  ASSERT_TRUE(queue.pop(next, &second));
  EXPECT_EQ(next.number, 100U) << "without a client";
  EXPECT_FALSE(queue.pop(next, &second));
  EXPECT_EQ(queue.size(), 1U);
  ASSERT_TRUE(queue.pop(next));
  EXPECT_EQ(next.number, 1U);
}

}  // namespace
}  // namespace linegate::sdo

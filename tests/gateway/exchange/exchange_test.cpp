// SPDX-License-Identifier: Apache-2.0
#include <cstdint>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>
#include <poll.h>
#include <sys/epoll.h>
#include <unistd.h>

#include "gateway/exchange/cell.h"
#include "gateway/exchange/handover.h"
#include "gateway/exchange/ring.h"
#include "gateway/exchange/wakeup.h"

namespace linegate::exchange {
namespace {

bool readable(int descriptor) {
  pollfd p{descriptor, POLLIN, 0};
  return poll(&p, 1, 0) == 1;
}

TEST(Ring, HasTheNextPowerOfTwoOfPlaces) {
  EXPECT_EQ(Ring<int>(0).capacity(), 2U);
  EXPECT_EQ(Ring<int>(5).capacity(), 8U);
  EXPECT_EQ(Ring<int>(8).capacity(), 8U);
}

TEST(Ring, KeepsOrderAndRefusesWhenFull) {
  Ring<int> ring(4);
  int out = -1;
  EXPECT_FALSE(ring.pop(out));
  EXPECT_EQ(out, -1);
  for (int round = 0; round < 5; ++round) {
    for (int i = 0; i < 4; ++i) {
      EXPECT_EQ(ring.room(), static_cast<std::size_t>(4 - i));
      EXPECT_TRUE(ring.push(int{i}));
    }
    EXPECT_FALSE(ring.push(99));
    for (int i = 0; i < 4; ++i) {
      ASSERT_TRUE(ring.pop(out));
      EXPECT_EQ(out, i);
    }
    EXPECT_FALSE(ring.pop(out));
  }
}

TEST(Ring, KeepsARefusedElementWithItsOwner) {
  Ring<std::string> ring(2);
  ring.push(std::string("a"));
  ring.push(std::string("b"));
  std::string c = "c";
  EXPECT_FALSE(ring.push(c));
  EXPECT_EQ(c, "c");
  EXPECT_FALSE(ring.push(std::move(c)));
  EXPECT_EQ(c, "c");
}

TEST(Ring, GivesTheBuffersOfReadElementsBackToTheProducer) {
  Ring<std::vector<int>> ring(2);
  std::vector<int> out;
  out.reserve(1000);
  const int* buffer = out.data();
  std::vector<int> in{1};
  ring.push(in);
  ring.pop(out);
  EXPECT_EQ(out, std::vector<int>{1});
  in = {2};
  ring.push(in);
  in = {3};
  ring.push(in);
  EXPECT_EQ(in.data(), buffer);
}

TEST(Ring, TwoThreadsSeeEveryElementInOrder) {
  Ring<std::uint64_t> ring(64);
  constexpr std::uint64_t kCount = 200'000;
  std::thread producer([&] {
    for (std::uint64_t i = 0; i < kCount;) {
      if (ring.push(std::uint64_t{i})) {
        ++i;
      } else {
        std::this_thread::yield();
      }
    }
  });
  std::uint64_t wrong = 0;
  for (std::uint64_t expected = 0; expected < kCount;) {
    std::uint64_t value = 0;
    if (!ring.pop(value)) {
      std::this_thread::yield();
      continue;
    }
    wrong += value != expected ? 1U : 0U;
    ++expected;
  }
  producer.join();
  EXPECT_EQ(wrong, 0U);
}

TEST(Handover, GivesEachValueOnce) {
  Handover<int> handover;
  EXPECT_EQ(handover.fetch(), nullptr);
  auto draft = handover.draft();
  EXPECT_FALSE(draft.unread);
  draft.value = 7;
  EXPECT_EQ(handover.fetch(), nullptr);
  handover.publish();
  const int* value = handover.fetch();
  ASSERT_NE(value, nullptr);
  EXPECT_EQ(*value, 7);
  EXPECT_EQ(handover.fetch(), nullptr);
}

TEST(Handover, GivesAnUnreadValueBackToBeMerged) {
  Handover<std::vector<int>> handover;
  handover.draft().value.push_back(1);
  handover.publish();
  auto draft = handover.draft();
  EXPECT_TRUE(draft.unread);
  EXPECT_EQ(handover.fetch(), nullptr) << "the producer is changing the value";
  draft.value.push_back(2);
  handover.publish();
  const auto* value = handover.fetch();
  ASSERT_NE(value, nullptr);
  EXPECT_EQ(*value, (std::vector<int>{1, 2}));
  EXPECT_FALSE(handover.draft().unread);
}

TEST(Handover, LeavesTheFetchedValueAlone) {
  Handover<int> handover;
  handover.draft().value = 1;
  handover.publish();
  const int* first = handover.fetch();
  for (int i = 2; i < 6; ++i) {
    handover.draft().value = i;
    handover.publish();
  }
  EXPECT_EQ(*first, 1);
  const int* last = handover.fetch();
  ASSERT_NE(last, nullptr);
  EXPECT_EQ(*last, 5);
}

// The sum of the counts that the consumer fetches equals the number of published values, however
// often the producer replaced a value that was not fetched.
TEST(Handover, TwoThreadsLoseNoCount) {
  struct Counted {
    std::uint64_t newest = 0;
    std::uint64_t since_last = 0;
  };
  Handover<Counted> handover;
  constexpr std::uint64_t kCount = 200'000;
  Flag done;
  std::thread producer([&] {
    for (std::uint64_t i = 1; i <= kCount; ++i) {
      auto draft = handover.draft();
      draft.value.since_last = draft.unread ? draft.value.since_last + 1 : 1;
      draft.value.newest = i;
      handover.publish();
    }
    done.raise();
  });
  std::uint64_t sum = 0;
  std::uint64_t last = 0;
  bool backwards = false;
  for (bool finished = false; !finished;) {
    finished = done.raised();
    if (const Counted* value = handover.fetch()) {
      sum += value->since_last;
      backwards = backwards || value->newest <= last;
      last = value->newest;
    }
  }
  producer.join();
  EXPECT_EQ(sum, kCount);
  EXPECT_EQ(last, kCount);
  EXPECT_FALSE(backwards);
}

TEST(Wakeup, IsReadableFromSignalToClear) {
  Wakeup wakeup;
  EXPECT_FALSE(readable(wakeup.descriptor()));
  wakeup.signal();
  wakeup.signal();
  EXPECT_TRUE(readable(wakeup.descriptor()));
  wakeup.clear();
  EXPECT_FALSE(readable(wakeup.descriptor()));
  wakeup.signal();
  EXPECT_TRUE(readable(wakeup.descriptor()));
}

constexpr int kSignals = 5000;

// Pushes kSignals values, each with a signal.
std::thread produce(Ring<int>& ring, Wakeup& wakeup) {
  return std::thread([&] {
    for (int i = 0; i < kSignals;) {
      if (ring.push(int{i})) {
        ++i;
        wakeup.signal();
      } else {
        std::this_thread::yield();
      }
    }
  });
}

TEST(Wakeup, NoSignalIsMissedBetweenThreads) {
  Wakeup wakeup;
  Ring<int> ring(2);
  std::thread producer = produce(ring, wakeup);
  int received = 0;
  while (received < kSignals) {
    pollfd p{wakeup.descriptor(), POLLIN, 0};
    ASSERT_EQ(poll(&p, 1, 10'000), 1) << "a wake-up was lost after " << received;
    wakeup.clear();
    for (int value = 0; ring.pop(value);) {
      ++received;
    }
  }
  producer.join();
  EXPECT_EQ(received, kSignals);
}

TEST(Wakeup, NoEdgeIsMissedBetweenThreads) {
  Wakeup wakeup;
  const int epoll = epoll_create1(EPOLL_CLOEXEC);
  epoll_event wanted{};
  wanted.events = EPOLLIN | EPOLLET;
  ASSERT_EQ(epoll_ctl(epoll, EPOLL_CTL_ADD, wakeup.descriptor(), &wanted), 0);
  epoll_event event{};
  EXPECT_EQ(epoll_wait(epoll, &event, 1, 0), 0);
  wakeup.signal();
  EXPECT_EQ(epoll_wait(epoll, &event, 1, 0), 1);
  EXPECT_EQ(epoll_wait(epoll, &event, 1, 0), 0) << "an edge is reported once";
  wakeup.clear_edge();
  Ring<int> ring(2);
  std::thread producer = produce(ring, wakeup);
  int received = 0;
  while (received < kSignals) {
    ASSERT_EQ(epoll_wait(epoll, &event, 1, 10'000), 1) << "a wake-up was lost after " << received;
    wakeup.clear_edge();
    for (int value = 0; ring.pop(value);) {
      ++received;
    }
  }
  producer.join();
  EXPECT_EQ(received, kSignals);
  close(epoll);
}

TEST(Counter, AddsUp) {
  Counter counter;
  counter.add();
  counter.add(4);
  EXPECT_EQ(counter.value(), 5U);
}

}  // namespace
}  // namespace linegate::exchange

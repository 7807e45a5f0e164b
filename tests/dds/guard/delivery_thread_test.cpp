// SPDX-License-Identifier: Apache-2.0
#include "bridges/dds/guard/delivery_thread.h"

#include <future>
#include <mutex>
#include <vector>

#include <gtest/gtest.h>

namespace linegate::dds::guard {
namespace {

constexpr auto kMayWait = [] { return false; };
constexpr auto kMustNotWait = [] { return true; };

// Delivers numbers; the delivery of 0 takes until it is released.
class DeliveryThreadTest : public testing::Test {
 protected:
  void deliver(int number) {
    if (number == 0) {
      begun_.set_value();
      released_.get_future().wait();
    }
    const std::lock_guard lock(mutex_);
    delivered_.push_back(number);
    if (number == kLast)
      ended_.set_value();
  }
  std::vector<int> delivered() {
    const std::lock_guard lock(mutex_);
    return delivered_;
  }

  static constexpr int kLast = -1;
  std::promise<void> begun_;
  std::promise<void> released_;
  std::promise<void> ended_;
  std::mutex mutex_;
  std::vector<int> delivered_;
  DeliveryThread<int> thread_{[this](int& number) { deliver(number); }};
};

TEST_F(DeliveryThreadTest, ItemsAreDeliveredInTheirOrder) {
  for (const int number : {1, 2, 3, kLast})
    EXPECT_TRUE(thread_.add(number, 100, kMayWait));
  ended_.get_future().wait();
  EXPECT_EQ(delivered(), (std::vector<int>{1, 2, 3, kLast}));
}

TEST_F(DeliveryThreadTest, WhoAddsDoesNotWaitForTheDelivery) {
  EXPECT_TRUE(thread_.add(0, 100, kMustNotWait));
  begun_.get_future().wait();
  EXPECT_TRUE(thread_.add(1, 100, kMustNotWait));
  EXPECT_TRUE(thread_.add(kLast, 100, kMustNotWait));
  EXPECT_TRUE(delivered().empty());
  released_.set_value();
  ended_.get_future().wait();
  EXPECT_EQ(delivered(), (std::vector<int>{0, 1, kLast}));
}

// The lock of the sending threads is held by a thread that waits for the one that adds.
TEST_F(DeliveryThreadTest, AnItemWithoutRoomIsDroppedByAThreadThatMustNotWait) {
  EXPECT_TRUE(thread_.add(0, 100, kMustNotWait));
  begun_.get_future().wait();
  EXPECT_TRUE(thread_.add(1, DeliveryThread<int>::kRoom, kMustNotWait));
  EXPECT_FALSE(thread_.add(2, 1, kMustNotWait));
  released_.set_value();
  EXPECT_TRUE(thread_.add(kLast, 1, kMayWait));
  ended_.get_future().wait();
  EXPECT_EQ(delivered(), (std::vector<int>{0, 1, kLast}));
}

TEST_F(DeliveryThreadTest, AnItemThatNeedsAllRoomIsDelivered) {
  EXPECT_TRUE(thread_.add(kLast, 2 * DeliveryThread<int>::kRoom, kMayWait));
  ended_.get_future().wait();
}

TEST_F(DeliveryThreadTest, AfterDroppingAllNothingIsDelivered) {
  EXPECT_TRUE(thread_.add(0, 100, kMayWait));
  EXPECT_TRUE(thread_.add(1, 100, kMayWait));
  begun_.get_future().wait();
  auto dropped = std::async(std::launch::async, [this] { thread_.drop_all(); });
  released_.set_value();
  dropped.wait();
  const std::vector<int> before = delivered();
  EXPECT_TRUE(thread_.add(kLast, 100, kMayWait));
  ended_.get_future().wait();
  EXPECT_EQ(before.front(), 0);
  EXPECT_EQ(delivered().size(), before.size() + 1);
}

}  // namespace
}  // namespace linegate::dds::guard

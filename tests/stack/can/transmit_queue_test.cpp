// SPDX-License-Identifier: Apache-2.0
#include "stack/can/transmit_queue.h"

#include <gtest/gtest.h>

#include "stack/can/cob_id.h"

namespace linegate::can {
namespace {

TEST(TransmitQueue, GivesFramesInTheOrderOfTheBus) {
  TransmitQueue queue(4);
  EXPECT_TRUE(queue.push(TransmitClass::error_control, make_frame(0x701)));
  EXPECT_TRUE(queue.push(TransmitClass::sdo, make_frame(0x601)));
  EXPECT_TRUE(queue.push(TransmitClass::emcy, make_frame(0x081)));
  EXPECT_TRUE(queue.push(TransmitClass::sync, make_frame(0x080)));
  EXPECT_TRUE(queue.push(TransmitClass::nmt, make_frame(0x000)));
  Frame out;
  for (std::uint32_t id : {0x000U, 0x080U, 0x081U}) {
    ASSERT_TRUE(queue.pop_urgent(out));
    EXPECT_EQ(out.id, id);
  }
  EXPECT_FALSE(queue.pop_urgent(out));
  for (std::uint32_t id : {0x601U, 0x701U}) {
    ASSERT_TRUE(queue.pop_rest(out));
    EXPECT_EQ(out.id, id);
  }
  EXPECT_TRUE(queue.empty());
}

TEST(TransmitQueue, GivesFramesOfAllClassesInTheOrderOfTheBus) {
  TransmitQueue queue(4);
  Frame out;
  EXPECT_FALSE(queue.pop(out));
  EXPECT_TRUE(queue.push(TransmitClass::error_control, make_frame(0x701)));
  EXPECT_TRUE(queue.push(TransmitClass::sdo, make_frame(0x601)));
  EXPECT_TRUE(queue.push(TransmitClass::sdo, make_frame(0x602)));
  EXPECT_TRUE(queue.push(TransmitClass::nmt, make_frame(0x000)));
  for (std::uint32_t id : {0x000U, 0x601U, 0x602U, 0x701U}) {
    ASSERT_TRUE(queue.pop(out));
    EXPECT_EQ(out.id, id);
  }
  EXPECT_FALSE(queue.pop(out));
}

TEST(TransmitQueue, AFullClassRefusesAndLosesNothing) {
  TransmitQueue queue(2);
  EXPECT_TRUE(queue.push(TransmitClass::sdo, make_frame(0x601)));
  EXPECT_TRUE(queue.push(TransmitClass::sdo, make_frame(0x602)));
  EXPECT_EQ(queue.room(TransmitClass::sdo), 0U);
  EXPECT_FALSE(queue.push(TransmitClass::sdo, make_frame(0x603)));
  EXPECT_EQ(queue.refused(), 1U);
  EXPECT_TRUE(queue.push(TransmitClass::nmt, make_frame(0x000)));
  Frame out;
  ASSERT_TRUE(queue.pop_rest(out));
  EXPECT_EQ(out.id, 0x601U);
  EXPECT_TRUE(queue.push(TransmitClass::sdo, make_frame(0x603)));
  ASSERT_TRUE(queue.pop_rest(out));
  ASSERT_TRUE(queue.pop_rest(out));
  EXPECT_EQ(out.id, 0x603U);
}

TEST(TransmitQueue, GivesFramesBackWhole) {
  TransmitQueue queue(2);
  Frame fd;
  fd.id = 0x18F;
  fd.flags = Frame::kExtended | Frame::kFd | Frame::kBitRateSwitch;
  fd.length = 64;
  fd.data.fill(std::byte{0xA5});
  const Frame classic = make_frame(0x701, {1, 2, 3, 4, 5, 6, 7, 8});
  // More frames than the queue holds, so that its ring buffer wraps around.
  for (int i = 0; i < 5; ++i) {
    ASSERT_TRUE(queue.push(TransmitClass::sdo, i % 2 == 0 ? fd : classic));
    ASSERT_TRUE(queue.push(TransmitClass::sdo, classic));
    Frame out;
    ASSERT_TRUE(queue.pop_rest(out));
    EXPECT_TRUE(same_content(out, i % 2 == 0 ? fd : classic));
    ASSERT_TRUE(queue.pop_rest(out));
    EXPECT_TRUE(same_content(out, classic));
    EXPECT_FALSE(queue.pop_rest(out));
  }
}

TEST(TransmitQueue, TakesEightBytesAsANumber) {
  TransmitQueue queue(2);
  ASSERT_TRUE(queue.push(TransmitClass::sdo, CobId{0x585}.header(8), 0x8877665544332211));
  ASSERT_TRUE(queue.push(TransmitClass::sdo, CobId{CobId::kExtendedBit | 0x12345}.header(8), 0));
  EXPECT_FALSE(queue.push(TransmitClass::sdo, CobId{0x585}.header(8), 0));
  Frame out;
  ASSERT_TRUE(queue.pop_rest(out));
  EXPECT_TRUE(
      same_content(out, make_frame(0x585, {0x11, 0x22, 0x33, 0x44, 0x55, 0x66, 0x77, 0x88})));
  ASSERT_TRUE(queue.pop_rest(out));
  EXPECT_EQ(out.id, 0x12345U);
  EXPECT_TRUE(out.extended());
  EXPECT_EQ(out.length, 8);
}

TEST(TransmitQueue, HoldsWhatWasNotHandedOut) {
  TransmitQueue queue(2);
  const Header wanted{.id = 0x602, .length = 8, .flags = 0};
  EXPECT_TRUE(queue.push(TransmitClass::sdo, make_frame(0x601)));
  EXPECT_FALSE(queue.holds(TransmitClass::sdo, wanted));
  Frame out;
  ASSERT_TRUE(queue.pop_rest(out));
  EXPECT_TRUE(queue.push(TransmitClass::sdo, make_frame(0x603)));
  EXPECT_TRUE(queue.push(TransmitClass::sdo, make_frame(0x602)));
  EXPECT_TRUE(queue.holds(TransmitClass::sdo, wanted));
  EXPECT_FALSE(queue.holds(TransmitClass::emcy, wanted));
  ASSERT_TRUE(queue.pop_rest(out));
  ASSERT_TRUE(queue.pop_rest(out));
  EXPECT_FALSE(queue.holds(TransmitClass::sdo, wanted));
}

TEST(TransmitQueue, ShowsWhatItGivesNext) {
  TransmitQueue queue(4);
  EXPECT_EQ(queue.first(), nullptr);
  queue.push(TransmitClass::error_control, make_frame(0x701));
  EXPECT_EQ(queue.first_urgent(), nullptr);
  queue.push(TransmitClass::sync, make_frame(0x080));
  queue.push(TransmitClass::sdo, make_frame(0x601));
  queue.push(TransmitClass::sdo, make_frame(0x602));
  Frame out;
  for (const std::uint32_t id : {0x080U, 0x601U, 0x602U, 0x701U}) {
    ASSERT_NE(queue.first(), nullptr);
    EXPECT_EQ(queue.first()->id, id);
    EXPECT_EQ(id == 0x080 ? queue.first_urgent() : queue.first_rest(), queue.first());
    ASSERT_TRUE(queue.pop(out));
    EXPECT_EQ(out.id, id);
  }
  EXPECT_EQ(queue.first_rest(), nullptr);
}

TEST(TransmitQueue, IsEmptyAfterClear) {
  TransmitQueue queue(2);
  EXPECT_TRUE(queue.push(TransmitClass::nmt, make_frame(0x000)));
  EXPECT_TRUE(queue.push(TransmitClass::error_control, make_frame(0x701)));
  queue.clear();
  Frame out;
  EXPECT_TRUE(queue.empty());
  EXPECT_FALSE(queue.pop_urgent(out));
  EXPECT_FALSE(queue.pop_rest(out));
}

}  // namespace
}  // namespace linegate::can

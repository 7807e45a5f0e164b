#include "stack/can/transmit_queue.h"

#include <gtest/gtest.h>

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

}  // namespace
}  // namespace linegate::can

// SPDX-License-Identifier: Apache-2.0
#include "stack/can/dispatch.h"

#include <gtest/gtest.h>

namespace linegate::can {
namespace {

Frame extended(std::uint32_t id) {
  Frame frame;
  frame.id = id;
  frame.flags = Frame::kExtended;
  return frame;
}

TEST(Dispatch, EveryStandardIdentifierHasItsOwnTarget) {
  Dispatch dispatch;
  for (std::uint32_t id = 0; id < 0x800; ++id) {
    dispatch.add(id, false, Service::rpdo, static_cast<std::uint16_t>(id));
  }
  for (std::uint32_t id = 0; id < 0x800; ++id) {
    const Target* target = dispatch.find(make_frame(id));
    ASSERT_NE(target, nullptr);
    EXPECT_EQ(target->index, id);
    EXPECT_EQ(dispatch.next(*target), nullptr);
  }
}

TEST(Dispatch, StandardAndExtendedIdentifiersAreDifferent) {
  Dispatch dispatch;
  dispatch.add(0x181, false, Service::rpdo, 1);
  EXPECT_EQ(dispatch.find(extended(0x181)), nullptr);
  dispatch.add(0x181, true, Service::rpdo, 2);
  EXPECT_EQ(dispatch.find(make_frame(0x181))->index, 1U);
  EXPECT_EQ(dispatch.find(extended(0x181))->index, 2U);
}

TEST(Dispatch, SeveralTargetsInTheOrderOfAdding) {
  Dispatch dispatch;
  dispatch.add(0x080, false, Service::sync, 0);
  dispatch.add(0x080, false, Service::rpdo, 7);
  dispatch.add(0x080, false, Service::sync, 0);
  const Target* first = dispatch.find(make_frame(0x080));
  ASSERT_NE(first, nullptr);
  EXPECT_EQ(first->service, Service::sync);
  const Target* second = dispatch.next(*first);
  ASSERT_NE(second, nullptr);
  EXPECT_EQ(second->service, Service::rpdo);
  EXPECT_EQ(dispatch.next(*second), nullptr);
}

TEST(Dispatch, RemovedTargetsLeaveTheOthersInPlace) {
  Dispatch dispatch;
  for (std::uint16_t i = 0; i < 3; ++i) {
    dispatch.add(0x200, false, Service::rpdo, i);
  }
  dispatch.remove(0x200, false, Service::rpdo, 1);
  const Target* target = dispatch.find(make_frame(0x200));
  ASSERT_NE(target, nullptr);
  EXPECT_EQ(target->index, 0U);
  target = dispatch.next(*target);
  ASSERT_NE(target, nullptr);
  EXPECT_EQ(target->index, 2U);
  dispatch.remove(0x200, false, Service::rpdo, 0);
  dispatch.remove(0x200, false, Service::rpdo, 2);
  dispatch.remove(0x200, false, Service::rpdo, 2);
  EXPECT_EQ(dispatch.find(make_frame(0x200)), nullptr);
}

TEST(Dispatch, TargetsCanBeFoundByWhenTheyWereAdded) {
  Dispatch dispatch;
  const Frame frame = make_frame(0x200);
  for (std::uint16_t i = 0; i < 3; ++i) {
    dispatch.add(0x200, false, Service::rpdo, i);
  }
  const std::uint64_t arrival = dispatch.changes();
  const std::uint64_t first = dispatch.added(*dispatch.find(frame));
  dispatch.remove(0x200, false, Service::rpdo, 1);
  dispatch.add(0x200, false, Service::rpdo, 1);
  EXPECT_NE(dispatch.changes(), arrival);
  const Target* next = dispatch.find_added(frame, first, arrival);
  ASSERT_NE(next, nullptr);
  EXPECT_EQ(next->index, 2U);
  EXPECT_EQ(dispatch.find_added(frame, dispatch.added(*next), arrival), nullptr);
  EXPECT_EQ(dispatch.find_added(make_frame(0x201), 0, dispatch.changes()), nullptr);
}

TEST(Dispatch, ThousandsOfExtendedIdentifiers) {
  Dispatch dispatch;
  for (std::uint32_t i = 0; i < 5000; ++i) {
    dispatch.add(i * 104729U & 0x1FFF'FFFFU, true, Service::rpdo, static_cast<std::uint16_t>(i));
  }
  for (std::uint32_t i = 0; i < 5000; ++i) {
    const Target* target = dispatch.find(extended(i * 104729U & 0x1FFF'FFFFU));
    ASSERT_NE(target, nullptr);
    EXPECT_EQ(target->index, i);
  }
  EXPECT_EQ(dispatch.find(extended(0x1FFF'FFFF)), nullptr);
}

TEST(Dispatch, ComingAndGoingExtendedIdentifiersDoNotFillTheTable) {
  Dispatch dispatch;
  for (std::uint32_t id = 0; id < 100'000; ++id) {
    dispatch.add(id, true, Service::rpdo, 1);
    EXPECT_NE(dispatch.find(extended(id)), nullptr);
    dispatch.remove(id, true, Service::rpdo, 1);
    EXPECT_EQ(dispatch.find(extended(id)), nullptr);
  }
}

}  // namespace
}  // namespace linegate::can

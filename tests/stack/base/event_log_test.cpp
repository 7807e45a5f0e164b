// SPDX-License-Identifier: Apache-2.0
#include "stack/base/event_log.h"

#include <array>
#include <initializer_list>

#include <gtest/gtest.h>

namespace linegate {
namespace {

Event boot_up(std::uint8_t node) {
  return {.node = node, .data = event::BootUp{}};
}

TEST(EventLog, NumbersFromOneWithoutGaps) {
  EventLog log(8);
  log.emit(boot_up(1));
  log.emit(boot_up(2));
  std::array<Event, 4> out;
  ASSERT_EQ(log.take(out), 2U);
  EXPECT_EQ(out[0].number, 1U);
  EXPECT_EQ(out[1].number, 2U);
  EXPECT_TRUE(log.empty());
}

TEST(EventLog, AFullRingTellsTheLostRange) {
  EventLog log(2);
  for (std::uint8_t node = 1; node <= 5; ++node) {
    log.emit(boot_up(node));
  }
  EXPECT_EQ(log.lost(), 3U);
  std::array<Event, 8> out;
  ASSERT_EQ(log.take(out), 3U);
  EXPECT_EQ(out[1].number, 2U);
  EXPECT_EQ(out[2].number, 5U);
  EXPECT_EQ(out[2].data, EventData(event::EventsLost{.first = 3, .last = 5}));
  log.emit(boot_up(6));
  ASSERT_EQ(log.take(out), 1U);
  EXPECT_EQ(out[0].number, 6U);
}

TEST(EventLog, TheMarkerKeepsItsPlaceInTheSequence) {
  EventLog log(3);
  for (std::uint8_t node = 1; node <= 4; ++node) {
    log.emit(boot_up(node));  // the log is full: event 4 is lost
  }
  std::array<Event, 2> two;
  ASSERT_EQ(log.take(two), 2U);
  log.emit(boot_up(5));
  std::array<Event, 8> out;
  ASSERT_EQ(log.take(out), 3U);
  EXPECT_EQ(out[0].number, 3U);
  EXPECT_EQ(out[1].kind(), EventKind::events_lost);
  EXPECT_EQ(out[1].number, 4U);
  EXPECT_EQ(out[2].number, 5U);
}

TEST(EventLog, OneOfADeviceHandsOnByTheNameOfTheDevice) {
  EventLog line;
  EventLog device(line, 5);
  device.set_own_node(6);
  for (const std::uint8_t node : std::initializer_list<std::uint8_t>{0, 6, 5, 7}) {
    device.emit(boot_up(node));
  }
  line.emit(boot_up(6));
  EXPECT_TRUE(device.empty());
  std::array<Event, 8> out;
  ASSERT_EQ(line.take(out), 5U);
  const std::array expected{5, 5, 5, 7, 6};
  for (std::size_t i = 0; i < expected.size(); ++i) {
    EXPECT_EQ(out[i].node, expected[i]) << i;
    EXPECT_EQ(out[i].number, i + 1);
  }
}

TEST(EventLog, ItsNewestEventsAreThereTakenOrNot) {
  EventLog log(8);
  std::array<Event, 4> newest;
  EXPECT_EQ(log.newest(newest), 0U);
  for (std::uint8_t node = 1; node <= 3; ++node) {
    log.emit(boot_up(node));
  }
  std::array<Event, 2> taken;
  ASSERT_EQ(log.take(taken), 2U);
  ASSERT_EQ(log.newest(newest), 3U);
  EXPECT_EQ(newest[0].number, 1U);
  EXPECT_EQ(newest[2].number, 3U);
  for (std::uint8_t node = 4; node <= 9; ++node) {
    log.emit(boot_up(node));
  }
  ASSERT_EQ(log.newest(newest), newest.size());
  EXPECT_EQ(newest[0].number, 6U);
  EXPECT_EQ(newest[3].number, 9U);
  EXPECT_EQ(log.take(taken), 2U) << "newest() removes no event";
}

TEST(EventKinds, EveryKindHasAName) {
  for (std::size_t i = 0; i < kEventKinds; ++i) {
    EXPECT_NE(name(static_cast<EventKind>(i)), "unknown");
    EXPECT_FALSE(name(static_cast<EventKind>(i)).empty()) << i;
  }
  EXPECT_EQ(name(static_cast<EventKind>(kEventKinds)), "unknown");
  EXPECT_EQ(name(EventKind::queue_full), "queue-full");
}

}  // namespace
}  // namespace linegate

// SPDX-License-Identifier: Apache-2.0
#include "stack/base/repeat_limit.h"

#include <map>
#include <tuple>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

namespace linegate {
namespace {

using std::chrono::milliseconds;

Event malformed(std::uint32_t id, Duration when, std::uint8_t node = 5) {
  event::MalformedFrame frame{.identifier = id, .length = 8};
  frame.data.fill(std::byte{0xAA});
  return {.time = Instant{when}, .node = node, .data = frame};
}

const event::MalformedFrame& frame_of(const Event& event) {
  return std::get<event::MalformedFrame>(event.data);
}

std::uint32_t held_back(const Event& event) {
  return frame_of(event).suppressed;
}

TEST(RepeatLimit, TheFirstAtOnceThenOneASecondWithHowManyWereHeldBack) {
  RepeatLimit limit;
  std::vector<std::pair<int, std::uint32_t>> told;
  for (int ms = 0; ms < 2500; ++ms) {
    Event event = malformed(0x585, milliseconds(ms));
    if (limit.admit(event)) {
      told.emplace_back(ms, held_back(event));
    }
  }
  const std::vector<std::pair<int, std::uint32_t>> expected{{0, 0}, {1000, 999}, {2000, 999}};
  EXPECT_EQ(told, expected);
}

TEST(RepeatLimit, RefusedOutputsAreThoseOfAGroup) {
  RepeatLimit limit;
  const auto refused = [](std::uint16_t group) {
    return Event{.data = event::OutputRefused{.refusal = line::OutputRefusal{3}, .group = group}};
  };
  for (std::uint16_t group = 0; group < 4; ++group) {
    Event event = refused(group);
    EXPECT_TRUE(limit.admit(event)) << group;
  }
  Event again = refused(2);
  EXPECT_FALSE(limit.admit(again));
  Event frame = malformed(0x585, milliseconds(1));
  EXPECT_TRUE(limit.admit(frame));
  frame = malformed(0x585, milliseconds(2));
  frame.get<event::MalformedFrame>()->length = 7;
  EXPECT_FALSE(limit.admit(frame)) << "the value of this kind is ignored";
}

TEST(RepeatLimit, TransfersAreThoseOfAnObject) {
  RepeatLimit limit;
  event::SdoTransfer data{.size = 13, .index = 0x5555, .sub = 0x55, .download = true};
  data.data.fill(std::byte{0x55});
  Event transfer{.data = data};
  Event other = transfer;
  other.get<event::SdoTransfer>()->sub = 1;
  EXPECT_TRUE(limit.admit(transfer));
  EXPECT_TRUE(limit.admit(other));
  transfer.get<event::SdoTransfer>()->data[0] = std::byte{1};
  EXPECT_FALSE(limit.admit(transfer));
  EXPECT_FALSE(limit.admit(transfer));
  transfer.time = Instant{milliseconds(1000)};
  EXPECT_TRUE(limit.admit(transfer));
  data.data[0] = std::byte{1};
  data.suppressed = 2;
  EXPECT_EQ(transfer.data, EventData(data));
}

TEST(RepeatLimit, RareOnesAreAsTheyWere) {
  RepeatLimit limit;
  for (int i = 0; i < 3; ++i) {
    Event event = malformed(0x585, milliseconds(1000 * i));
    EXPECT_TRUE(limit.admit(event));
    EXPECT_EQ(event.data, malformed(0x585, {}).data);
  }
}

TEST(RepeatLimit, TheCountLeavesTheOtherMembersAsTheyAre) {
  RepeatLimit limit;
  for (const int ms : {0, 1, 1000}) {
    event::MalformedFrame frame{.identifier = 0x585, .length = 1};
    Event event{.time = Instant{milliseconds(ms)}, .node = 5, .data = frame};
    EXPECT_EQ(limit.admit(event), ms != 1);
    frame.suppressed = ms == 1000 ? 1U : 0U;
    EXPECT_EQ(event.data, EventData(frame));
  }
}

TEST(RepeatLimit, TheLastOfASeriesIsToldWhenTheSecondIsOver) {
  RepeatLimit limit;
  const auto now = [](int ms) { return Instant{milliseconds(ms)}; };
  EXPECT_EQ(limit.next_wake(), kNever);
  for (int ms = 0; ms < 10; ++ms) {
    Event event = malformed(0x585, milliseconds(ms));
    event.get<event::MalformedFrame>()->data[0] = static_cast<std::byte>(ms);
    EXPECT_EQ(limit.admit(event), ms == 0);
  }
  EXPECT_EQ(limit.next_wake(), now(1000));
  EXPECT_FALSE(limit.pop_due(now(999)));
  const auto last = limit.pop_due(now(1500));
  ASSERT_TRUE(last);
  EXPECT_EQ(last->time, now(1000));
  EXPECT_EQ(frame_of(*last).identifier, 0x585U);
  EXPECT_EQ(frame_of(*last).data[0], std::byte{9});
  EXPECT_EQ(held_back(*last), 8U) << "8 others were suppressed";
  EXPECT_FALSE(limit.pop_due(now(9999)));
  EXPECT_EQ(limit.next_wake(), kNever);
  Event soon = malformed(0x585, milliseconds(1999));
  EXPECT_FALSE(limit.admit(soon)) << "within a second of the last report";
  const auto alone = limit.pop_due(now(2000));
  ASSERT_TRUE(alone);
  EXPECT_EQ(held_back(*alone), 0U) << "no other event was suppressed";
}

TEST(RepeatLimit, WhatWasToldOfInTimeIsNotToldAgain) {
  RepeatLimit limit;
  for (const int ms : {0, 500, 1000}) {
    Event event = malformed(0x585, milliseconds(ms));
    EXPECT_EQ(limit.admit(event), ms != 500);
  }
  EXPECT_EQ(limit.next_wake(), kNever);
}

TEST(RepeatLimit, EachPlaceHasItsOwnSecond) {
  RepeatLimit limit;
  for (std::uint32_t id = 0; id < 20; ++id) {
    for (const int more : {0, 1}) {
      Event event = malformed(id, milliseconds(10 * id + static_cast<unsigned>(more)));
      (void)limit.admit(event);
    }
  }
  std::vector<std::uint32_t> told;
  while (const auto event = limit.pop_due(Instant{milliseconds(5000)})) {
    told.push_back(frame_of(*event).identifier);
  }
  ASSERT_EQ(told.size(), 17U) << "16 places and the shared one";
  for (std::uint32_t id = 0; id < 16; ++id) {
    EXPECT_EQ(told[id], id);
  }
}

TEST(RepeatLimit, IdentifiersAndNodesAreLimitedApart) {
  RepeatLimit limit;
  for (const auto& [id, node] : {std::pair{0x585U, 5}, {0x586U, 5}, {0x585U, 6}}) {
    Event event = malformed(id, milliseconds(1), static_cast<std::uint8_t>(node));
    EXPECT_TRUE(limit.admit(event)) << id << ' ' << node;
    EXPECT_FALSE(limit.admit(event)) << id << ' ' << node;
  }
}

TEST(RepeatLimit, FurtherIdentifiersShareOnePlaceUntilOneIsFree) {
  RepeatLimit limit;
  constexpr std::uint32_t kPlaces = RepeatLimit::kPlaces;
  for (std::uint32_t id = 0; id < kPlaces + 10; ++id) {
    Event event = malformed(id, milliseconds(1));
    EXPECT_EQ(limit.admit(event), id <= kPlaces) << id;
  }
  Event shared = malformed(0x100, milliseconds(1000));
  EXPECT_FALSE(limit.admit(shared));
  Event later = malformed(0x101, milliseconds(1001));
  EXPECT_TRUE(limit.admit(later)) << "a free place: the other events are old";
  EXPECT_EQ(held_back(later), 10U) << "events suppressed in the shared place";
}

// An event that takes over the place of an ended series reports the events suppressed in that
// series.
TEST(RepeatLimit, TheLastCountOfAStormIsToldWhenItsPlaceIsNeeded) {
  RepeatLimit limit;
  constexpr std::uint32_t kPlaces = RepeatLimit::kPlaces;
  for (std::uint32_t id = 0; id < kPlaces; ++id) {
    for (const int ms : {0, 1, 2}) {
      Event event = malformed(id, milliseconds(ms));
      EXPECT_EQ(limit.admit(event), ms == 0);
    }
  }
  Event other = malformed(0x100, milliseconds(1000));
  EXPECT_TRUE(limit.admit(other));
  EXPECT_EQ(held_back(other), 2U);
  Event again = malformed(0x100, milliseconds(2000));
  EXPECT_TRUE(limit.admit(again));
  EXPECT_EQ(held_back(again), 0U) << "reported once";
}

TEST(RepeatLimit, PlacesWithNothingToTellAreUsedFirst) {
  RepeatLimit limit;
  constexpr std::uint32_t kPlaces = RepeatLimit::kPlaces;
  for (std::uint32_t id = 0; id < kPlaces; ++id) {
    Event event = malformed(id, milliseconds(0));
    EXPECT_TRUE(limit.admit(event));
    EXPECT_TRUE(id + 1 == kPlaces || !limit.admit(event));
  }
  Event other = malformed(0x100, milliseconds(1000));
  EXPECT_TRUE(limit.admit(other));
  EXPECT_EQ(held_back(other), 0U);
  for (std::uint32_t id = 0; id + 1 < kPlaces; ++id) {
    Event event = malformed(id, milliseconds(1000));
    EXPECT_TRUE(limit.admit(event));
    EXPECT_EQ(held_back(event), 1U) << "each place keeps its own count";
  }
}

Event written(std::uint16_t index, Duration when, std::uint8_t value = 0) {
  event::ObjectWritten object{.size = 1, .index = index};
  object.data[0] = std::byte{value};
  return {.time = Instant{when}, .node = 5, .data = object};
}

int value_of(const event::ObjectWritten& object) {
  return std::to_integer<int>(object.data[0]);
}

TEST(RepeatLimit, OfAWrittenObjectSomeAreToldAtOnceAndThenTheNewestOfEachSecond) {
  RepeatLimit limit = RepeatLimit::that_keeps_newest(4, 3);
  // Time in ms, value, number of suppressed events before it
  std::vector<std::tuple<int, int, unsigned>> told;
  const auto note = [&told](int ms, const Event& event) {
    const auto& object = std::get<event::ObjectWritten>(event.data);
    told.emplace_back(ms, value_of(object), object.suppressed);
  };
  for (int ms = 0; ms < 2500; ++ms) {
    while (const auto due = limit.pop_due(Instant{milliseconds(ms)})) {
      note(ms, *due);
    }
    if (ms < 100) {
      Event event = written(0x2100, milliseconds(ms), static_cast<std::uint8_t>(ms));
      if (limit.admit(event)) {
        note(ms, event);
      }
    }
  }
  const std::vector<std::tuple<int, int, unsigned>> expected{
      {0, 0, 0}, {1, 1, 0}, {2, 2, 0}, {1000, 99, 96}};
  EXPECT_EQ(told, expected);
}

TEST(RepeatLimit, TheNewestValueOfEachObjectIsToldWhateverElseIsWritten) {
  RepeatLimit limit = RepeatLimit::that_keeps_newest(4, 1);
  std::map<unsigned, int> newest;
  const auto note = [&newest](const Event& event) {
    const auto& object = std::get<event::ObjectWritten>(event.data);
    newest[object.index] = value_of(object);
  };
  constexpr std::uint16_t kObjects = 20;
  for (std::uint8_t round = 0; round < 30; ++round) {
    const Duration when = milliseconds(100 * round);
    for (std::uint16_t index = 0; index < kObjects; ++index) {
      Event event = written(index, when, round);
      if (limit.admit(event)) {
        note(event);
      }
    }
    while (const auto due = limit.pop_due(Instant{when})) {
      note(*due);
    }
  }
  while (const auto due = limit.pop_due(Instant{std::chrono::seconds(10)})) {
    note(*due);
  }
  for (std::uint16_t index = 0; index < kObjects; ++index) {
    EXPECT_EQ(newest[index], 29) << index;
  }
}

}  // namespace
}  // namespace linegate

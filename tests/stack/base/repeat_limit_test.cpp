// SPDX-License-Identifier: Apache-2.0
#include "stack/base/repeat_limit.h"

#include <map>
#include <tuple>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "stack/base/byte_order.h"

namespace linegate {
namespace {

using std::chrono::milliseconds;

// The event of a malformed frame with 8 data bytes.
Event malformed(std::uint32_t id, Duration when, std::uint8_t node = 5) {
  Event event;
  event.time = Instant{when};
  event.kind = EventKind::malformed_frame;
  event.node = node;
  event.length = 8;
  event.code = id;
  event.data.fill(std::byte{0xAA});
  return event;
}

std::uint32_t held_back(const Event& event) {
  return event.length < 12 ? 0 : load_le<std::uint32_t>(event.data.data() + 8);
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
  Event refused;
  refused.kind = EventKind::output_refused;
  refused.code = 3;
  for (refused.value = 0; refused.value < 4; ++refused.value) {
    EXPECT_TRUE(limit.admit(refused)) << refused.value;
  }
  refused.value = 2;
  EXPECT_FALSE(limit.admit(refused));
  Event frame = malformed(0x585, milliseconds(1));
  EXPECT_TRUE(limit.admit(frame));
  frame = malformed(0x585, milliseconds(2));
  frame.value = 7;  // another length
  EXPECT_FALSE(limit.admit(frame)) << "the value of this kind is ignored";
}

TEST(RepeatLimit, TransfersAreThoseOfAnObjectAndSayTheCountInTheirCode) {
  RepeatLimit limit;
  Event transfer;
  transfer.kind = EventKind::sdo_transfer;
  transfer.code = 1;
  transfer.length = 16;
  transfer.data.fill(std::byte{0x55});
  Event other = transfer;
  other.data[2] = std::byte{1};  // sub-index
  EXPECT_TRUE(limit.admit(transfer));
  EXPECT_TRUE(limit.admit(other));
  transfer.data[3] = std::byte{1};  // the value
  EXPECT_FALSE(limit.admit(transfer));
  EXPECT_FALSE(limit.admit(transfer));
  transfer.time = Instant{milliseconds(1000)};
  EXPECT_TRUE(limit.admit(transfer));
  EXPECT_EQ(transfer.code, 0x2'0001U);
  EXPECT_EQ(transfer.length, 16U);
  EXPECT_EQ(transfer.data[8], std::byte{0x55});
}

TEST(RepeatLimit, RareOnesAreAsTheyWere) {
  RepeatLimit limit;
  for (int i = 0; i < 3; ++i) {
    Event event = malformed(0x585, milliseconds(1000 * i));
    EXPECT_TRUE(limit.admit(event));
    EXPECT_EQ(event.length, 8U);
    EXPECT_EQ(event.data[8], std::byte{0xAA});
  }
}

TEST(RepeatLimit, TheCountHasItsPlaceAfterShortData) {
  RepeatLimit limit;
  for (const int ms : {0, 1, 1000}) {
    Event event = malformed(0x585, milliseconds(ms));
    event.length = 1;
    event.data.fill(std::byte{0});
    EXPECT_EQ(limit.admit(event), ms != 1);
    EXPECT_EQ(event.length, ms == 1000 ? 12U : 1U);
    EXPECT_EQ(held_back(event), ms == 1000 ? 1U : 0U);
  }
}

TEST(RepeatLimit, TheLastOfASeriesIsToldWhenTheSecondIsOver) {
  RepeatLimit limit;
  const auto now = [](int ms) { return Instant{milliseconds(ms)}; };
  EXPECT_EQ(limit.next_wake(), kNever);
  for (int ms = 0; ms < 10; ++ms) {
    Event event = malformed(0x585, milliseconds(ms));
    event.data[0] = static_cast<std::byte>(ms);
    EXPECT_EQ(limit.admit(event), ms == 0);
  }
  EXPECT_EQ(limit.next_wake(), now(1000));
  EXPECT_FALSE(limit.take_due(now(999)));
  const auto last = limit.take_due(now(1500));
  ASSERT_TRUE(last);
  EXPECT_EQ(last->time, now(1000));
  EXPECT_EQ(last->code, 0x585U);
  EXPECT_EQ(last->data[0], std::byte{9});
  EXPECT_EQ(held_back(*last), 8U) << "8 others were suppressed";
  EXPECT_FALSE(limit.take_due(now(9999)));
  EXPECT_EQ(limit.next_wake(), kNever);
  Event soon = malformed(0x585, milliseconds(1999));
  EXPECT_FALSE(limit.admit(soon)) << "within a second of the last report";
  const auto alone = limit.take_due(now(2000));
  ASSERT_TRUE(alone);
  EXPECT_EQ(alone->length, 8U) << "no other event was suppressed";
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
  while (const auto event = limit.take_due(Instant{milliseconds(5000)})) {
    told.push_back(event->code);
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
  Event event;
  event.time = Instant{when};
  event.kind = EventKind::object_written;
  event.node = 5;
  event.length = 4;
  store_le(event.data.data(), index);
  event.data[3] = std::byte{value};
  return event;
}

TEST(RepeatLimit, OfAWrittenObjectSomeAreToldAtOnceAndThenTheNewestOfEachSecond) {
  RepeatLimit limit = RepeatLimit::that_keeps_newest(4, 3);
  // Time in ms, value, number of suppressed events before it
  std::vector<std::tuple<int, int, unsigned>> told;
  const auto note = [&told](int ms, const Event& event) {
    told.emplace_back(ms, std::to_integer<int>(event.data[3]), event.code);
  };
  for (int ms = 0; ms < 2500; ++ms) {
    while (const auto due = limit.take_due(Instant{milliseconds(ms)})) {
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
    newest[load_le<std::uint16_t>(event.data.data())] = std::to_integer<int>(event.data[3]);
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
    while (const auto due = limit.take_due(Instant{when})) {
      note(*due);
    }
  }
  while (const auto due = limit.take_due(Instant{std::chrono::seconds(10)})) {
    note(*due);
  }
  for (std::uint16_t index = 0; index < kObjects; ++index) {
    EXPECT_EQ(newest[index], 29) << index;
  }
}

}  // namespace
}  // namespace linegate

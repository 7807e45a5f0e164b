// SPDX-License-Identifier: Apache-2.0
// Which values of a line the value history stores, and when.
#include "gateway/publish/value_sampler.h"

#include <gtest/gtest.h>

namespace linegate::gateway {
namespace {

using namespace std::chrono_literals;

class ValueSamplerTest : public testing::Test {
 protected:
  ValueSamplerTest() {
    layouts_[0].direction = image::Direction::inputs;
    layouts_[0].id = 1;
    layouts_[0].entries = {entry("inlet.Temperature", 0, 16, od::DataType::integer16),
                           entry("inlet.Flag", 19, 1, od::DataType::boolean)};
    layouts_[1].direction = image::Direction::outputs;
  }

  static image::Entry entry(const std::string& name, std::uint32_t offset, std::uint16_t bits,
                            od::DataType type) {
    image::Entry out;
    out.name = name;
    out.bit_offset = offset;
    out.bit_length = bits;
    out.type = type;
    return out;
  }
  // valid: bit i of the i-th entry
  static image::Snapshot snapshot(Instant time, std::uint16_t temperature, bool flag,
                                  std::uint64_t valid = 3) {
    image::Snapshot out;
    out.acquired = time;
    out.valid = {valid};
    out.bytes = {static_cast<std::byte>(temperature & 0xFFU),
                 static_cast<std::byte>(temperature >> 8U),
                 flag ? std::byte{0x08} : std::byte{0xF7}};
    return out;
  }
  ValueSampler sampler(std::vector<std::string> names) const {
    config::History plan;
    for (std::string& name : names) {
      plan.entries.push_back({image::Direction::inputs, 5, std::move(name)});
    }
    return {plan, "press", layouts_};
  }
  Instant store(ValueSampler& from, Instant now) {
    return from.store_due(now, {1h, ClockQuality::synchronised}, [&](StoredValue value) {
      if (has_room_) {
        stored_.push_back(std::move(value));
      }
      return has_room_;
    });
  }

  ValueSampler::Layouts layouts_;
  std::vector<StoredValue> stored_;
  bool has_room_ = true;
};

TEST_F(ValueSamplerTest, TheFirstValueIsStoredWithItsTimeAndType) {
  ValueSampler of = sampler({"inlet.Temperature", "inlet.Flag"});
  EXPECT_EQ(store(of, Instant(1s)), kNever);
  EXPECT_TRUE(stored_.empty()) << "an entry that was never valid has no history";
  of.add(snapshot(Instant(2s), 0xFF85, true));
  EXPECT_EQ(store(of, Instant(3s)), kNever);
  ASSERT_EQ(stored_.size(), 2U);
  EXPECT_EQ(*stored_[0].entry,
            (ValueEntry{"press", image::Direction::inputs, 5, "inlet.Temperature"}));
  EXPECT_EQ(stored_[0].time, Instant(2s) + 1h);
  EXPECT_EQ(stored_[0].clock, ClockQuality::synchronised);
  EXPECT_EQ(stored_[0].type, od::DataType::integer16);
  EXPECT_EQ(stored_[0].bits, 16U);
  EXPECT_EQ(stored_[0].value, 0xFF85U);
  EXPECT_EQ(stored_[1].value, 1U) << "a bit in the middle of a byte";
  EXPECT_EQ(stored_[1].bits, 1U);
}

TEST_F(ValueSamplerTest, AValueHasTheScalingOfItsLayout) {
  auto& entries = layouts_[static_cast<std::size_t>(image::Direction::inputs)].entries;
  const auto temperature = std::ranges::find(entries, "inlet.Temperature", &image::Entry::name);
  temperature->scaling = {"bar", 0.1, 0};
  ValueSampler of = sampler({"inlet.Temperature", "inlet.Flag"});
  of.add(snapshot(Instant(2s), 7, true));
  store(of, Instant(2s));
  ASSERT_EQ(stored_.size(), 2U);
  ASSERT_NE(stored_[0].scaling, nullptr);
  EXPECT_EQ(*stored_[0].scaling, (od::Scaling{"bar", 0.1, 0}));
  EXPECT_EQ(stored_[1].scaling, nullptr);
  of.use(layouts_, Instant(3s));
  of.add(snapshot(Instant(4s), 7, true));
  store(of, Instant(4s));
  EXPECT_EQ(stored_.size(), 2U) << "the same scaling of another layout is no change";
  temperature->scaling.unit = "mbar";
  of.use(layouts_, Instant(5s));
  of.add(snapshot(Instant(6s), 7, true));
  store(of, Instant(6s));
  ASSERT_EQ(stored_.size(), 3U) << "the value has another meaning";
  EXPECT_EQ(stored_[2].scaling->unit, "mbar");
}

TEST_F(ValueSamplerTest, AChangeIsStoredAtMostOnceInTheInterval) {
  ValueSampler of = sampler({"inlet.Temperature"});
  of.add(snapshot(Instant(10s), 1, false));
  store(of, Instant(10s));
  for (std::uint16_t i = 2; i <= 9; ++i) {
    const Instant time = Instant(10s) + i * 100ms;
    of.add(snapshot(time, i, i % 2 == 0));
    EXPECT_EQ(store(of, time), Instant(11s));
  }
  EXPECT_EQ(stored_.size(), 1U);
  EXPECT_EQ(store(of, Instant(11s)), kNever);
  ASSERT_EQ(stored_.size(), 2U);
  EXPECT_EQ(stored_[1].value, 9U);
  EXPECT_EQ(stored_[1].time, Instant(10'900ms) + 1h) << "since when it had this value";
  of.add(snapshot(Instant(20s), 9, true));
  EXPECT_EQ(store(of, Instant(20s)), kNever);
  EXPECT_EQ(stored_.size(), 2U) << "without a change nothing is stored";
}

TEST_F(ValueSamplerTest, AValueThatReturnsWithinTheIntervalIsNoChange) {
  ValueSampler of = sampler({"inlet.Temperature"});
  of.add(snapshot(Instant(10s), 1, false));
  store(of, Instant(10s));
  of.add(snapshot(Instant(10'200ms), 2, false));
  store(of, Instant(10'200ms));
  of.add(snapshot(Instant(10'400ms), 1, false));
  EXPECT_EQ(store(of, Instant(11s)), kNever);
  EXPECT_EQ(stored_.size(), 1U);
}

TEST_F(ValueSamplerTest, TheEndOfValidityIsStoredAtOnceAndTheReturnLater) {
  ValueSampler of = sampler({"inlet.Temperature"});
  of.add(snapshot(Instant(10s), 1, false));
  store(of, Instant(10s));
  of.add(snapshot(Instant(10'200ms), 1, false, 0));
  store(of, Instant(10'200ms));
  ASSERT_EQ(stored_.size(), 2U);
  EXPECT_EQ(stored_[1].value, std::nullopt);
  EXPECT_EQ(stored_[1].time, Instant(10'200ms) + 1h);
  of.add(snapshot(Instant(10'300ms), 1, false));
  EXPECT_EQ(store(of, Instant(10'300ms)), Instant(11'200ms));
  EXPECT_EQ(store(of, Instant(11'200ms)), kNever);
  ASSERT_EQ(stored_.size(), 3U);
  EXPECT_EQ(stored_[2].value, 1U);
  EXPECT_EQ(stored_[2].time, Instant(10'300ms) + 1h);
}

TEST_F(ValueSamplerTest, WithoutRoomTheNewestValueIsStoredLater) {
  ValueSampler of = sampler({"inlet.Temperature"});
  has_room_ = false;
  of.add(snapshot(Instant(10s), 1, false));
  EXPECT_EQ(store(of, Instant(10s)), Instant(10'250ms));
  of.add(snapshot(Instant(10'500ms), 2, false));
  has_room_ = true;
  EXPECT_EQ(store(of, Instant(10'600ms)), kNever);
  ASSERT_EQ(stored_.size(), 1U);
  EXPECT_EQ(stored_[0].value, 2U);
}

// The last value of a device that fails is what its maintainer looks for.
TEST_F(ValueSamplerTest, TheLastValueBeforeTheEndIsStored) {
  ValueSampler of = sampler({"inlet.Temperature"});
  of.add(snapshot(Instant(10s), 1, false));
  store(of, Instant(10s));
  of.add(snapshot(Instant(10'100ms), 90, false));
  store(of, Instant(10'100ms));
  of.add(snapshot(Instant(10'200ms), 99, false));
  of.add(snapshot(Instant(10'300ms), 99, false, 0));
  EXPECT_EQ(store(of, Instant(10'300ms)), kNever);
  ASSERT_EQ(stored_.size(), 3U);
  EXPECT_EQ(stored_[1].value, 99U);
  EXPECT_EQ(stored_[1].time, Instant(10'200ms) + 1h);
  EXPECT_EQ(stored_[2].value, std::nullopt);
  EXPECT_EQ(stored_[2].time, Instant(10'300ms) + 1h);
}

// The device returns for a moment, and fails again before its next value is due.
TEST_F(ValueSamplerTest, TheLastValueOfAShortPhaseIsStoredWithItsEnd) {
  ValueSampler of = sampler({"inlet.Temperature"});
  of.add(snapshot(Instant(10s), 1, false));
  store(of, Instant(10s));
  of.add(snapshot(Instant(10'100ms), 1, false, 0));
  store(of, Instant(10'100ms));
  ASSERT_EQ(stored_.size(), 2U);
  for (const Instant begin : {Instant(10'200ms), Instant(10'300ms)}) {  // the newest is stored
    const std::uint16_t value = begin == Instant(10'200ms) ? 20 : 30;
    of.add(snapshot(begin, 5, false));
    EXPECT_EQ(store(of, begin), Instant(11'100ms));
    of.add(snapshot(begin + 50ms, value, false));
    of.add(snapshot(begin + 60ms, value, false, 0));
    EXPECT_EQ(store(of, begin + 60ms), Instant(11'100ms));
  }
  of.add(snapshot(Instant(10'500ms), 4, false));
  EXPECT_EQ(store(of, Instant(11'100ms)), Instant(12'100ms));
  ASSERT_EQ(stored_.size(), 4U);
  EXPECT_EQ(stored_[2].value, 30U);
  EXPECT_EQ(stored_[2].time, Instant(10'350ms) + 1h);
  EXPECT_EQ(stored_[3].value, std::nullopt);
  EXPECT_EQ(stored_[3].time, Instant(10'360ms) + 1h);
  EXPECT_EQ(store(of, Instant(12'100ms)), kNever);
  ASSERT_EQ(stored_.size(), 5U);
  EXPECT_EQ(stored_[4].value, 4U);
  EXPECT_EQ(stored_[4].time, Instant(10'500ms) + 1h);
}

// Such as between two calls, or while the queue has no room for its two values.
TEST_F(ValueSamplerTest, TheFirstPhaseMayBeShort) {
  ValueSampler of = sampler({"inlet.Temperature"});
  of.add(snapshot(Instant(10s), 1, false));
  of.add(snapshot(Instant(10'100ms), 1, false, 0));
  has_room_ = false;
  EXPECT_EQ(store(of, Instant(11s)), Instant(11'250ms));
  const auto store_one = [&](StoredValue value) {
    const bool has_room = stored_.empty();
    if (has_room) {
      stored_.push_back(std::move(value));
    }
    return has_room;
  };
  EXPECT_EQ(of.store_due(Instant(11'250ms), {}, store_one), Instant(11'500ms));
  has_room_ = true;
  EXPECT_EQ(store(of, Instant(11'500ms)), kNever);
  ASSERT_EQ(stored_.size(), 2U);
  EXPECT_EQ(stored_[0].value, 1U);
  EXPECT_EQ(stored_[1].value, std::nullopt);
  EXPECT_EQ(stored_[1].time, Instant(10'100ms) + 1h);
}

// A device that fails and returns all the time cannot fill the journal.
TEST_F(ValueSamplerTest, AFlappingEntryHasAtMostThreeValuesInTheInterval) {
  ValueSampler of = sampler({"inlet.Temperature"});
  for (unsigned i = 0; i < 1000; ++i) {
    const Instant time = Instant(10s) + i * 10ms;
    of.add(snapshot(time, static_cast<std::uint16_t>(i), false, i % 3 == 2 ? 0 : 1));
    store(of, time);
  }
  EXPECT_GE(stored_.size(), 20U);
  EXPECT_LE(stored_.size(), 33U);
  for (std::size_t i = 1; i < stored_.size(); ++i) {
    EXPECT_LT(stored_[i - 1].time, stored_[i].time);
  }
}

// The disk fails while the device does: the gap in its values is not filled by the value before.
TEST_F(ValueSamplerTest, AnEndWithoutRoomIsStoredBeforeTheNextValue) {
  ValueSampler of = sampler({"inlet.Temperature"});
  of.add(snapshot(Instant(10s), 1, false));
  store(of, Instant(10s));
  has_room_ = false;
  of.add(snapshot(Instant(20s), 2, false));
  of.add(snapshot(Instant(21s), 2, false, 0));
  EXPECT_EQ(store(of, Instant(21s)), Instant(21'250ms));
  of.add(snapshot(Instant(30s), 3, false));
  of.add(snapshot(Instant(31s), 3, false, 0));
  of.add(snapshot(Instant(32s), 4, false));
  store(of, Instant(32s));
  has_room_ = true;
  EXPECT_EQ(store(of, Instant(33s)), Instant(34s));
  EXPECT_EQ(store(of, Instant(34s)), Instant(35s));
  EXPECT_EQ(store(of, Instant(35s)), kNever);
  ASSERT_EQ(stored_.size(), 6U);
  EXPECT_EQ(stored_[1].value, 2U);
  EXPECT_EQ(stored_[2].value, std::nullopt);
  EXPECT_EQ(stored_[2].time, Instant(21s) + 1h);
  EXPECT_EQ(stored_[3].value, 3U);
  EXPECT_EQ(stored_[4].value, std::nullopt);
  EXPECT_EQ(stored_[4].time, Instant(31s) + 1h);
  EXPECT_EQ(stored_[5].value, 4U);
}

TEST_F(ValueSamplerTest, EachPlaceInTheImageIsRead) {
  for (std::uint32_t offset = 0; offset < 16; ++offset) {
    for (const std::uint16_t bits : std::vector<std::uint16_t>{1, 7, 8, 9, 31, 56, 63, 64}) {
      layouts_[0].entries = {entry("inlet.Any", offset, bits, od::DataType::unsigned64)};
      ValueSampler of = sampler({"inlet.Any"});
      image::Snapshot some;
      some.acquired = Instant(1s);
      some.valid = {1};
      some.bytes.assign(10, std::byte{0});
      const std::uint64_t value = 0xA5C3'96F0'1E2D'3B87U & (~std::uint64_t{0} >> (64U - bits));
      for (std::uint32_t i = 0; i < 80; ++i) {
        const bool is_set =
            i >= offset && i < offset + bits ? (value >> (i - offset) & 1U) != 0 : i % 2 == 0;
        some.bytes[i / 8] |= static_cast<std::byte>((is_set ? 1U : 0U) << (i % 8));
      }
      of.add(some);
      stored_.clear();
      store(of, Instant(1s));
      ASSERT_EQ(stored_.size(), 1U);
      EXPECT_EQ(stored_[0].value, value) << offset << ' ' << bits;
    }
  }
}

TEST_F(ValueSamplerTest, AnotherLayoutMovesOrRemovesTheEntry) {
  ValueSampler of = sampler({"inlet.Temperature"});
  of.add(snapshot(Instant(10s), 1, false));
  store(of, Instant(10s));
  std::swap(layouts_[0].entries[0], layouts_[0].entries[1]);
  of.use(layouts_, Instant(11s));
  EXPECT_EQ(store(of, Instant(11s)), kNever) << "until a snapshot of the layout comes";
  of.add(snapshot(Instant(12s), 7, false, 2));
  store(of, Instant(12s));
  ASSERT_EQ(stored_.size(), 2U);
  EXPECT_EQ(stored_[1].value, 7U);
  layouts_[0].entries.pop_back();
  of.use(layouts_, Instant(13s));
  store(of, Instant(13s));
  ASSERT_EQ(stored_.size(), 3U);
  EXPECT_EQ(stored_[2].value, std::nullopt);
}

// A snapshot that is too short for its entries, and a name that no layout has.
TEST_F(ValueSamplerTest, WhatIsNotThereIsNotValid) {
  ValueSampler of = sampler({"inlet.Temperature", "inlet.Flag", "inlet.Missing"});
  image::Snapshot small = snapshot(Instant(10s), 5, true);
  small.bytes.resize(2);
  of.add(small);
  store(of, Instant(10s));
  ASSERT_EQ(stored_.size(), 1U);
  small.valid.clear();
  of.add(small);
  store(of, Instant(20s));
  ASSERT_EQ(stored_.size(), 2U);
  EXPECT_EQ(stored_[1].value, std::nullopt);
}

TEST_F(ValueSamplerTest, ANewFileHasThePresentValues) {
  ValueSampler of = sampler({"inlet.Temperature", "inlet.Flag"});
  of.add(snapshot(Instant(10s), 1, false, 1));
  store(of, Instant(10s));
  of.repeat();
  EXPECT_EQ(store(of, Instant(10'100ms)), kNever);
  ASSERT_EQ(stored_.size(), 2U) << "and not that an entry was never valid";
  EXPECT_EQ(stored_[1].value, 1U);
  EXPECT_EQ(stored_[1].time, Instant(10s) + 1h) << "since when it holds";
}

TEST_F(ValueSamplerTest, TheEndOfTheLineStoresAPhaseThatIsNotDue) {
  ValueSampler of = sampler({"inlet.Temperature"});
  for (const Instant begin : {Instant(10s), Instant(10'010ms)}) {
    of.add(snapshot(begin, 1, false));
    of.add(snapshot(begin + 5ms, 1, false, 0));
    store(of, begin + 5ms);
  }
  EXPECT_EQ(stored_.size(), 2U);
  of.add(snapshot(Instant(10'100ms), 3, false));
  EXPECT_TRUE(of.end(Instant(10'200ms), {}, [&](StoredValue value) {
    stored_.push_back(std::move(value));
    return true;
  }));
  ASSERT_EQ(stored_.size(), 4U);
  EXPECT_EQ(stored_[2].value, 3U);
  EXPECT_EQ(stored_[3].value, std::nullopt);
  EXPECT_EQ(stored_[3].time, Instant(10'200ms));
}

TEST_F(ValueSamplerTest, TheEndOfTheLineEndsItsValues) {
  ValueSampler of = sampler({"inlet.Temperature", "inlet.Flag"});
  of.add(snapshot(Instant(10s), 1, false, 1));
  store(of, Instant(10s));
  EXPECT_FALSE(of.end(Instant(10'100ms), {}, [](const StoredValue& /*value*/) { return false; }));
  EXPECT_TRUE(of.end(Instant(10'200ms), {}, [&](StoredValue value) {
    stored_.push_back(std::move(value));
    return true;
  }));
  EXPECT_EQ(stored_.back().time, Instant(10'100ms));
  ASSERT_EQ(stored_.size(), 2U);
  EXPECT_EQ(stored_[1].value, std::nullopt);
  EXPECT_EQ(stored_[1].entry->name, "inlet.Temperature");
}

}  // namespace
}  // namespace linegate::gateway

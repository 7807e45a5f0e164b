// SPDX-License-Identifier: Apache-2.0
#include "stack/line/bus_load.h"

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "stack/can/frame.h"
#include "stack/can/traffic.h"
#include "stack/can/wire.h"

namespace linegate::line {
namespace {

using can::Frame;

constexpr Instant kBegin{std::chrono::seconds(10)};
constexpr std::uint8_t kFast = Frame::kFd | Frame::kBitRateSwitch;

// Random data, which causes fewer stuff bits than typical device data.
std::vector<Frame> random_frames(std::size_t count, std::uint8_t length, std::uint8_t flags) {
  std::mt19937 random(1);
  std::vector<Frame> out(count, can::make_frame(0x185));
  for (Frame& frame : out) {
    frame.length = length;
    frame.flags = flags;
    for (std::size_t i = 0; i < length; ++i) {
      frame.data[i] = static_cast<std::byte>(random());
    }
  }
  return out;
}

// The bus load in a second with these frames.
std::uint16_t load_of(BusLoad& load, const std::vector<Frame>& frames) {
  can::Traffic traffic;
  load.advance(traffic, kBegin);
  for (const Frame& frame : frames) {
    traffic.add(frame);
  }
  if (load.wants_fast()) {
    load.count_fast(frames);
  }
  load.advance(traffic, kBegin + std::chrono::seconds(1));
  return load.permille();
}

// The exact time on the wire, computed from each bit.
double exact(const std::vector<Frame>& frames, std::uint32_t nominal, std::uint32_t data) {
  Duration busy{};
  for (const Frame& frame : frames) {
    busy += can::wire_time(frame, nominal, data) + can::bit_time(can::kIntermissionBits, nominal);
  }
  return std::chrono::duration<double, std::milli>(busy).count();
}

// The estimate assumes a stuff bit for a tenth of the bits that can be stuffed: it is at least the
// load of random data, and at most a tenth more.
void expect_estimate(std::uint16_t load, double wire) {
  EXPECT_GE(load, wire - 1);
  EXPECT_LE(load, wire * 1.1 + 1);
}

TEST(BusLoad, OfAnUnknownBitRateIsNone) {
  BusLoad load(0);
  EXPECT_EQ(load_of(load, random_frames(1000, 8, 0)), 0U);
}

TEST(BusLoad, OfClassicalFramesIsThatOfTheWire) {
  const auto frames = random_frames(1000, 8, 0);
  BusLoad load(250'000);
  expect_estimate(load_of(load, frames), exact(frames, 250'000, 0));
  BusLoad learnt(0);
  learnt.set_bit_rates(250'000, 0);
  EXPECT_EQ(load_of(learnt, frames), load.permille());
}

TEST(BusLoad, OfTheDataPhaseIsReckonedAtItsOwnBitRate) {
  for (const auto length : std::initializer_list<std::uint8_t>{0, 8, 16, 20, 64}) {
    const auto frames = random_frames(1000, length, kFast);
    BusLoad load(0);
    load.set_bit_rates(500'000, 2'000'000);
    SCOPED_TRACE(int{length});
    expect_estimate(load_of(load, frames), exact(frames, 500'000, 2'000'000));
  }
}

TEST(BusLoad, WithoutTheDataBitRateIsAnUpperBound) {
  const auto frames = random_frames(100, 64, kFast);
  BusLoad load(500'000);
  EXPECT_FALSE(load.wants_fast());
  EXPECT_GT(load_of(load, frames), exact(frames, 500'000, 2'000'000));
}

TEST(BusLoad, FramesWithoutBitRateSwitchAreAtTheNominalOne) {
  const auto frames = random_frames(100, 8, 0);
  BusLoad load(500'000);
  load.set_bit_rates(500'000, 2'000'000);
  EXPECT_NEAR(load_of(load, frames), exact(frames, 500'000, 0), 5);
}

}  // namespace
}  // namespace linegate::line

// SPDX-License-Identifier: Apache-2.0
#include "stack/line/outputs.h"

#include <gtest/gtest.h>

namespace linegate::line {
namespace {

using std::chrono::milliseconds;

constexpr Instant kStart{std::chrono::seconds(10)};

image::Entry entry(std::uint32_t bit_offset, std::uint16_t bits, std::uint16_t pdo) {
  image::Entry out;
  out.bit_offset = bit_offset;
  out.bit_length = bits;
  out.local_pdo = pdo;
  return out;
}

// Two bits and a byte in PDO 1, two 16-bit values in PDO 2.
image::Layout layout() {
  image::Layout out;
  out.direction = image::Direction::outputs;
  out.id = 77;
  out.byte_size = 6;
  out.entries = {entry(0, 1, 1), entry(1, 1, 1), entry(8, 8, 1), entry(16, 16, 2),
                 entry(32, 16, 2)};
  return out;
}

OutputValue value(std::uint32_t which, std::uint8_t length) {
  return {.entry = which, .length = length, .data = {}};
}

class OutputsTest : public testing::Test {
 protected:
  image::Layout layout_ = layout();
  Outputs outputs_{layout_,
                   {{.number = 1, .name = "left", .entries = {0, 1, 2}},
                    {.number = 2, .name = "right", .entries = {3, 4}, .send_always = true}}};

  static OutputWrite write(std::uint16_t group) {
    OutputWrite out;
    out.group = group;
    out.layout_id = 77;
    out.arming = 1;
    out.watchdog = milliseconds(100);
    return out;
  }
};

TEST_F(OutputsTest, WithoutGroupsThereIsOneOfAllEntries) {
  const Outputs all(layout_, {});
  ASSERT_EQ(all.groups().size(), 1U);
  EXPECT_EQ(all.group(0)->config.entries.size(), 5U);
  OutputWrite request = write(0);
  request.values = {value(0, 1), value(4, 2)};
  EXPECT_EQ(all.check(request), OutputRefusal::none);
}

TEST_F(OutputsTest, EveryRefusalHasItsReason) {
  EXPECT_EQ(outputs_.check(write(9)), OutputRefusal::unknown_group);

  OutputWrite stale = write(1);
  stale.layout_id = 78;
  EXPECT_EQ(outputs_.check(stale), OutputRefusal::stale_layout);

  OutputWrite foreign = write(1);
  foreign.values = {value(3, 2)};
  EXPECT_EQ(outputs_.check(foreign), OutputRefusal::unknown_entry);
  foreign.values = {value(5, 2)};
  EXPECT_EQ(outputs_.check(foreign), OutputRefusal::unknown_entry);

  OutputWrite length = write(2);
  length.values = {value(3, 1)};
  EXPECT_EQ(outputs_.check(length), OutputRefusal::bad_length);

  OutputWrite reactions = write(1);
  reactions.reactions = kNmtStop | kNmtResetNode;
  EXPECT_EQ(outputs_.check(reactions), OutputRefusal::bad_reaction);
  reactions.reactions = 0x80;
  EXPECT_EQ(outputs_.check(reactions), OutputRefusal::bad_reaction);
  reactions.reactions = kNmtStop | kSendEmcy | kZeroOutputs | kHeartbeatOff;
  EXPECT_EQ(outputs_.check(reactions), OutputRefusal::none);
}

TEST_F(OutputsTest, AnEntryThatFollowsAnInputHasAReasonOfItsOwn) {
  const Outputs bound(layout_, {}, {4});
  OutputWrite one = write(0);
  one.values = {value(4, 2)};
  EXPECT_EQ(bound.check(one), OutputRefusal::bound_entry);
  OutputWrite run = write(0);
  run.bytes = {{.offset = 2, .data = std::vector<std::byte>(4)}};
  EXPECT_EQ(bound.check(run), OutputRefusal::bound_entry);
  one.values = {value(5, 2)};
  EXPECT_EQ(bound.check(one), OutputRefusal::unknown_entry);
}

TEST_F(OutputsTest, AGroupOfAnotherGatewayTakesItsValuesAlone) {
  const Outputs outputs(layout_, {{.number = 9, .name = "far", .entries = {4}, .forwarded = true}});
  ASSERT_EQ(outputs.groups().size(), 2U) << "and that of all other entries";
  EXPECT_EQ(outputs.groups().back().config.number, 0U);
  OutputWrite far = write(9);
  far.values = {value(4, 2)};
  EXPECT_EQ(outputs.check(far), OutputRefusal::bound_entry);
  far.forwarded = true;
  EXPECT_EQ(outputs.check(far), OutputRefusal::none);
  EXPECT_TRUE(outputs.is_bound(4)) << "single values are refused, too";
  OutputWrite all = write(0);
  all.values = {value(4, 2)};
  EXPECT_EQ(outputs.check(all), OutputRefusal::bound_entry);
  all.forwarded = true;
  EXPECT_EQ(outputs.check(all), OutputRefusal::bound_entry) << "not a group of another gateway";
}

// CMM_HandShake of the IXXAT CANopen Manager API manual.
TEST_F(OutputsTest, AWriteWithoutValuesFeedsTheWatchdog) {
  EXPECT_EQ(outputs_.check(write(1)), OutputRefusal::none);
  EXPECT_TRUE(outputs_.accept(write(1), kStart));
  outputs_.accept(write(1), kStart + milliseconds(60));
  EXPECT_EQ(outputs_.expire(kStart + milliseconds(159)), nullptr);
  EXPECT_NE(outputs_.expire(kStart + milliseconds(160)), nullptr);
  EXPECT_EQ(outputs_.check(write(1)), OutputRefusal::not_armed);
}

TEST_F(OutputsTest, BytesMustCoverEntriesOfTheGroupWhole) {
  const auto with = [](std::uint16_t group, std::uint32_t offset, std::size_t length) {
    OutputWrite out = write(group);
    out.bytes = {{.offset = offset, .data = std::vector<std::byte>(length)}};
    return out;
  };
  EXPECT_EQ(outputs_.check(with(1, 0, 2)), OutputRefusal::none);
  EXPECT_EQ(outputs_.check(with(1, 0, 1)), OutputRefusal::none);
  EXPECT_EQ(outputs_.check(with(2, 2, 4)), OutputRefusal::none);
  EXPECT_EQ(outputs_.check(with(2, 4, 2)), OutputRefusal::none);
  EXPECT_EQ(outputs_.check(with(1, 0, 4)), OutputRefusal::unknown_entry);
  EXPECT_EQ(outputs_.check(with(2, 1, 3)), OutputRefusal::unknown_entry);
  EXPECT_EQ(outputs_.check(with(2, 2, 1)), OutputRefusal::bad_length);
  EXPECT_EQ(outputs_.check(with(2, 3, 3)), OutputRefusal::bad_length);
  EXPECT_EQ(outputs_.check(with(2, 4, 3)), OutputRefusal::bad_length);
  EXPECT_EQ(outputs_.check(with(2, 0xFFFF'FFFF, 2)), OutputRefusal::bad_length);
  EXPECT_EQ(outputs_.check(with(1, 0, 0)), OutputRefusal::bad_length);
}

TEST_F(OutputsTest, TheWatchdogIsArmedByTheFirstWriteAndFedByEveryOne) {
  EXPECT_EQ(outputs_.next_wake(), kNever);
  EXPECT_TRUE(outputs_.accept(write(1), kStart));
  EXPECT_EQ(outputs_.next_wake(), kStart + milliseconds(100));
  EXPECT_FALSE(outputs_.accept(write(1), kStart + milliseconds(60)));
  EXPECT_EQ(outputs_.expire(kStart + milliseconds(159)), nullptr);
  const Outputs::Group* expired = outputs_.expire(kStart + milliseconds(160));
  ASSERT_NE(expired, nullptr);
  EXPECT_EQ(expired->config.number, 1);
  EXPECT_EQ(outputs_.expire(kStart + milliseconds(500)), nullptr);
}

TEST_F(OutputsTest, AfterAReactionOnlyANewArmingNumberIsApplied) {
  outputs_.accept(write(1), kStart);
  ASSERT_NE(outputs_.expire(kStart + milliseconds(100)), nullptr);
  OutputWrite again = write(1);
  EXPECT_EQ(outputs_.check(again), OutputRefusal::not_armed);
  EXPECT_EQ(outputs_.check(write(2)), OutputRefusal::none) << "groups are independent";
  again.arming = 2;
  EXPECT_EQ(outputs_.check(again), OutputRefusal::none);
  EXPECT_TRUE(outputs_.accept(again, kStart + milliseconds(200)));
  again.arming = 1;
  EXPECT_EQ(outputs_.check(again), OutputRefusal::not_armed) << "armed before the reaction";
}

TEST_F(OutputsTest, WithoutAWatchdogTimeNothingFires) {
  OutputWrite request = write(1);
  request.watchdog = Duration::zero();
  outputs_.accept(request, kStart);
  EXPECT_EQ(outputs_.next_wake(), kNever);
  EXPECT_EQ(outputs_.expire(kStart + std::chrono::hours(1)), nullptr);
}

TEST_F(OutputsTest, AWatchdogBeyondTheEndOfTimeNeverFires) {
  OutputWrite request = write(1);
  request.watchdog = Duration::max();
  outputs_.accept(request, kStart);
  EXPECT_EQ(outputs_.next_wake(), kNever);
  EXPECT_EQ(outputs_.expire(kStart + std::chrono::hours(1)), nullptr);
}

}  // namespace
}  // namespace linegate::line

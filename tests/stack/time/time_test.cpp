// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "stack/od/objects.h"
#include "stack/time/service.h"

#include "tests/stack/node/objects.h"

namespace linegate::time {
namespace {

using namespace std::chrono_literals;
using testing::at;
using testing::data_of;
using testing::frame_at;
using testing::pop_frames;

// 2026-11-21 10:00:00.123 UTC.
constexpr Duration kSomeUtc = std::chrono::seconds(1'795'255'200) + 123ms;
constexpr TimeOfDay kSomeTime{36'000'123, 15665};

TEST(TimeMessage, UtcThereAndBack) {
  const std::pair<Duration, TimeOfDay> table[] = {
      {std::chrono::seconds(441'763'200), {0, 0}},  // 1984-01-01
      {std::chrono::seconds(441'763'199 + 86'400) + 999ms, {86'399'999, 0}},
      {std::chrono::seconds(441'763'200 + 86'400), {0, 1}},
      {kSomeUtc, kSomeTime},
      {std::chrono::days(5113 + 65'535), {0, 65'535}},
  };
  for (const auto& [utc, time] : table) {
    EXPECT_EQ(to_time_of_day(utc), time);
    EXPECT_EQ(to_utc(time), utc);
  }
  EXPECT_EQ(to_time_of_day(std::chrono::seconds(441'763'199)), std::nullopt);
  EXPECT_EQ(to_time_of_day(std::chrono::days(5113 + 65'536)), std::nullopt);
}

TEST(TimeMessage, SixBytes) {
  const can::Frame frame = encode(kSomeTime, can::CobId{0x100});
  EXPECT_EQ(frame.id, 0x100U);
  EXPECT_EQ(data_of(frame), (std::vector<int>{0x7B, 0x51, 0x25, 0x02, 0x31, 0x3D}));
  EXPECT_EQ(decode(frame), kSomeTime);
  EXPECT_TRUE(encode(kSomeTime, can::CobId{0x2001'2345}).extended());
}

TEST(TimeMessage, ReservedBitsDoNotCountAndWhatIsNoTimeIsRefused) {
  EXPECT_EQ(decode(frame_at(at(0ms), 0x100, {0x7B, 0x51, 0x25, 0xF2, 0x31, 0x3D})), kSomeTime);
  EXPECT_EQ(decode(frame_at(at(0ms), 0x100, {0x7B, 0x51, 0x25, 0x02, 0x31})), std::nullopt);
  EXPECT_EQ(decode(frame_at(at(0ms), 0x100, {0x7B, 0x51, 0x25, 0x02, 0x31, 0x3D, 0})),
            std::nullopt);
  EXPECT_EQ(decode(frame_at(at(0ms), 0x100, {0x00, 0x5C, 0x26, 0x05, 0, 0})), std::nullopt)
      << "24:00";
}

class TimeServiceTest : public ::testing::Test {
 protected:
  TimeServiceTest() {
    EXPECT_TRUE(dictionary.set_hook(od::objects::kTimeCobId, &service).ok());
    service.set_clock(true);
    service.configure();
    service.set_active(true);
  }

  AbortCode write(std::uint32_t value) {
    return testing::write(dictionary, {od::objects::kTimeCobId, 0}, value);
  }
  // Whether the COB-ID is registered.
  bool wanted(std::uint32_t id) { return dispatch.find(frame_at(at(0ms), id, {})) != nullptr; }
  std::size_t sent() { return pop_frames(transmit).size(); }

  od::Dictionary dictionary =
      testing::dictionary_of({testing::object(0x1012, od::DataType::unsigned32, 0x100)});
  can::Dispatch dispatch;
  can::TransmitQueue transmit;
  Service service{dictionary, dispatch, transmit};
};

TEST_F(TimeServiceTest, AProducerSends) {
  EXPECT_FALSE(service.send(kSomeTime)) << "bit 30 is clear";
  EXPECT_EQ(write(0x4000'0100), AbortCode::none);
  EXPECT_TRUE(service.send(kSomeTime));
  const auto frames = pop_frames(transmit);
  ASSERT_EQ(frames.size(), 1U);
  EXPECT_EQ(frames[0].id, 0x100U);
  service.set_active(false);
  EXPECT_FALSE(service.send(kSomeTime));
}

TEST_F(TimeServiceTest, WithoutAClockTheProducerBitIsRefused) {
  service.set_clock(false);
  EXPECT_EQ(write(0x4000'0100), AbortCode::invalid_value);
  EXPECT_EQ(write(0xC000'0100), AbortCode::invalid_value);
  EXPECT_EQ(write(0x8000'0100), AbortCode::none);
  service.produce_every(1s);
  EXPECT_EQ(write(0x4000'0100), AbortCode::none) << "it sends cyclically";
}

TEST_F(TimeServiceTest, AProducerSendsTheTimeEveryPeriod) {
  EXPECT_EQ(write(0x4000'0100), AbortCode::none);
  service.set_utc(kSomeUtc - at(1s).time_since_epoch());
  service.produce_every(1s);
  EXPECT_LE(service.next_wake(), at(0ms)) << "a call is due";
  service.apply_writes(at(0ms));
  EXPECT_EQ(service.next_wake(), at(1s));
  service.advance(at(999ms));
  EXPECT_EQ(sent(), 0U);
  service.advance(at(1s));
  const auto frames = pop_frames(transmit);
  ASSERT_EQ(frames.size(), 1U);
  EXPECT_EQ(decode(frames[0]), kSomeTime);
  service.advance(at(3500ms));
  EXPECT_EQ(sent(), 1U) << "missed periods are skipped";
  EXPECT_EQ(service.next_wake(), at(4s));
  service.advance(at(4s));
  service.advance(at(5s));
  EXPECT_EQ(sent(), 1U) << "the first frame is still queued";
  service.produce_every(0s);
  EXPECT_EQ(service.next_wake(), kNever);
}

TEST_F(TimeServiceTest, WithoutAClockNothingIsSent) {
  EXPECT_EQ(write(0x4000'0100), AbortCode::none);
  service.produce_every(1s);
  service.advance(at(0s));
  service.advance(at(1s));
  EXPECT_EQ(sent(), 0U);
}

TEST_F(TimeServiceTest, AConsumerKeepsTheLastTimeAndKnowsUtcFromThenOn) {
  EXPECT_FALSE(wanted(0x100));
  EXPECT_EQ(write(0x8000'0100), AbortCode::none);
  EXPECT_TRUE(wanted(0x100));
  EXPECT_EQ(service.network_utc(at(0s)), std::nullopt);
  can::Frame frame = encode(kSomeTime, can::CobId{0x100});
  frame.time = at(2s);
  EXPECT_TRUE(service.receive(frame));
  EXPECT_EQ(service.received()->time, kSomeTime);
  EXPECT_EQ(service.received()->at, at(2s));
  EXPECT_EQ(service.network_utc(at(5s)), kSomeUtc + 3s);
  frame.length = 5;
  EXPECT_FALSE(service.receive(frame));
  EXPECT_EQ(service.received()->at, at(2s));
  service.configure();
  EXPECT_FALSE(service.received());
}

TEST_F(TimeServiceTest, InStoppedTimeIsNotServed) {
  EXPECT_EQ(write(0x8000'0100), AbortCode::none);
  service.set_active(false);
  EXPECT_TRUE(service.receive(encode(kSomeTime, can::CobId{0x100})));
  EXPECT_FALSE(service.received());
}

TEST_F(TimeServiceTest, TheCanIdChangesOnlyWhileNotInUse) {
  EXPECT_EQ(write(0x8000'0100), AbortCode::none);
  EXPECT_EQ(write(0x8000'00F0), AbortCode::invalid_value);
  EXPECT_EQ(write(0xA000'0100), AbortCode::invalid_value) << "the frame format cannot change";
  EXPECT_EQ(write(0xC000'0100), AbortCode::none) << "producer and consumer";
  EXPECT_EQ(write(0x4000'00F0), AbortCode::invalid_value);
  EXPECT_EQ(write(0x0000'00F0), AbortCode::none);
  EXPECT_FALSE(wanted(0x100));
  EXPECT_EQ(write(0x8000'00F0), AbortCode::none);
  EXPECT_TRUE(wanted(0x0F0));
  EXPECT_EQ(write(0x0000'0100), AbortCode::none);
  EXPECT_FALSE(wanted(0x0F0));
}

TEST_F(TimeServiceTest, RestrictedCanIdsAreRefused) {
  for (const std::uint32_t id : {0x000U, 0x07FU, 0x101U, 0x180U, 0x581U, 0x601U, 0x6E0U, 0x701U}) {
    EXPECT_EQ(write(0x8000'0000 | id), AbortCode::invalid_value) << id;
    EXPECT_EQ(write(id), AbortCode::invalid_value) << id;
  }
  EXPECT_EQ(write(0x8000'0800), AbortCode::invalid_value) << "12 bits";
  EXPECT_EQ(write(0xA000'0800), AbortCode::none) << "29-bit identifier";
}

// As in many device files: the object is listed, but not configured.
TEST_F(TimeServiceTest, AnObjectOfZeroIsNoTime) {
  ASSERT_TRUE(dictionary.set(od::Address{od::objects::kTimeCobId, 0}, 0x8000'0000U));
  service.configure();
  EXPECT_FALSE(wanted(0x000));
}

}  // namespace
}  // namespace linegate::time
